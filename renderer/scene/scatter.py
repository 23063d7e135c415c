"""Where plants stand: seeded places (n, 3) on a given ground.

``height(x, z) -> y`` is the ground in metres over the water level for arrays of one shape;
``density(x, z) -> 0..1`` thins, where given.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]
Field = Callable[[Array, Array], NDArray[np.floating]]


def clump(
    seed: int,
    height: Field,
    centre: tuple[float, float],
    radius: float,
    count: int,
    *,
    between: tuple[float, float] = (-0.5, 0.05),
) -> Array:
    """At most ``count`` places round a centre, denser within, on ground ``between`` two heights."""
    rng = Generator(PCG64([seed, 61]))
    n = count * 3
    turn, reach = rng.uniform(0, 2 * np.pi, n), radius * rng.uniform(0, 1, n) ** 0.62
    reach *= 1 + 0.3 * np.sin(3 * turn + seed)
    x, z = centre[0] + reach * np.cos(turn), centre[1] + reach * np.sin(turn)
    y = np.asarray(height(x, z), np.float64)
    kept = np.flatnonzero((y > between[0]) & (y < between[1]))[:count]
    return np.stack([x, y, z], axis=1)[kept]


def shoreline(height: Field, reach: float = 30.0, step: float = 0.25) -> Array:
    """Points (n, 2) of the waterline, x and z, on a grid of ``step`` metres."""
    axis = np.arange(-reach, reach + step, step)
    x, z = np.meshgrid(axis, axis)
    wet = np.asarray(height(x, z)) < 0
    edge = np.zeros_like(wet)
    edge[:, :-1] |= wet[:, :-1] != wet[:, 1:]
    edge[:-1] |= wet[:-1] != wet[1:]
    return np.stack([x[edge], z[edge]], axis=1) + step / 2


def bank(
    seed: int,
    height: Field,
    shore: Array,
    count: int,
    *,
    falloff: float = 1.6,
    between: tuple[float, float] = (0.04, 6.0),
    density: Field | None = None,
) -> Array:
    """At most ``count`` places along the shore, thinning inland over ``falloff`` metres, in loose patches."""
    rng = Generator(PCG64([seed, 62]))
    n = count * 3
    from_shore = shore[rng.integers(0, len(shore), n)]
    turn, away = rng.uniform(0, 2 * np.pi, n), rng.exponential(falloff, n)
    x, z = from_shore[:, 0] + away * np.cos(turn), from_shore[:, 1] + away * np.sin(turn)
    y = np.asarray(height(x, z), np.float64)
    phase = rng.uniform(0, 6.28, 4)
    patches = np.sin(1.1 * x + phase[0]) * np.sin(1.3 * z + phase[1]) + np.sin(0.43 * x + phase[2]) * np.sin(
        0.37 * z + phase[3]
    )
    kept = (y > between[0]) & (y < between[1]) & (patches > rng.uniform(-1.9, 0.6, n))
    if density is not None:
        kept &= np.asarray(density(x, z)) > rng.uniform(size=n)
    return np.stack([x, y, z], axis=1)[np.flatnonzero(kept)[:count]]


def ring(
    seed: int,
    height: Field,
    count: int,
    *,
    inner: float,
    outer: float,
    gaps: Sequence[tuple[float, float]] = (),
    taken: Array | None = None,
    apart: float = 3.0,
) -> Array:
    """Places between two circles round the origin, apart from each other and from ``taken`` (n, 2).

    ``gaps`` are (bearing, half width) in degrees, the bearing from +x towards +z, that stay open.
    """
    rng = Generator(PCG64([seed, 63]))
    spots = [] if taken is None else list(np.asarray(taken, np.float64)[:, :2])
    fixed = len(spots)
    for _ in range(count):
        turn = rng.uniform(0, 2 * np.pi, 16)
        reach = np.sqrt(rng.uniform(inner**2, outer**2, 16))
        candidates = np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=1)
        bearing = np.degrees(turn)
        is_open = np.zeros(16, bool)
        for middle, half in gaps:
            is_open |= np.abs((bearing - middle + 180) % 360 - 180) < half
        candidates = candidates[~is_open]
        if not len(candidates):
            continue
        if spots:
            gap = np.linalg.norm(candidates[:, None] - np.array(spots), axis=2).min(axis=1)
            candidates = candidates[gap > apart]
            if not len(candidates):
                continue
        spots.append(candidates[0])
    flat = np.array(spots[fixed:]).reshape(-1, 2)
    return np.stack([flat[:, 0], height(flat[:, 0], flat[:, 1]), flat[:, 1]], axis=1)


def sectors(places: Array, count: int) -> list[NDArray[np.int64]]:
    """Indices of the places in each of ``count`` equal sectors round the origin, empty ones left out."""
    turn = np.arctan2(places[:, 2], places[:, 0]) / (2 * np.pi) % 1.0
    number = np.minimum((turn * count).astype(np.int64), count - 1)
    parts = [np.flatnonzero(number == k) for k in range(count)]
    return [part for part in parts if len(part)]
