"""Sun, fog and tone map: what a request says of light."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from renderer.blocks import Block, Declaration
from renderer.camera import compass_direction
from renderer.units import Angle, Color, Direction, Length, Number, Vec3

SETTING = 0.0175
"""Sine of the elevation under which a sun that casts shadows begins to set: 1 degree."""


class Sun(Declaration):
    """A directional light; give ``direction`` (towards the sun) or ``azimuth`` and ``elevation``."""

    direction: Direction | None = None
    """Towards the sun; any length but zero."""
    azimuth: Angle | None = None
    """Compass direction of the sun: clockwise from −z, so 90 is +x."""
    elevation: Angle | None = Field(None, ge=-90, le=90)
    """Angle of the sun above the horizon."""
    color: Color = (1.0, 0.96, 0.9)
    """Colour of the light."""
    intensity: Number = Field(1.0, ge=0, le=1000)
    """Factor on the colour."""
    shadows: bool = True
    """Whether things cast shadows."""

    @field_validator("direction")
    @classmethod
    def _not_zero(cls, direction: Any) -> Any:
        if direction is not None and np.linalg.norm(direction) < 1e-9:
            raise PydanticCustomError("direction", "direction must not be zero", {"bound": "length > 0"})
        return direction

    @model_validator(mode="before")
    @classmethod
    def _one_form(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        angles = [name for name in ("azimuth", "elevation") if data.get(name) is not None]
        if data.get("direction") is not None:
            if angles:
                raise PydanticCustomError(
                    "sun",
                    "give direction, or azimuth and elevation, not both",
                    {"bound": "one of the two forms"},
                )
            return data
        places = ("direction", "azimuth", "elevation")
        given = {name: value for name, value in data.items() if name not in places or value is not None}
        return {"azimuth": 135.0, "elevation": 38.0, **given}

    @property
    def towards(self) -> NDArray[np.float64]:
        """The unit vector towards the sun."""
        if self.direction is not None:
            return np.asarray(np.array(self.direction) / np.linalg.norm(self.direction))
        return compass_direction(self.azimuth or 0.0, self.elevation or 0.0)

    @property
    def share_above_horizon(self) -> float:
        """How much of the sun the earth leaves, 0..1: with shadows it sets between 1 degree and the horizon."""
        return float(np.clip(self.towards[1] / SETTING, 0.0, 1.0)) if self.shadows else 1.0

    @property
    def radiance(self) -> NDArray[np.float64]:
        """Colour times intensity."""
        return np.asarray(np.array(self.color) * self.intensity)


class Fog(Block):
    """Air that scatters light: exponential with distance, thinner with height above the water."""

    color: Color = (0.66, 0.72, 0.78)
    """What the fog looks like where it hides everything."""
    density: Number = Field(0.01, ge=0, le=100, json_schema_extra={"x-unit": "1/m"})
    """Extinction at the water's level."""
    height_falloff: Number = Field(0.0, ge=0, le=100, json_schema_extra={"x-unit": "1/m"})
    """Rate at which density falls with height; 0 is the same everywhere."""


class ToneMap(Declaration):
    """How linear light becomes a picture."""

    operator: Literal["none", "reinhard", "aces", "agx"] = "aces"
    """``none`` clamps to 0..1 and encodes sRGB exactly, without dither."""
    exposure: Number = Field(0.0, ge=-20, le=20, json_schema_extra={"x-unit": "stops"})
    """Stops by which light is scaled first."""


class LightBlock(Block):
    """The light of one frame, as the shaders read it."""

    block_name = "Light"

    sun_direction: Vec3 = (0.0, 1.0, 0.0)
    """Unit vector towards the sun."""
    sun_radiance: Vec3 = (0.0, 0.0, 0.0)
    """Colour times intensity; zero without a sun."""
    ambient: Vec3 = (0.0, 0.0, 0.0)
    """Light from all sides."""
    water_level: Length = 0.0
    """Height of the water's plane."""
    eye_side: Number = 1.0
    """1 where the picture's eye is above the water, -1 below."""

    @classmethod
    def of(cls, sun: Sun | None, ambient: tuple[float, ...], water_level: float, eye_side: float) -> LightBlock:
        """The block of these lights."""
        towards = np.array([0.0, 1.0, 0.0]) if sun is None else sun.towards
        radiance = np.zeros(3) if sun is None else sun.radiance * sun.share_above_horizon
        return cls.model_validate(
            {
                "sun_direction": towards.tolist(),
                "sun_radiance": radiance.tolist(),
                "ambient": list(ambient),
                "water_level": water_level,
                "eye_side": eye_side,
            },
        )
