"""How much is reflected. Written from Luna 2006, sections 4 and 5.2, in double precision."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def luna_reflection_weight(cosine: ArrayLike, bias: ArrayLike, power: ArrayLike) -> NDArray[np.float64]:
    """Share of the reflection: what saturate(bias + max(n.v, 0)^power) leaves to the refraction's other side."""
    facing = np.maximum(np.asarray(cosine, np.float64), 0.0)
    with np.errstate(divide="ignore"):
        raised = np.where(facing > 0, np.exp(np.asarray(power, np.float64) * np.log(facing)), 0.0)
    return np.asarray(1.0 - np.clip(np.asarray(bias, np.float64) + raised, 0.0, 1.0))


def refraction_weight_left(rate: ArrayLike, way: ArrayLike) -> NDArray[np.float64]:
    """What a way in metres leaves of the refraction's share: each metre takes the same part, e to the minus rate."""
    return np.asarray(np.e ** -np.multiply(rate, way, dtype=np.float64))
