"""Lake water after Habib 2009b: the lake's, cut off where a map shows nothing, so that shores are not straight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field

from renderer.units import Color, Number, Unit
from renderer.water.lake_waves import MAP_SIZE, LakeWaves
from renderer.water.technique import MapSpec


class LakeEdges(LakeWaves):
    """Lake water with natural edges: see-through where a map, read through the waves, shows nothing (Habib 2009b).

    The document states no numbers for what a user sets: see ``LakeWaves`` for the defaults. Its Fresnel mode 1 is the
    lake's; every other is mode 0. The key is tested on displayed values in either encoding; the tint is a plain factor.
    """

    shader: ClassVar = "water/lake_edges.glsl"
    title: ClassVar = "Lake water with natural edges (Habib)"
    source: ClassVar = "Habib 2009b"
    blends: ClassVar = True

    technique: Literal["lake_edges"] = "lake_edges"
    wave_height: Number = Field(0.04, ge=0.0, le=2.0)
    """xWaveHeight: a bump of full tilt moves the maps' coordinates by half of this; high waves tear holes at shores."""
    dull_blend_factor: Unit = Field(0.8)
    """xdullBlendFactor: factor on the colour and on the opacity of the water; 0 is black and wholly see-through."""
    tint: Color = (0.95, 1.0, 1.05)
    """Factor on the blended maps."""
    key: Literal["color", "alpha"] = "color"
    """How a place of a map that shows nothing is told: by its colour (as the document does), or by what was drawn."""
    key_threshold: Number = Field(0.1, ge=0.0, le=3.0)
    """A place shows nothing where its red, green and blue, as displayed, are off the clear colour by less in sum."""

    def maps(self) -> Mapping[str, MapSpec]:
        """The mirrored scene with its sky, and what lies under the water, cut exactly at it and without sky.

        Alpha is 1 in the reflection map and 0 in the refraction map where nothing is drawn, and the other where
        something is: the scene's alpha says whether the water lies before it.
        """
        seen = MapSpec(camera="direct", draws_sky=False, clip="below", clear=self.cleared(0.0), wrap="mirror")
        return {
            "reflection": self.reflection(alpha=1.0),
            "refraction": self.published(seen, size=MAP_SIZE),
        }

    def defines(self, period: float | None) -> tuple[str, ...]:
        """The lake's, and how validity is told."""
        names = super().defines(period)
        return (*names, "KEYS_BY_ALPHA") if self.key == "alpha" else names
