"""What the shadow pass gives to the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.gpu.program import Bindable
from renderer.gpu.target import DepthTexture


@dataclass(frozen=True, eq=False)
class Shadows:
    """The shadows of one sun."""

    texture: DepthTexture | None
    shadow_from_world: NDArray[np.float64]
    offset: float
    """Metres along its normal that a surface is moved before it asks."""

    @property
    def defines(self) -> tuple[str, ...]:
        """The names that choose the shadowed code."""
        return ("HAS_SHADOWS",) if self.texture else ()

    @property
    def textures(self) -> dict[str, Bindable]:
        """The sampler's texture."""
        return {"shadow_map": self.texture} if self.texture else {}


NO_SHADOWS = Shadows(None, np.eye(4), 0.0)
