"""The sky models of a request."""

from __future__ import annotations

from typing import Literal

from renderer.blocks import Block
from renderer.units import Color, Number, Unit
from pydantic import Field


class ConstantSky(Block):
    """One colour everywhere."""

    model: Literal["constant"] = "constant"
    color: Color = (0.5, 0.7, 0.9)
    """The sky's radiance."""


class GradientSky(Block):
    """A gradient by the square root of the direction's height."""

    model: Literal["gradient"] = "gradient"
    horizon: Color = (0.7, 0.8, 0.9)
    """Radiance at the horizon."""
    zenith: Color = (0.2, 0.4, 0.7)
    """Radiance straight up."""


class AnalyticSky(Block):
    """Air that scatters the sun's light, with clouds."""

    model: Literal["analytic"] = "analytic"
    turbidity: Number = Field(2.5, ge=1, le=10)
    """Haze: 2 is very clear, 10 is very hazy."""
    clouds: Unit = 0.35
    """Share of the sky that clouds cover."""
