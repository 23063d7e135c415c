"""The sky models by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from renderer.blocks import Block
from renderer.naming import one_of
from renderer.scene.sky import AnalyticSky, ConstantSky, GradientSky

SKIES: dict[str, type[Block]] = {
    "constant": ConstantSky,
    "gradient": GradientSky,
    "analytic": AnalyticSky,
}

if TYPE_CHECKING:
    AnySky = Block
else:
    AnySky = one_of("sky model", "model", SKIES)
