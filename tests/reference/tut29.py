"""Rastertek n.d., tutorial 29, in double precision: its pixel shader one pixel at a time, and its frame count."""

from __future__ import annotations

from fractions import Fraction
from math import floor

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Place = tuple[float, float]


def translation(frame: int) -> float:
    """The scroll after so many frames: the fraction of 0.001 times the frame."""
    return float(Fraction(frame, 1000) % 1)


def summed_translation(frame: int) -> float:
    """The document's own sum in single precision, which drifts."""
    total, step = np.float32(0), np.float32(0.001)
    for _ in range(frame):
        total += step
        if total > 1:
            total -= np.float32(1)
    return float(total)


def sampled(texels: Floats, place: Place, *, wraps: bool) -> Floats:
    """A bilinear sample of (rows, columns, channels). place: u along the columns, v along the rows, 0..1."""
    rows, columns, _ = texels.shape
    x, y = place[0] * columns - 0.5, place[1] * rows - 0.5
    left, low = floor(x), floor(y)
    total = np.zeros(texels.shape[2])
    for row, across in ((low, 1 - (y - low)), (low + 1, y - low)):
        for column, along in ((left, 1 - (x - left)), (left + 1, x - left)):
            i = row % rows if wraps else min(max(row, 0), rows - 1)
            j = column % columns if wraps else min(max(column, 0), columns - 1)
            total += across * along * texels[i, j]
    return total


def normal(texels: Floats, place: Place, tiling: float, frame: int) -> Place:
    """The x and y of the normal. place: 0..1 over the water."""
    c = sampled(texels, (place[0] * tiling, place[1] * tiling + translation(frame)), wraps=True)
    return 2 * float(c[0]) - 1, 2 * float(c[1]) - 1


def moved(place: Place, n: Place, scale: float) -> Place:
    """A place in a map whose v runs downwards, moved by the ripples."""
    return place[0] + n[0] * scale, place[1] + n[1] * scale


def blended(reflection: Floats, refraction: Floats, share: float) -> Floats:
    """Linear interpolation from the reflection to the refraction."""
    return reflection + share * (refraction - reflection)
