"""Rastertek n.d., tutorial 29, in double precision: its pixel shader one pixel at a time, and its frame count."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from tests.reference.sampling import Sampler

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


def normal(texels: Floats, place: Place, tiling: float, frame: int) -> Place:
    """The x and y of the normal. place: 0..1 over the water."""
    c = Sampler(texels, "repeat").read([(place[0] * tiling, place[1] * tiling + translation(frame))])[0]
    return 2 * float(c[0]) - 1, 2 * float(c[1]) - 1


def moved(place: Place, n: Place, scale: float) -> Place:
    """A place in a map whose v runs downwards, moved by the ripples."""
    return place[0] + n[0] * scale, place[1] + n[1] * scale


def blended(reflection: Floats, refraction: Floats, share: float) -> Floats:
    """Linear interpolation from the reflection to the refraction."""
    return reflection + share * (refraction - reflection)
