"""What every water technique declares: its parameters, its maps, its shader."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
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
    """Tags of what is drawn; None draws everything."""
    draws_sky: bool = True
    clip: Literal["above", "below"] | None = None
    """The side of the water that is kept; None keeps both."""
    bias: float = 0.0
    """Metres that are kept past the water on the wrong side. Never part of the mirror."""
    clear: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    scale: float = 1.0
    """Size of the map against the picture."""
    format: Literal["half", "byte"] = "half"
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
            and self.format == "half"
        )


class Technique(Block):
    """How water is shaped and shaded."""

    shader: ClassVar[str]
    """The GLSL file, under ``shaders/``."""
    title: ClassVar[str]
    source: ClassVar[str]
    """The citation, as in docs/references.md."""

    level: Length | None = Field(None, ge=-1e5, le=1e5)
    """Height of the water's plane; the scene's own where left out."""
    extents: Extents | None = None
    """Rectangle ``[x0, x1, z0, z1]`` of the water; the scene's own where left out."""

    def maps(self) -> Mapping[str, MapSpec]:
        """The maps by name: ``reflection`` and ``refraction``."""
        raise NotImplementedError

    @property
    def needs_depth(self) -> bool:
        """Whether the shader reads the depth of the water below a point."""
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
