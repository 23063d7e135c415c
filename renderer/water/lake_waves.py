"""What the two lake techniques share: one moving bump map, an approximate Fresnel term, a fixed highlight."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator
from pydantic_core import PydanticCustomError

from renderer.blocks import Block
from renderer.scene.images import ImageReference
from renderer.scene.material import Texture
from renderer.units import Angle, Color, Direction, Length, Number, Unit, Vec2, Vec4, linear_from_srgb, srgb_from_linear
from renderer.water.image_maps import image_name, image_texture
from renderer.water.normal_maps import ripple_slopes
from renderer.water.scroll import Scroll
from renderer.water.technique import MapSpec, PublishedTechnique

WIND_SPEED = 0.01
"""Tiles per second that a wind force of 1 moves the bump map: the document divides milliseconds by 100,000."""
RIPPLES = "ripples"
MAP_SIZE = (512, 512)
"""Pixels of the document's maps, whatever the picture's size."""


def from_display(red: float, green: float, blue: float) -> tuple[float, float, float]:
    """A displayed colour as linear light."""
    return linear_from_srgb(red), linear_from_srgb(green), linear_from_srgb(blue)


class LakeWaves(PublishedTechnique):
    """Flat water whose waves are one bump map, moved by the wind (Habib 2009).

    The documents' world has z upwards; their (x, y, z) is our (x, z, -y). Their texture coordinates on the plane are
    ours: u along x, v along z. They state no numbers for what a user sets. The defaults are those of the published
    demo, but for ``spec_perturb``: the demo's 4 makes one large spot over our bump map, whose slopes are gentle.
    """

    fresnel_mode: Literal[0, 1, 2] = 1
    """Which approximation of the Fresnel term blends the maps."""
    draw_mode: Number = Field(1.0, ge=0.0, le=100.0)
    """xDrawMode: factor on the Fresnel term before it is cut to 0..1; 0 refracts everything."""
    wave_length: Number = Field(0.1, ge=1e-4, le=100.0)
    """xWaveLength: side of the bump map's tile as a share of the plane's sides."""
    normal_map: Annotated[str, image_name("normal_map", (RIPPLES,))] = RIPPLES
    """The bump map: random waves (`ripples`), or the id of an uploaded `normal_map`, whose top is north."""
    wave_height: Number = Field(0.07, ge=0.0, le=2.0)
    """xWaveHeight: a bump of full tilt moves the maps' coordinates by half of this; 0 is flat."""
    wind_force: Number = Field(20.0, ge=-1e4, le=1e4)
    """xWindForce: speed of the waves in hundredths of a tile a second."""
    wind_direction: Angle = Field(90.0, ge=-360.0, le=360.0)
    """Turn of the waves about the plane's corner (x0, z0), from x to z; at 0 they run towards -z, at 90 towards -x."""
    spec_power: Number = Field(364.0, gt=0.0, le=1e4)
    """specPower: exponent of the highlight's weight, which counts twice, in colour and alpha: the lobe has twice it."""
    spec_perturb: Number = Field(25.0, ge=0.0, le=1e4)
    """specPerturb: factor by which the waves' shift turns the highlight's half vector; 0 is a round highlight."""
    spec_color: Color = from_display(0.98, 0.97, 0.7)
    """Colour of the highlight; the documents' (.98, .97, .7) as displayed."""
    spec_alpha: Unit = 0.6
    """Opacity of the highlight; 0 is no highlight."""
    light_direction: Direction = (0.1, 0.5, -0.6)
    """Towards the light of the highlight. A constant of the documents: the scene's own sun does not move it."""
    clear_color: Color = (0.0, 0.0, 0.0)
    """Colour of a map where nothing is drawn."""
    reflection_clip_bias: Length = Field(0.0, ge=-100.0, le=100.0)
    """How far below the water things still enter the reflection map."""

    @field_validator("light_direction")
    @classmethod
    def _not_zero(cls, direction: Any) -> Any:
        if np.linalg.norm(direction) < 1e-9:
            raise PydanticCustomError("direction", "light_direction must not be zero", {"bound": "length > 0"})
        return direction

    def cleared(self, alpha: float) -> tuple[float, float, float, float]:
        """What a map is cleared to: as it is stored, encoded for display as published."""
        color = np.array(self.clear_color)
        red, green, blue = srgb_from_linear(np.minimum(color, 1.0)) if self.is_encoded else color
        return float(red), float(green), float(blue), alpha

    def reflection(self, alpha: float = 0.0) -> MapSpec:
        """The mirrored scene above the water with its sky; ``alpha`` stands where nothing is drawn."""
        spec = MapSpec(
            camera="mirror",
            clip="above",
            bias=self.reflection_clip_bias,
            clear=self.cleared(alpha),
            wrap="mirror",
        )
        return self.published(spec, camera="look_at", size=MAP_SIZE)

    def reach(self) -> tuple[float, float]:
        """Half the wave height: a unit normal has no longer component."""
        return 0.5 * self.wave_height, 0.5 * self.wave_height

    def blocks(self, time: float, period: float | None) -> tuple[Block, ...]:
        """How the wind has turned and moved the bump map."""
        scroll = Scroll.at((0.0, self._tiles_per_round), time, period)
        x, y, x_before, y_before = (offset * self._tiles for offset in scroll.offsets)
        turn = math.radians(self.wind_direction)
        return (
            LakeWind(
                turn=(math.cos(turn), math.sin(turn)),
                offset=(x, y, x_before, y_before),
                blend=scroll.blend,
            ),
        )

    def defines(self, period: float | None) -> tuple[str, ...]:
        """The Fresnel mode, the encoding, and whether two phases of the bump map are read for a period."""
        names = [f"FRESNEL_MODE {self.fresnel_mode}"]
        if self.is_encoded:
            names.append("IS_ENCODED")
        if Scroll.needs_blend((0.0, self._tiles_per_round), period):
            names.append("TWO_PHASES")
        return tuple(names)

    def images(self) -> Mapping[str, ImageReference]:
        """The bump map, where it is a user's own."""
        return {} if self.normal_map == RIPPLES else {"normal_map": ImageReference(self.normal_map, "normal_map")}

    def textures(self, seed: int) -> Mapping[str, Texture]:
        """The slopes of the bump map; as published its every second tile is mirrored."""
        own = self.images().get("normal_map")
        slopes = ripple_slopes(seed) if own is None else image_texture(own)
        if self.as_published:
            slopes = replace(slopes, name=f"{slopes.name} mirrored", wrap="mirror")
        return {"bump_map": slopes}

    @property
    def _tiles(self) -> float:
        """Tiles after which the bump map repeats: mirrored, only every second one is the same."""
        return 2.0 if self.as_published else 1.0

    @property
    def _tiles_per_round(self) -> float:
        return WIND_SPEED * self.wind_force / self._tiles


class LakeWind(Block):
    """How the wind has turned and moved the bump map at one time."""

    turn: Vec2
    """Cosine and sine of the wind's direction."""
    offset: Vec4
    """Offset of the bump map now (xy) and one period earlier (zw), tiles."""
    blend: Unit
    """Weight of the earlier phase."""
