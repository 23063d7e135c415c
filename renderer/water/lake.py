"""Lake water after Habib 2009: one bump map, three approximate Fresnel terms, dull colour, fixed highlight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field

from renderer.units import Color, Length, Unit
from renderer.water.lake_waves import MAP_SIZE, LakeWaves, from_display
from renderer.water.technique import MapSpec

ELEVATION = 5.0
"""Metres above the water at which the document cuts the refraction map: "a little bit higher", against gaps."""


class Lake(LakeWaves):
    """Lake water: a bump map moved by the wind, approximate Fresnel, dull colour, fixed highlight (Habib 2009).

    The document states no numbers for what a user sets: see ``LakeWaves`` for the defaults. Constants that the document
    gives as displayed colours are used as they stand where maps are encoded, and as linear light otherwise.
    """

    shader: ClassVar = "water/lake.glsl"
    title: ClassVar = "Lake water (Habib)"
    source: ClassVar = "Habib 2009"

    technique: Literal["lake"] = "lake"
    dull_blend_factor: Unit = Field(0.2)
    """xdullBlendFactor: share of the dull colour over the blended maps, below the highlight; 0 is none."""
    dull_color: Color = from_display(0.1, 0.1, 0.2)
    """Colour that dulls the water; the document's (.1, .1, .2) as displayed."""
    refraction_clip_bias: Length | None = Field(None, ge=-100.0, le=100.0)
    """How far above the water things still enter the refraction map; null is everything, or 5 m as published."""

    def maps(self) -> Mapping[str, MapSpec]:
        """The mirrored scene with its sky, and the scene seen through the water.

        The document's refraction map has no sky and is black where the ground ends, and it keeps what stands less than
        5 m above the water, which ripples then draw onto it. By default the map is the picture without water, sky
        included, and what is not under water is never drawn onto it.
        """
        bias = self.refraction_clip_bias
        if bias is None and self.as_published:
            bias = ELEVATION
        seen = MapSpec(
            camera="direct",
            clip=None if bias is None else "below",
            bias=bias or 0.0,
            clear=self.cleared(0.0),
            wrap="mirror",
        )
        return {
            "reflection": self.reflection(),
            "refraction": self.published(seen, draws_sky=False, size=MAP_SIZE),
        }
