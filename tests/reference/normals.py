"""Normals of ripples. Luna 2006, section 3 and 5.2: the mean of two normals, normalised."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def unit(vector: ArrayLike) -> Floats:
    """Vectors (..., 3) at length 1."""
    v = np.asarray(vector, np.float64)
    return np.asarray(v / np.sqrt((v * v).sum(axis=-1, keepdims=True)))


def of_slope(slope: ArrayLike) -> Floats:
    """The normal of the surface y = s.x x + s.y z: across both of its tangents (1, s.x, 0) and (0, s.y, 1)."""
    s = np.asarray(slope, np.float64)
    along_x = np.stack([np.ones_like(s[..., 0]), s[..., 0], np.zeros_like(s[..., 0])], axis=-1)
    along_z = np.stack([np.zeros_like(s[..., 1]), s[..., 1], np.ones_like(s[..., 1])], axis=-1)
    return unit(np.cross(along_z, along_x))


def mean_of_two(first: ArrayLike, second: ArrayLike) -> Floats:
    """Luna's rippled normal of two slopes: average the normals, then normalise."""
    return unit(0.5 * (of_slope(first) + of_slope(second)))


def bottom_damping(v: ArrayLike) -> Floats:
    """What is left of the shift of v, v downwards 0..1 (section 5.2)."""
    return np.asarray(1.0 - np.asarray(v, np.float64) ** 10)
