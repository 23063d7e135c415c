"""Water after Rastertek's tutorial 29: one scrolling normal map, a constant blend, no lighting of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from renderer.blocks import Block
from renderer.scene.images import IMAGE_ID, ImageReference
from renderer.scene.material import Texture
from renderer.units import Length, Number, Unit, Vec4
from renderer.water.cloud_ripples import cloud_ripple_slopes
from renderer.water.image_maps import image_name, image_texture
from renderer.water.normal_maps import ripple_slopes
from renderer.water.scroll import Scroll
from renderer.water.technique import MapSpec, PublishedTechnique

FRAMES_A_TILE = 1000
"""Frames after which the map has moved by one tile: the document adds 0.001 a frame."""
ROUNDING = 4
"""Units in the last place by which a time may fall short of its frame: k / rate * rate is not always k."""
BLACK = (0.0, 0.0, 0.0, 1.0)

SLOPES: Mapping[str, Callable[[int], Texture]] = {"clouds": cloud_ripple_slopes, "waves": ripple_slopes}
"""The normal maps by name, as slopes."""


class Tut29(PublishedTechnique):
    """Reflective and refractive water for ponds and pools (Rastertek n.d., tutorial 29).

    The water's rectangle is one tile of a normal map, which moves the coordinates in both maps by its x and y; the
    two samples are blended by a constant. The document draws into its maps what it knows to be seen there, and clips
    the reflection by nothing, so that what lies under water may hide what the water mirrors. It can do so because its
    one reflected wall stands clear of the water. Here that is drawn only as published: otherwise the reflection holds
    all that stands above the water, and the sky. The document's mirrored camera turns the reflection upside down,
    which the true mirror does not. Here ripples move what is seen as they do in the document, in both.
    """

    shader: ClassVar = "water/tut29.glsl"
    title: ClassVar = "Pool water (Rastertek, tutorial 29)"
    source: ClassVar = "Rastertek n.d."

    technique: Literal["tut29"] = "tut29"
    reflect_refract_scale: Number = Field(0.01, ge=0.0, le=1.0)
    """reflectRefractScale: shift of the coordinates in both maps, as a fraction of the map, by a normal of 1."""
    blend: Unit = 0.6
    """Share of the refraction in the picture, at every angle; the rest is reflection."""
    tiling: Number = Field(1.0, ge=1e-2, le=1e3)
    """Tiles of the normal map along each side of the water's rectangle."""
    normal_map: Annotated[str, image_name("normal_map", ("clouds", "waves", "flat"))] = "clouds"
    """The ripples: rippled clouds by the document's recipe, random waves, none; or the id of an uploaded `normal_map`,
    whose top is north."""
    frame_rate: Number = Field(60.0, ge=0.0, le=1e4, json_schema_extra={"x-unit": "1/s"})
    """Frames per second by which the document's count of frames is kept: each moves the map by 0.001 tile; 0 stops."""
    clip_bias: Length = Field(0.1, ge=0.0, le=10.0)
    """How far above the water things are kept in the refraction map, against dark edges; 0 clips at the water."""

    def maps(self) -> Mapping[str, MapSpec]:
        """The mirrored scene above the water, and what is tagged as seen through it, from the water's height down."""
        # Without an alpha of one, the shader sees where ripples look past what lies under water.
        refraction = MapSpec("direct", frozenset({"refracted"}), clip="below", bias=self.clip_bias)
        return {
            "reflection": self.published(
                MapSpec("mirror", clip="above"),
                camera="yaw_only",
                objects=frozenset({"reflected"}),
                clip=None,
                draws_sky=False,
                clear=BLACK,
                wrap="repeat",
            ),
            "refraction": self.published(refraction, draws_sky=False, clear=BLACK, wrap="repeat"),
        }

    def reach(self) -> tuple[float, float]:
        """The scale: a unit normal has no longer component."""
        return self.reflect_refract_scale, self.reflect_refract_scale

    def blocks(self, time: float, period: float | None) -> tuple[Block, ...]:
        """Where the normal map stands."""
        scroll = frame_scroll(time, self.frame_rate, period)
        return (Tut29Scroll(offset=scroll.offsets, earlier=scroll.blend),)

    def defines(self, period: float | None) -> tuple[str, ...]:
        """The document's maps are read without a look at what they hold, and two phases where a period asks for it."""
        published = ("AS_PUBLISHED",) if self.as_published else ()
        return (*published, "TWO_PHASES") if needs_blend(self.frame_rate, period) else published

    def images(self) -> Mapping[str, ImageReference]:
        """The normal map, where it is a user's own."""
        own = self.normal_map
        return {"normal_map": ImageReference(own, "normal_map")} if IMAGE_ID.match(own) else {}

    def textures(self, seed: int) -> Mapping[str, Texture]:
        """The normal map."""
        return {"normal_map": normal_map(self.normal_map, seed)}


class Tut29Scroll(Block):
    """Where the normal map stands at one time."""

    offset: Vec4
    """Offset of the map now (xy) and one period earlier (zw), tiles."""
    earlier: Unit
    """Weight of the earlier phase."""


def frame_scroll(time: float, frame_rate: float, period: float | None) -> Scroll:
    """The scroll along y by the index of the frame: k / 1000 of a tile, k = floor(time * frame_rate).

    The document adds 0.001 to a sum in single precision, frame by frame, which is a frame off after a hundred thousand.
    Whole numbers are exact at any time. With a period whose frames are no multiple of 1000, two phases are blended.
    """
    slack = ROUNDING * math.ulp(max(abs(time), period or 0.0) * frame_rate)
    if period is None:
        phase = _phase(math.floor(time * frame_rate + slack))
        return Scroll((0.0, phase, 0.0, phase), 0.0)
    frames = period * frame_rate
    position = math.fmod(math.fmod(time, period) + period, period) * frame_rate
    if position + slack >= frames:
        position -= frames
    index = math.floor(position + slack)
    now, before = _phase(index), _phase(math.floor(position - frames + slack))
    blend = min(max(index, 0) / frames, 1.0) if needs_blend(frame_rate, period) else 0.0
    return Scroll((0.0, now, 0.0, before), blend)


def needs_blend(frame_rate: float, period: float | None) -> bool:
    """Whether the map does not come back by itself: the period is no multiple of 1000 frames."""
    if period is None or frame_rate == 0:
        return False
    tiles = period * frame_rate / FRAMES_A_TILE
    return abs(tiles - round(tiles)) > 1e-9


def _phase(index: int) -> float:
    return index % FRAMES_A_TILE / FRAMES_A_TILE


@lru_cache(maxsize=8)
def normal_map(name: str, seed: int) -> Texture:
    """A map's normals along u and v, encoded as (n + 1) / 2 in halves: 0.5 is flat, exactly. Float16 (n, n, 2)."""
    slopes = _slopes(name, seed).astype(np.float32)
    n = -slopes / np.sqrt(1 + (slopes**2).sum(axis=-1, keepdims=True))
    return Texture(f"normals_{name}_{seed}", (0.5 + 0.5 * n).astype(np.float16), wrap="repeat")


def _slopes(name: str, seed: int) -> NDArray[Any]:
    if IMAGE_ID.match(name):
        return image_texture(ImageReference(name, "normal_map")).image
    return SLOPES[name](seed).image if name in SLOPES else np.zeros((4, 4, 2))
