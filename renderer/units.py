"""Quantities with their units: the types of every declared field.

A type carries its unit (it reaches the JSON schema as ``x-unit``) and its GLSL type (it reaches the
std140 block). Angles are degrees in a declaration and radians in a block. Numbers are finite.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

HEX_COLOR = re.compile(r"#[0-9a-fA-F]{6}\Z")


@dataclass(frozen=True)
class Glsl:
    """The GLSL type of a field, and the factor from its declared unit to the shader's."""

    type: str
    scale: float = 1.0


def linear_from_srgb(encoded: float) -> float:
    """Decode one sRGB channel in 0..1 (IEC 61966-2-1, section 5.2)."""
    return encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4


def srgb_from_linear(linear: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Encode linear values in 0..1 as sRGB (IEC 61966-2-1, section 5.2)."""
    curved = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curved)


def as_tuple(value: Any) -> Any:
    """A list or array as a tuple, anything else as it is: JSON has no tuples."""
    return tuple(value) if isinstance(value, list | np.ndarray) else value


def _as_color(value: Any) -> Any:
    if isinstance(value, str):
        if not HEX_COLOR.match(value):
            raise PydanticCustomError("color", "a colour is three linear numbers or '#rrggbb'")
        return tuple(linear_from_srgb(int(value[i : i + 2], 16) / 255) for i in (1, 3, 5))
    return as_tuple(value)


def _unit(name: str) -> Any:
    return Field(json_schema_extra={"x-unit": name})


FARTHEST = 1e7
"""Metres: how far from the origin anything may be named. A float still tells metres apart there."""

_Real = Annotated[float, Field(allow_inf_nan=False)]
Coordinate = Annotated[float, Field(allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST)]
"""One number of a place, a direction or a rectangle."""
_Channel = Annotated[float, Field(allow_inf_nan=False, ge=0.0, le=1e4)]

Number = Annotated[float, Field(allow_inf_nan=False), Glsl("float")]
"""A finite number without unit."""
Unit = Annotated[float, Field(allow_inf_nan=False, ge=0.0, le=1.0), Glsl("float")]
"""A fraction in 0..1."""
Length = Annotated[float, Field(allow_inf_nan=False), _unit("m"), Glsl("float")]
"""Metres."""
Seconds = Annotated[float, Field(allow_inf_nan=False), _unit("s"), Glsl("float")]
"""Seconds."""
Angle = Annotated[float, Field(allow_inf_nan=False), _unit("deg"), Glsl("float", math.pi / 180)]
"""Degrees; radians in a block."""
Color = Annotated[tuple[_Channel, _Channel, _Channel], BeforeValidator(_as_color), Glsl("vec3")]
"""Linear RGB, or ``"#rrggbb"`` in sRGB."""
Vec2 = Annotated[tuple[Coordinate, Coordinate], BeforeValidator(as_tuple), Glsl("vec2")]
"""Two finite numbers within ±1e7."""
Vec3 = Annotated[tuple[_Real, _Real, _Real], BeforeValidator(as_tuple), Glsl("vec3")]
"""Three finite numbers."""
Direction = Annotated[tuple[Coordinate, Coordinate, Coordinate], BeforeValidator(as_tuple), Glsl("vec3")]
"""A vector whose length says nothing."""
Point = Annotated[
    tuple[Coordinate, Coordinate, Coordinate],
    BeforeValidator(as_tuple),
    _unit("m"),
    Glsl("vec3"),
]
"""A place in the world, metres."""
Vec4 = Annotated[tuple[_Real, _Real, _Real, _Real], BeforeValidator(as_tuple), Glsl("vec4")]
"""Four finite numbers."""
Mat4 = Annotated[
    tuple[_Real, ...],
    BeforeValidator(as_tuple),
    Field(min_length=16, max_length=16),
    Glsl("mat4"),
]
"""A 4×4 matrix, 16 numbers row by row."""
Whole = Annotated[int, Glsl("int")]
"""A whole number."""
