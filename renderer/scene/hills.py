"""The country round the pond: near woods, hills and far mountains, to where the sky begins.

One sheet of land from 80 m to 1,300 m, in rows of constant distance. The air's blue is in the colours,
so that hills lose contrast with distance under any sun.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene.mesh import Mesh, smooth_normals
from renderer.scene.noise import point_fbm, point_noise

Array = NDArray[np.float64]

VALLEY = (-0.91, -0.41)
"""Direction, (x, z), of the gap in the near ridges through which the mountains are seen."""

NEAR_ROWS = (80, 104, 124, 138, 148, 156, 163, 176, 215, 260, 300, 328, 346, 362, 400)
FAR_ROWS = (400, 640, 830, 960, 1050, 1120, 1200, 1300)
"""Distances of the sheet's rows, metres: those near enough to show trees, and the others."""

TILE = 34.0
"""Side of the canopy texture's tile, metres."""

_AIR = np.array([0.40, 0.51, 0.64])
_WOOD = np.array([0.045, 0.080, 0.028])
_MEADOW = np.array([0.105, 0.150, 0.045])
_ROCK = np.array([0.20, 0.20, 0.20])


@dataclass(frozen=True)
class Ridge:
    """A chain of hills round the pond: distance of its crest, half width and height, metres."""

    crest: float
    width: float
    height: float
    rough: float
    """How much the height varies along it, 0 to 1."""
    gap: float
    """How much of it the valley takes away, 0 to 1."""


RIDGES = (
    Ridge(158.0, 66.0, 7.5, 0.7, 0.9),
    Ridge(345.0, 130.0, 19.0, 0.8, 0.75),
    Ridge(1080.0, 420.0, 78.0, 0.7, 0.0),
)


def far_height(x: Array, z: Array, seed: int) -> Array:
    """The land's height in metres at points of any shape, from 60 m outwards."""
    points = np.stack([np.ravel(x), np.ravel(z)], axis=1).astype(np.float64)
    distance = np.sqrt((points**2).sum(axis=1)) + 1e-9
    direction = points / distance[:, None]
    height = 2.6 + 0.9 * point_fbm(points, 38.0, seed, octaves=2)
    towards = direction @ (np.array(VALLEY) / np.hypot(*VALLEY))
    gap = np.clip((towards - 0.80) / 0.17, 0, 1)
    gap = gap * gap * (3 - 2 * gap)
    for number, ridge in enumerate(RIDGES):
        shape = point_fbm(direction, 0.75 - 0.15 * number, seed + 11 * number + 3, octaves=4)
        shape += 0.3 * point_fbm(points, 0.3 * ridge.width, seed + 11 * number + 5, octaves=3)
        crest = ridge.crest * (1 + 0.06 * point_noise(direction, 0.5, seed + 11 * number + 7))
        slope = np.clip(1 - np.abs(distance - crest) / ridge.width, 0, 1)
        slope = slope * slope * (3 - 2 * slope)
        level = ridge.height * (1 + ridge.rough * shape) * (1 - ridge.gap * gap)
        height += slope * np.maximum(level, 0.12 * ridge.height)
    return height.reshape(np.shape(x))


def hill_sheet(seed: int, rows: tuple[int, ...], columns: int, sectors: int) -> list[Mesh]:
    """The land between the first and the last row, cut into ``sectors``; the first begins in the north."""
    turn = np.arange(columns + 1) * (2 * np.pi / columns)
    turn[-1] = 0.0
    direction = np.stack([np.sin(turn), -np.cos(turn)], axis=1)
    away = np.array(rows, np.float64)
    x, z = away[:, None] * direction[:, 0], away[:, None] * direction[:, 1]
    height = far_height(x, z, seed)
    height += _treetops(x, z, away, seed)
    height -= 0.4 * np.clip((150 - away) / 20, 0, 1)[:, None]
    position = np.stack([x, height, z], axis=2)
    color = _colors(x, z, height, away, seed)
    wide = columns // sectors
    return [_strip(position[:, at : at + wide + 1], color[:, at : at + wide + 1]) for at in range(0, columns, wide)]


def _treetops(x: Array, z: Array, rows: Array, seed: int) -> Array:
    """The unevenness of a wooded skyline, metres, where a crest is seen against the sky."""
    points = np.stack([x.ravel(), z.ravel()], axis=1)
    near = point_noise(points, 3.6, seed + 61) + 0.5 * point_noise(points, 1.7, seed + 62)
    middle = point_noise(points, 6.0, seed + 63) + 0.5 * point_noise(points, 3.0, seed + 64)
    band = rows[:, None]
    at_near = np.clip(1 - np.abs(band - 158) / 22, 0, 1)
    at_middle = np.clip(1 - np.abs(band - 345) / 45, 0, 1)
    return 0.7 * at_near * near.reshape(x.shape) + 1.1 * at_middle * middle.reshape(x.shape)


def _colors(x: Array, z: Array, height: Array, rows: Array, seed: int) -> Array:
    points = np.stack([x.ravel(), z.ravel()], axis=1)
    patch = point_fbm(points, 60.0, seed + 71, octaves=3).reshape(x.shape)
    is_open = np.clip((patch - 0.15) * 3.5, 0, 1) * np.clip((rows[:, None] - 170) / 40, 0, 1)
    is_open *= np.clip((22 - height) / 8, 0, 1)
    tint = 1 + 0.35 * point_noise(points, 11.0, seed + 73).reshape(x.shape)
    color = _WOOD * tint[:, :, None]
    color = color + (_MEADOW - color) * is_open[:, :, None]
    bare = np.clip((height - 60) / 40, 0, 1) * np.clip((rows[:, None] - 500) / 100, 0, 1)
    color = color + (_ROCK - color) * (0.7 * bare)[:, :, None]
    # Haze lies low: the feet of far mountains fade into it.
    air = 1 - np.exp(-np.maximum(rows - 60, 0)[:, None] / (560.0 + 5 * np.maximum(height, 0)))
    return color + (_AIR - color) * (0.95 * air)[:, :, None]


def _strip(position: Array, color: Array) -> Mesh:
    deep, wide = position.shape[:2]
    number = np.arange(deep * wide).reshape(deep, wide)
    near_left, near_right = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
    far_left, far_right = number[1:, :-1].ravel(), number[1:, 1:].ravel()
    index = np.concatenate(
        [np.stack([near_left, near_right, far_right], 1), np.stack([near_left, far_right, far_left], 1)],
    )
    flat = position.reshape(-1, 3)
    return Mesh.build(
        flat,
        index,
        normal=smooth_normals(flat, index),
        uv=flat[:, [0, 2]],
        color=color.reshape(-1, 3),
    )
