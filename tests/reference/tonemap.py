"""Tone curves from their sources, in double precision."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def srgb(linear: ArrayLike) -> Floats:
    """IEC 61966-2-1, section 5.2, 0..1 to 0..1."""
    c = np.asarray(linear, np.float64)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * np.maximum(c, 1e-9) ** (1 / 2.4) - 0.055)


def reinhard(color: ArrayLike) -> Floats:
    """Reinhard et al. 2002, equation 3, on Rec. 709 luminance; hues stay."""
    c = np.asarray(color, np.float64)
    luminance = c @ np.array([0.2126, 0.7152, 0.0722])
    displayed = luminance / (1 + luminance)
    ratio = np.divide(displayed, luminance, out=np.ones_like(luminance), where=luminance > 0)
    return np.asarray(np.minimum(c * ratio[..., None], 1.0))


def aces(color: ArrayLike) -> Floats:
    """Narkowicz 2015: (x (a x + b)) / (x (c x + d) + e)."""
    x = np.asarray(color, np.float64)
    a, b, c, d, e = 2.51, 0.03, 2.43, 0.59, 0.14
    return np.clip(x * (a * x + b) / (x * (c * x + d) + e), 0.0, 1.0)


def agx_sigmoid(x: ArrayLike) -> Floats:
    """Sobotka 2023: the contrast curve itself, which shaders approach by a polynomial.

    Two hyperbolic arcs that meet in the pivot (middle grey, one half) with slope 2 and reach 0 and 1 at the ends.
    """
    value = np.asarray(x, np.float64)
    pivot, half, slope, power = 10.0 / 16.5, 0.5, 2.0, 3.0

    def scale(x_pivot: float, y_pivot: float) -> float:
        reach = (slope * x_pivot / y_pivot) ** power - 1
        return float(((slope * x_pivot) ** -power * reach) ** (-1 / power))

    toe, shoulder = -scale(pivot, half), scale(1 - pivot, 1 - half)
    arc = np.where(value < pivot, toe, shoulder)
    t = slope * (value - pivot) / arc
    return np.asarray(arc * t / (1 + t**power) ** (1 / power) + half)
