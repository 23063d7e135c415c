"""What every water technique declares: its parameters, its maps, its shader."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from renderer.blocks import Block
from renderer.scene.images import ImageReference
from renderer.scene.material import Texture
from renderer.units import Coordinate, Length


def _ordered(value: Any) -> Any:
    if isinstance(value, list):
        value = tuple(value)
    if isinstance(value, tuple) and len(value) == 4 and all(isinstance(v, int | float) for v in value):
        x0, x1, z0, z1 = value
        if not (x0 < x1 and z0 < z1):
            raise PydanticCustomError("extents", "extents are [x0, x1, z0, z1] with x0 < x1 and z0 < z1")
    return value


Extents = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate],
    BeforeValidator(_ordered),
    Field(json_schema_extra={"x-unit": "m"}),
]
"""A rectangle ``[x0, x1, z0, z1]`` in metres."""


@dataclass(frozen=True)
class MapSpec:
    """What enters a reflection or refraction map, and how it is drawn and read."""

    camera: Literal["mirror", "look_at", "yaw_only", "direct"]
    """``mirror``: view @ mirror. ``look_at`` and ``yaw_only``: the mirrored cameras that the Lake
    article and Rastertek tutorial 27 build. ``direct``: the picture's own camera."""
    objects: frozenset[str] | None = None
    """Tags of what is drawn, where the scene has things so tagged; None draws everything."""
    draws_sky: bool = True
    clip: Literal["above", "below"] | None = None
    """The side of the water that is kept; None keeps both."""
    bias: float = 0.0
    """Metres that are kept past the water on the wrong side. Never part of the mirror."""
    clear: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    scale: float = 1.0
    """Size of the map against the picture."""
    size: tuple[int, int] | None = None
    """Width and height in pixels whatever the picture's size; None goes by ``scale``."""
    format: Literal["half", "byte"] = "half"
    """Linear half floats, or bytes encoded for display (sRGB)."""
    wrap: Literal["clamp", "mirror", "repeat"] = "clamp"

    @property
    def is_the_scene(self) -> bool:
        """Whether the map is the picture without water itself, so that no pass of its own is needed."""
        return (
            self.camera == "direct"
            and self.objects is None
            and self.draws_sky
            and self.clip is None
            and self.scale == 1.0
            and self.size is None
        )


class Technique(Block):
    """How water is shaped and shaded."""

    shader: ClassVar[str]
    """The GLSL file, under ``shaders/``."""
    title: ClassVar[str]
    source: ClassVar[str]
    """The citation, as in docs/references.md."""

    shape: ClassVar[str | None] = None
    """The GLSL file that lifts the surface out of its plane, under ``shaders/``, if the technique can."""
    blends: ClassVar[bool] = False
    """Whether the surface is transparent in part, and blended over the scene."""

    level: Length | None = Field(None, ge=-1e5, le=1e5)
    """Height of the water's plane; the scene's own where left out."""
    extents: Extents | None = None
    """Rectangle ``[x0, x1, z0, z1]`` of the water; the scene's own where left out."""

    def maps(self) -> Mapping[str, MapSpec]:
        """The maps by name: ``reflection`` and ``refraction``."""
        raise NotImplementedError

    @property
    def is_encoded(self) -> bool:
        """Whether maps and blending are encoded for display rather than linear, and no tones are mapped."""
        return False

    @property
    def needs_depth(self) -> bool:
        """Whether the shader reads the depth of the water below a point."""
        return False

    @property
    def is_displaced(self) -> bool:
        """Whether the surface leaves its plane, by the functions of ``shape``."""
        return False

    def images(self) -> Mapping[str, ImageReference]:
        """The users' images that the parameters name, by the parameter's dotted path."""
        return {}

    def reach(self) -> tuple[float, float]:
        """The farthest that the water moves a map's coordinates, as fractions of the map: u, v."""
        raise NotImplementedError

    def blocks(self, time: float, period: float | None) -> tuple[Block, ...]:
        """The uniform blocks that depend on time, besides the technique itself."""
        raise NotImplementedError

    def defines(self, period: float | None) -> tuple[str, ...]:
        """The names that choose code rather than values."""
        raise NotImplementedError

    def textures(self, seed: int) -> Mapping[str, Texture]:
        """The textures by sampler name."""
        raise NotImplementedError


class PublishedTechnique(Technique):
    """A technique of a document, which can be drawn as the document does it, limits and all."""

    as_published: bool = False
    """Draw as the document does: its map cameras and sizes, address modes and 8-bit maps, blending in display space,
    no tone map. Otherwise maps are right under every camera, linear and read within their edges."""

    @property
    def is_encoded(self) -> bool:
        """The documents blend what the display shows."""
        return self.as_published

    def published(self, spec: MapSpec, **changes: Any) -> MapSpec:
        """A map as it is drawn here: with these changes and in bytes, if as published."""
        return replace(spec, format="byte", **changes) if self.as_published else spec
