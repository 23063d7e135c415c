"""The lake's outline, its bed, and the valley in which it lies.

The outline was drawn for the default camera, which stands on the point at the south end and looks up
the lake: a bay with reeds on the right, behind it a headland with pines, and an island on the left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.scene.noise import Floats, point_fbm, resolved_fbm, smoothstep
from renderer.scene.shore import Outline, Shore, outline_distance
from renderer.scene.terrain import Axis, upsampled

Array = NDArray[np.float64]

OUTLINE: Outline = (
    (0.0, -1.2), (4.5, -2.6), (8.6, -6.5), (11.5, -12.5), (14.0, -19.0), (19.0, -22.5), (25.5, -20.0), (35.0, -19.0),
    (42.0, -25.0), (45.0, -36.0), (52.0, -50.0), (63.0, -62.0), (75.0, -74.0), (80.0, -89.0), (69.0, -99.0),
    (50.0, -103.0), (36.0, -108.0), (39.0, -117.0), (58.0, -124.0), (80.0, -132.0), (97.0, -150.0), (104.0, -174.0),
    (99.0, -202.0), (89.0, -226.0), (94.0, -252.0), (84.0, -282.0), (62.0, -304.0), (34.0, -316.0), (6.0, -322.0),
    (-22.0, -314.0), (-40.0, -298.0), (-48.0, -276.0), (-66.0, -262.0), (-86.0, -240.0), (-94.0, -210.0),
    (-86.0, -180.0), (-96.0, -150.0), (-107.0, -120.0), (-105.0, -90.0), (-93.0, -64.0), (-80.0, -42.0),
    (-63.0, -26.0), (-46.0, -17.0), (-32.0, -9.0), (-21.0, -1.5), (-12.0, 2.5), (-5.0, 1.2),
)  # fmt: skip
"""Control points of the shore, (x, z) metres, joined by a closed Catmull-Rom curve."""

ISLAND: Outline = (
    (-20.0, -143.0), (-23.0, -137.5), (-31.0, -135.5), (-40.0, -137.0), (-47.5, -143.0), (-44.0, -150.5),
    (-34.0, -153.5), (-24.0, -150.0),
)  # fmt: skip
"""Control points of the island."""

MIDDLE = (0.0, -160.0)
"""The middle of the water, (x, z) metres."""
RING = (3.0, -35.0, 36.5, 45.0)
"""The treeless way of the default camera's turntable: (x, z) of its middle, inner and outer radius, metres."""
DEPTH = 16.0
"""How far the bed falls beyond the shelf, metres."""
SAND = ((-13.0, 2.0, 9.0), (-40.0, -14.0, 9.0))
"""Beaches: (x, z, radius) metres; elsewhere chance lays them."""


def shape_lake(axis: Axis, seed: int) -> Shore:
    """Shape bed and land over the grid of ``axis``."""
    x = axis.world
    coarse = axis.coarser(4)
    around_x, around_z = np.meshgrid(coarse.world, coarse.world)
    distance = upsampled(land_distance(around_x, around_z), len(x))
    calm = 1 - 0.75 * _disc(x, (0.0, 0.0, 22.0))
    distance += (
        1.7 * resolved_fbm(x, 23.0, seed + 1, octaves=2) + 0.7 * resolved_fbm(x, 6.0, seed + 2, octaves=3)
    ) * calm
    distance += np.where(np.abs(distance) < 9, 0.16 * resolved_fbm(x, 0.8, seed + 3, octaves=3), np.float32(0))
    mottle = resolved_fbm(x, 3.1, seed + 4, octaves=3)
    sand = smoothstep(0.22, 0.5, resolved_fbm(x, 37.0, seed + 5, octaves=2) - 0.25 + 0.25 * mottle)
    for disc in SAND:
        sand = np.maximum(sand, smoothstep(0.1, 0.6, _disc(x, disc) + 0.25 * mottle))
    sand *= 1 - _disc(x, (-33.0, -144.0, 24.0))
    stones = smoothstep(-0.3, 0.4, resolved_fbm(x, 21.0, seed + 6, octaves=2) + 0.4 * mottle)
    stones = np.maximum(stones, smoothstep(0.1, 0.5, _disc(x, (4.0, -4.0, 14.0)) + 0.2 * mottle)) * (1 - sand)
    stones *= 1 - 0.75 * _disc(x, (-33.0, -144.0, 26.0))
    height = np.where(distance > 0, _banks(distance, sand), _bed(x, distance, sand, seed))
    far = axis.coarser(8)
    far_x, far_z = np.meshgrid(far.world, far.world)
    height += upsampled(valley_height(far_x, far_z, distance[::8, ::8].astype(np.float64), seed), len(x))
    height += 1.6 * _disc(x, (-33.0, -144.0, 15.0)) * (distance > 0)
    height += _relief(x, distance, sand, seed)
    # Ground that chance dug out on land would show the water's plane.
    low = 0.02 + 0.09 * np.minimum(np.maximum(distance, 0), 4)
    height = np.where(distance > 0, np.maximum(height, low), np.minimum(height, 0.04 * np.maximum(distance, -1)))
    return Shore(*(part.astype(np.float32) for part in (distance, sand, stones, height)))


def land_distance(x: Array, z: Array) -> Floats:
    """Signed distance of points from the drawn waterline, metres, positive on land and on the island."""
    lake = outline_distance(x, z, OUTLINE)
    return np.asarray(np.maximum(lake, -outline_distance(x, z, ISLAND)), np.float32)


def valley_height(x: Array, z: Array, distance: Array, seed: int) -> Floats:
    """How high the valley's sides stand over the banks, metres: steep along the lake, low at its ends.

    ``distance`` in metres from the waterline.
    """
    points = np.stack([np.ravel(x), np.ravel(z)], axis=1).astype(np.float64)
    off_x, off_z = np.abs(x - MIDDLE[0]), np.abs(z - MIDDLE[1])
    aside = off_x / (np.hypot(off_x, 0.62 * off_z) + 1e-9)
    side = np.clip((aside - 0.42) / 0.42, 0, 1)
    side = side * side * (3 - 2 * side)
    rough = point_fbm(points, 170.0, seed + 21, octaves=4).reshape(np.shape(x))
    spur = np.abs(point_fbm(points, 95.0, seed + 22, octaves=3)).reshape(np.shape(x))
    away = np.maximum(distance - 9 - 5 * rough, 0)
    rise = away * away / (away + 34)
    top = 20 + 118 * side * (1 + 0.16 * (x < 0))
    level = top * (1 - np.exp(-(0.10 + 0.47 * side) * rise / top))
    height = level * (1 + 0.30 * rough - 0.22 * spur) + 1.1 * np.clip(away / 30, 0, 1) * rough
    return np.asarray(np.maximum(height, 0.02 * away), np.float32)


def _disc(x: NDArray[np.float64], disc: tuple[float, float, float]) -> Floats:
    """1 in the middle of (x, z, radius), 0 beyond it."""
    centre_x, centre_z, radius = disc
    away = np.hypot((x - centre_x)[None, :], (x - centre_z)[:, None])
    return smoothstep(1.0, 0.25, (away / radius).astype(np.float32))


def _banks(distance: Floats, sand: Floats) -> Floats:
    """The land's first metres: a beach, or a grassy step."""
    land = np.maximum(distance, 0)
    slope = 0.055 * np.minimum(land, 14)
    bank = 0.34 * smoothstep(-0.05, 1.6, land) + slope
    beach = 0.075 * np.minimum(land, 4.0) + slope * smoothstep(1.5, 6.0, land)
    return np.asarray(bank + (beach - bank) * sand, np.float32)


def _bed(x: NDArray[np.float64], distance: Floats, sand: Floats, seed: int) -> Floats:
    """The bed: a shelf that fades away gently, and beyond its edge the deep."""
    wet = np.maximum(-distance, 0)
    shelf = 6.0 + 2.4 * resolved_fbm(x, 44.0, seed + 8, octaves=2) + 4.0 * sand
    shelf = np.maximum(shelf, 2.5) + 4.0 * _disc(x, (3.0, -6.0, 30.0))
    gentle = (0.10 - 0.035 * sand) * np.minimum(wet, shelf) + 0.10 * smoothstep(0.0, 0.5, wet) * (1 - sand)
    beyond = np.maximum(wet - shelf, 0)
    fall = 1 - np.exp(-((beyond / 25.0) ** 1.3))
    return np.asarray(-(gentle + (DEPTH - 1.2 + 1.3 * resolved_fbm(x, 61.0, seed + 9, octaves=2)) * fall), np.float32)


def _relief(x: NDArray[np.float64], distance: Floats, sand: Floats, seed: int) -> Floats:
    """Unevenness of meadow and bed, metres."""
    off = np.abs(distance)
    shore = smoothstep(0.0, 0.9, off)
    small = resolved_fbm(x, 1.4, seed + 10, octaves=3) * (0.05 * shore * (1 - 0.7 * sand))
    broad = resolved_fbm(x, 11.0, seed + 11, octaves=3) * (0.45 * smoothstep(2.5, 16.0, off))
    return np.asarray(small + broad, np.float32)
