"""The pond's outline and the shape of the ground round it.

The outline was drawn by hand for the default camera, which stands on the small headland at (9, 9):
a shallow gravel shore at its feet, the jetty entering from the right, a bay with reeds beyond.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene.noise import Floats, grid_fbm, smoothstep
from renderer.scene.terrain import Axis, upsampled

Outline = tuple[tuple[float, float], ...]

OUTLINE: Outline = (
    (16.0, -1.0), (15.2, 2.6), (12.6, 4.3), (9.6, 4.1), (7.3, 4.3), (5.1, 5.2), (3.4, 6.1), (1.5, 6.9),
    (0.3, 8.4), (-1.2, 10.3), (-3.8, 11.6), (-7.2, 11.3), (-10.0, 9.6), (-12.6, 8.2), (-15.6, 6.3),
    (-17.8, 3.2), (-18.0, -0.8), (-16.4, -4.3), (-13.2, -6.2), (-11.2, -8.4), (-10.6, -11.4),
    (-8.2, -14.0), (-4.2, -14.8), (-0.4, -13.4), (2.8, -11.3), (6.0, -10.6), (9.2, -10.9), (12.2, -9.0),
    (14.2, -5.4),
)  # fmt: skip
"""Control points of the shore, (x, z) metres, joined by a closed Catmull-Rom curve."""

SAND = ((6.9, 5.4, 2.7), (-6.5, 11.6, 3.6), (1.2, -12.6, 2.6))
"""Beaches: (x, z, radius) metres."""

STONES = ((1.2, 7.4, 2.8), (3.9, 6.4, 2.1), (-15.8, 5.4, 4.0), (-11.6, -8.4, 3.4), (14.6, 1.8, 3.0))
"""Stony shores: (x, z, radius) metres."""

DEPTH = 2.2
"""The deepest water, metres."""


@dataclass(frozen=True, eq=False)
class Shore:
    """Maps over the ground's grid, each (n, n) with z down and x across."""

    distance: Floats
    """Signed distance from the waterline, metres; positive on land."""
    sand: Floats
    """How sandy the shore is, 0 to 1."""
    stones: Floats
    """How stony the shore is, 0 to 1."""
    height: Floats
    """Metres over the water level."""


def shape_shore(axis: Axis, far: Floats, seed: int) -> Shore:
    """Shape the ground over the grid of ``axis``; ``far`` is the height that it joins at 70 m."""
    x = axis.world
    coarse = axis.coarser(8)
    around_x, around_z = np.meshgrid(coarse.world, coarse.world)
    distance = upsampled(outline_distance(around_x, around_z), len(x))
    distance += 0.55 * grid_fbm(x, x, 3.4, seed + 1, octaves=3)
    near = np.abs(distance) < 8
    ripple = 0.16 * grid_fbm(x, x, 0.55, seed + 2, octaves=3)
    distance += np.where(near, ripple, np.float32(0))
    mottle = grid_fbm(x, x, 2.2, seed + 3, octaves=3)
    sand = _patches(axis, SAND, mottle)
    stones = _patches(axis, STONES, mottle) * (1 - sand)
    height = _profile(distance, sand, stones)
    height += _relief(x, distance, sand, seed)
    outward = smoothstep(22.0, 62.0, distance)
    height += (far - height) * outward
    return Shore(distance, sand, stones, height)


def outline_distance(x: NDArray[np.floating], z: NDArray[np.floating], outline: Outline = OUTLINE) -> Floats:
    """Signed distance of points from a drawn outline, metres, positive outside it."""
    line = outline_curve(8, outline)
    point = np.stack([x.ravel(), z.ravel()], axis=1)
    nearest = np.full(len(point), np.inf)
    is_inside = np.zeros(len(point), bool)
    for start, end in zip(line, np.roll(line, -1, axis=0), strict=True):
        along = end - start
        offset = point - start
        share = np.clip(offset @ along / (along @ along), 0, 1)
        gap = offset - share[:, None] * along
        np.minimum(nearest, np.einsum("ij,ij->i", gap, gap), out=nearest)
        crosses = (point[:, 1] < start[1]) != (point[:, 1] < end[1])
        side = along[0] * offset[:, 1] - along[1] * offset[:, 0]
        is_inside ^= crosses & ((side < 0) == (along[1] > 0))
    signed: Floats = (np.where(is_inside, -1, 1) * np.sqrt(nearest)).astype(np.float32)
    return signed.reshape(x.shape)


def outline_curve(steps: int, outline: Outline = OUTLINE) -> NDArray[np.float64]:
    """The closed Catmull-Rom curve through the control points, ``steps`` points for each, (n, 2)."""
    control = np.array(outline)
    before, after, beyond = (np.roll(control, shift, axis=0) for shift in (1, -1, -2))
    share = (np.arange(steps) / steps)[None, :, None]
    before, here, after, beyond = (part[:, None, :] for part in (before, control, after, beyond))
    curve: NDArray[np.float64] = 0.5 * (
        2 * here
        + (after - before) * share
        + (2 * before - 5 * here + 4 * after - beyond) * share**2
        + (3 * here - before - 3 * after + beyond) * share**3
    )
    return curve.reshape(-1, 2)


def _patches(axis: Axis, discs: tuple[tuple[float, float, float], ...], mottle: Floats) -> Floats:
    x = axis.world
    reach = np.full((len(x), len(x)), -1e3, np.float32)
    for centre_x, centre_z, radius in discs:
        away = np.hypot((x - centre_x)[None, :], (x - centre_z)[:, None])
        np.maximum(reach, (1.6 * (1 - away / radius)).astype(np.float32), out=reach)
    return smoothstep(-0.25, 0.35, reach + 0.5 * mottle)


def _profile(distance: Floats, sand: Floats, stones: Floats) -> Floats:
    """Height against the distance from the waterline: a gentle beach, stones, or a grassy edge."""
    land = np.maximum(distance, 0)
    wet = np.maximum(-distance, 0)
    basin = DEPTH * (1 - np.exp(-((wet / 5.2) ** 1.5)))
    shelf = 0.22 * smoothstep(0.0, 0.55, wet)
    grass_bed = -(shelf + (1 - 0.1) * basin)
    sand_bed = -(0.03 * np.minimum(wet, 1.0) + DEPTH * (1 - np.exp(-((wet / 6.0) ** 1.7))))
    bed = grass_bed + (sand_bed - grass_bed) * sand
    bed += 0.1 * stones * smoothstep(0.0, 0.5, wet)
    slope = 0.065 * np.minimum(land, 12) + 0.03 * np.maximum(land - 12, 0)
    bank = 0.30 * smoothstep(-0.05, 0.9, land) + slope
    beach = 0.085 * np.minimum(land, 3.6) + slope * smoothstep(1.0, 4.5, land) + 0.02 * smoothstep(0, 0.4, land)
    top = bank + (beach - bank) * sand
    return np.where(distance > 0, top, bed).astype(np.float32)


def _relief(x: NDArray[np.float64], distance: Floats, sand: Floats, seed: int) -> Floats:
    """Undulation of the meadow and unevenness of the bed, metres."""
    broad = grid_fbm(x, x, 14.0, seed + 5, octaves=2)
    small = grid_fbm(x, x, 1.3, seed + 6, octaves=3)
    tussock = grid_fbm(x, x, 0.45, seed + 7, octaves=2)
    meadow = smoothstep(1.0, 14.0, distance)
    shore = smoothstep(0.0, 0.8, np.abs(distance))
    rough = 0.055 * shore * (1 - 0.6 * sand)
    return (0.75 * meadow * broad + rough * small + 0.022 * shore * (1 - sand) * tussock).astype(np.float32)
