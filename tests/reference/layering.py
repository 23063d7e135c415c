"""Layers of colour over light, from the definition of alpha as the share of a place that the layer covers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def over(beneath: ArrayLike, layer: ArrayLike, opacity: float) -> NDArray[np.float64]:
    """What is seen: light (..., 3) beneath a layer of sRGB colour and alpha, 0..1 each, thinned to an opacity."""
    encoded = np.asarray(layer, np.float64)[..., :3]
    color = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    covered = np.asarray(layer, np.float64)[..., 3:] * opacity
    return np.asarray(covered * color + (1 - covered) * np.asarray(beneath, np.float64))
