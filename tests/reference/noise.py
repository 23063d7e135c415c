"""Lattice noise. Written from Perlin 2002 and the words of each hash, in whole numbers and double precision."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Words = NDArray[np.uint64]

MASK = np.uint64(0xFFFFFFFF)
PRIMES = (73856093, 19349663, 83492791)
"""Teschner et al. 2003, section 4.1."""
TURN_PLANE = np.array([[0.8, 0.6], [-0.6, 0.8]])
TURN = np.array([[0.8, 0.6, 0.0], [-0.48, 0.64, 0.6], [0.36, -0.48, 0.8]])
"""Turns by the angle of the 3-4-5 triangle, in space about two axes."""


def _times(a: Words, b: int) -> Words:
    return (a * np.uint64(b)) & MASK


def hash_uint(value: int) -> int:
    """PCG's output permutation (Jarzynski & Olano 2020, section 3), on Python's whole numbers."""
    state = (value * 747796405 + 2891336453) % 2**32
    word = (((state >> ((state >> 28) + 4)) ^ state) * 277803737) % 2**32
    return (word >> 22) ^ word


def hash_cell(cell: ArrayLike, seed: int) -> Words:
    """32 bits for each lattice cell (..., 2 or 3) of whole numbers."""
    wrapped = np.asarray(cell, np.int64).astype(np.uint64) & MASK
    h = np.zeros(wrapped.shape[:-1], np.uint64)
    for axis in range(wrapped.shape[-1]):
        h ^= _times(wrapped[..., axis], PRIMES[axis])
    h = (h + np.uint64(seed * 2654435769 % 2**32)) & MASK
    h = _times(h ^ (h >> np.uint64(16)), 0x7FEB352D)
    return _times(h ^ (h >> np.uint64(15)), 0x846CA68B)


def value_noise(p: ArrayLike, seed: int) -> Floats:
    """Smooth noise 0..1 of places (n, 2)."""
    return _interpolated(np.asarray(p, np.float64), lambda cell, _: (hash_cell(cell, seed) >> np.uint64(8)) / 2.0**24)


def gradient_noise(p: ArrayLike, seed: int) -> Floats:
    """Perlin 2002's noise of places (n, 2 or 3); each corner's gradient comes from the top bits of its hash."""
    places = np.asarray(p, np.float64)
    table = _gradients(places.shape[-1])

    def corner(cell: Floats, offset: Floats) -> Floats:
        chosen = table[(hash_cell(cell, seed) >> np.uint64(28)).astype(int)]
        return np.asarray((chosen * offset).sum(-1))

    return _interpolated(places, corner)


def fbm(p: ArrayLike, octaves: float, seed: int) -> Floats:
    """Octaves of gradient noise, each half as strong and twice as fine as the one before, and turned."""
    places = np.asarray(p, np.float64)
    turn = TURN_PLANE if places.shape[-1] == 2 else TURN
    total = np.zeros(len(places))
    for octave in range(int(np.ceil(octaves))):
        total += 0.5**octave * min(octaves - octave, 1.0) * gradient_noise(places, seed + octave)
        places = 2.0 * places @ turn.T
    return total


def _gradients(width: int) -> Floats:
    """The sixteen gradients by four bits."""
    rows = []
    for bits in range(16):
        first, second, flip_u, flip_v = (bool(bits & b) for b in (8, 4, 2, 1))
        u, v = (-1.0 if flip_u else 1.0), (-1.0 if flip_v else 1.0)
        g = np.zeros(width)
        if width == 2:
            # Bit 3: an axis; bit 2: which coordinate comes first.
            g[0 if second else 1] = u * (np.sqrt(2) if first else 1.0)
            g[1 if second else 0] = 0.0 if first else v
        else:
            axes = {0: (0, 1), 1: (0, 2), 2: (1, 2), 3: (0, 1)}[bits >> 2]
            g[axes[0]], g[axes[1]] = u, v
        rows.append(g)
    return np.array(rows)


def _interpolated(p: Floats, corner: object) -> Floats:
    assert callable(corner)
    cell = np.floor(p)
    f = p - cell
    weight = 6 * f**5 - 15 * f**4 + 10 * f**3
    total = np.zeros(p.shape[:-1])
    for steps in itertools.product((0, 1), repeat=p.shape[-1]):
        step = np.array(steps, np.float64)
        share = np.where(step == 1, weight, 1 - weight).prod(-1)
        total += share * corner(cell + step, f - step)
    return total
