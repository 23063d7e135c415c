"""Glints. Phong 1975, equation 4: cos^n of the angle between the view and the mirrored light."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def phong(n: ArrayLike, l: ArrayLike, v: ArrayLike, power: ArrayLike) -> NDArray[np.float64]:  # noqa: E741 - the field's name
    """The lobe for unit vectors (k, 3), by Householder's mirror and the angle itself; 0 for light from behind."""
    normal, light, view = (np.asarray(a, np.float64) for a in (n, l, v))
    facing = (normal * light).sum(-1)
    householder = np.eye(3) - 2 * normal[..., :, None] * normal[..., None, :]
    mirrored = -(householder @ light[..., None])[..., 0]
    angle = np.arccos(np.clip((mirrored * view).sum(-1), -1, 1))
    lobe = np.where(angle < np.pi / 2, np.abs(np.cos(angle)) ** np.asarray(power, np.float64), 0.0)
    return np.where(facing > 0, lobe, 0.0)
