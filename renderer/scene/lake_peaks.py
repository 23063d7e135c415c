"""The mountains round the lake: one sheet of land in rings, from the end of the ground to where the sky begins.

Height and colour are drawn on one fine grid of bearing and distance; the mesh takes every few of its
points, and the colours are a texture, so that rock and snow are finer than the triangles. The air's blue
is in the colours and levels the normals, so that ridges fade with distance under any sun.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene.lake_shore import land_distance, valley_height
from renderer.scene.mesh import Mesh, smooth_normals
from renderer.scene.noise import Floats, grid_fbm, smoothstep

Array = NDArray[np.float64]

COLUMNS, ROWS = 4608, 512
"""Samples round and outwards."""
LEVELS = {"full": (6, 16, 8), "map": (12, 32, 16)}
"""Every how many columns, rows before the mountains, and rows on them a level of detail has a vertex."""
SECTORS = 24
BREAKS = ((0.0, 480.0), (0.22, 1150.0), (0.86, 3400.0), (1.0, 4600.0))
"""Share of the rows, and the distance there, metres."""
SUNK = 9.0
"""How far under the ground the sheet begins, metres."""

_WOOD = np.array((0.030, 0.052, 0.026), np.float32)
_GLADE = np.array((0.105, 0.135, 0.048), np.float32)
_ALP = np.array((0.125, 0.125, 0.066), np.float32)
_ROCK = np.array((0.250, 0.235, 0.215), np.float32)
_DARK = np.array((0.088, 0.085, 0.086), np.float32)
_SCREE = np.array((0.300, 0.285, 0.262), np.float32)
_SNOW = np.array((0.86, 0.89, 0.94), np.float32)
_AIR = np.array((0.36, 0.46, 0.60), np.float32)


@dataclass(frozen=True)
class Peak:
    """One mountain: its bearing (degrees from north over east), distance, height and half width as an angle."""

    bearing: float
    distance: float
    height: float
    width: float


PEAKS = (
    Peak(-4.0, 2700, 660, 17.0), Peak(-13.5, 3000, 560, 14.0), Peak(5.5, 3050, 590, 13.0),
    Peak(14.5, 2450, 430, 14.0), Peak(24.0, 2900, 520, 15.0), Peak(-24.0, 2550, 450, 15.0),
    Peak(-38.0, 2900, 540, 17.0), Peak(37.0, 2700, 430, 15.0), Peak(52.0, 2900, 500, 18.0),
    Peak(72.0, 2600, 420, 18.0), Peak(95.0, 2900, 540, 20.0), Peak(120.0, 2700, 380, 18.0),
    Peak(148.0, 2900, 400, 20.0), Peak(176.0, 3100, 440, 19.0), Peak(204.0, 2800, 350, 20.0),
    Peak(-130.0, 2900, 420, 18.0), Peak(-105.0, 2700, 500, 18.0), Peak(-80.0, 2900, 450, 18.0),
    Peak(-60.0, 2600, 450, 16.0),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Range:
    """The mountains' grid: rows outwards, columns from north over east."""

    bearing: Array
    """(columns,) radians."""
    distance: Array
    """(rows,) metres."""
    height: Floats
    air: Floats
    """Share of what is seen that is air, (rows, columns)."""


def distances() -> Array:
    """The rows' distances from the origin, metres."""
    share, away = np.array(BREAKS).T
    return np.asarray(np.exp(np.interp(np.linspace(0, 1, ROWS), share, np.log(away))))


def shape_range(seed: int) -> Range:
    """Shape the mountains; the sheet joins the ground's own valley."""
    bearing = np.asarray(np.arange(COLUMNS) * (2 * np.pi / COLUMNS), np.float64)
    away = distances()
    deep = np.log(away)
    height = _valley(away, seed) - SUNK * smoothstep(900.0, 620.0, away.astype(np.float32))[:, None]
    rise = smoothstep(620.0, 1500.0, away.astype(np.float32))[:, None]
    mass = _mass(bearing, deep, seed)
    ridged = _ridged(bearing, deep, seed)
    hills = 26 + 22 * _noise(bearing, deep, 0.16, seed + 9, octaves=5)
    height = np.maximum(height, -4) + rise * np.maximum(hills, 5) + mass * (0.80 + 0.42 * ridged) * rise
    haze = 1 - np.exp(-np.maximum(away - 350, 0)[:, None] / (5200.0 + 6.0 * np.maximum(height, 0)))
    return Range(bearing, away, height.astype(np.float32), haze.astype(np.float32))


def range_sheet(land: Range, detail: str) -> list[Mesh]:
    """The mountains as meshes, by sectors; the first begins in the north."""
    across, along, steep = LEVELS[detail]
    begin = 112
    rows = np.concatenate([np.arange(0, begin, along), np.arange(begin, ROWS - 1, steep), [ROWS - 1]])
    columns = np.append(np.arange(0, COLUMNS, across), COLUMNS)
    around = columns % COLUMNS
    sine, cosine = np.sin(land.bearing[around]), np.cos(land.bearing[around])
    away = land.distance[rows][:, None]
    height = land.height[np.ix_(rows, around)]
    position = np.stack([away * sine, height, -away * cosine], axis=2)
    uv = np.stack(np.broadcast_arrays((columns + 0.5) / COLUMNS, ((rows + 0.5) / ROWS)[:, None]), axis=2)
    air = land.air[np.ix_(rows, around)][..., None]
    flat = position.reshape(-1, 3)
    normal = smooth_normals(flat, _grid(*position.shape[:2])).reshape(position.shape)
    # The first and the last column are one.
    normal[:, 0] = normal[:, -1] = normal[:, 0] + normal[:, -1]
    normal = (1 - air) * normal + air * np.array([0.0, 1.0, 0.0])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    wide = (len(columns) - 1) // SECTORS
    index = _grid(len(rows), wide + 1)
    return [
        Mesh.build(
            *(position[:, at : at + wide + 1].reshape(-1, 3), index),
            normal=normal[:, at : at + wide + 1].reshape(-1, 3),
            uv=uv[:, at : at + wide + 1].reshape(-1, 2),
        )
        for at in range(0, len(columns) - 1, wide)
    ]


def range_colors(land: Range, seed: int) -> NDArray[np.uint8]:
    """The texture, (rows, columns, 4): square roots of linear colours, opaque."""
    bearing, deep = land.bearing, np.log(land.distance)
    height = land.height
    away = land.distance.astype(np.float32)[:, None]
    slope_out = np.gradient(height, land.distance, axis=0).astype(np.float32)
    slope_round = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / (2 * away * np.float32(2 * np.pi / COLUMNS))
    steep = np.sqrt(slope_out**2 + slope_round**2)
    broad = _noise(bearing, deep, 0.11, seed + 31, octaves=4)
    fine = _noise(bearing, deep, 0.012, seed + 32, octaves=3, gain=0.75)
    crowns = _noise(bearing, deep, 0.0062, seed + 33, octaves=2, gain=0.8)
    hollow = _hollow(height) / away * 40

    color = np.broadcast_to(_WOOD, (*height.shape, 3)).copy()
    color *= (1 + 0.34 * np.clip(crowns, -1, 1) + 0.22 * broad)[..., None]
    _mix(color, _GLADE, smoothstep(0.34, 0.5, broad + 0.25 * fine) * smoothstep(0.8, 0.4, steep))
    alpine = smoothstep(-30.0, 40.0, height - 190 - 75 * broad - 26 * fine + 60 * hollow)
    _mix(color, _ALP, alpine)
    rock = np.maximum(
        smoothstep(0.55, 0.95, steep + 0.22 * fine) * smoothstep(60.0, 170.0, height + 40 * fine),
        smoothstep(-40.0, 50.0, height - 290 - 60 * broad - 25 * fine),
    )
    level = height + 26 * broad
    beds = grid_fbm(np.zeros(1), np.arange(0.0, 1200.0, 2.0), 34.0, seed + 34, octaves=4, gain=0.8)[:, 0]
    strata = np.interp(level.ravel(), np.arange(0.0, 1200.0, 2.0), beds).reshape(level.shape).astype(np.float32)
    gully = 1 - np.minimum(np.abs(2.2 * _noise(bearing, deep, 0.011, seed + 35, octaves=2, gain=0.7)), 1)
    stone = _ROCK + (_DARK - _ROCK) * smoothstep(-0.5, 0.8, 0.9 * fine + 0.4 * broad + 0.7 * strata)[..., None]
    stone += (_SCREE - stone) * (0.7 * smoothstep(0.8, 0.5, steep) * smoothstep(-0.2, 0.4, fine))[..., None]
    color += (stone - color) * rock[..., None]
    snow = smoothstep(-22.0, 14.0, height - 350 - 70 * broad - 40 * fine - 30 * gully - 60 * np.clip(hollow, -1, 1))
    snow *= smoothstep(1.35, 0.75, steep + 0.30 * fine - 0.0006 * np.maximum(height - 380, 0))
    _mix(color, _SNOW, snow)
    # What lies deep sees less of the sky; the finest gullies are too fine for the mesh.
    shade = np.clip(1 + 0.42 * hollow, 0.55, 1.25) * (1 - 0.5 * gully**2 * rock * (1 - 0.55 * snow))
    color *= shade[..., None]
    color += (_AIR - color) * (0.92 * land.air)[..., None]
    image = np.full((*height.shape, 4), 255, np.uint8)
    image[..., :3] = np.sqrt(np.clip(color, 0, 1)) * 255 + 0.5
    return image


def _mix(color: Floats, other: Floats, share: Floats) -> None:
    color += (other - color) * share[..., None]


def _hollow(height: Floats) -> Floats:
    """How far a point lies over its surroundings, metres; below zero in gullies."""
    soft: Floats = height
    for reach in (4, 8, 16):
        soft = ((np.roll(soft, reach, 1) + np.roll(soft, -reach, 1) + 2 * soft) / 4).astype(np.float32)
    return np.asarray(height - soft, np.float32)


def _noise(bearing: Array, deep: Array, angle: float, seed: int, *, octaves: int, gain: float = 0.5) -> Floats:
    """Noise whose detail keeps its angular size at every distance; ``angle`` in radians, nearly."""
    around = 2 * np.pi
    wavelength = around / max(round(around / angle), 1)
    period = (around, wavelength * 4096)
    return grid_fbm(bearing, deep, wavelength, seed, octaves=octaves, gain=gain, period=period)


def _ridged(bearing: Array, deep: Array, seed: int) -> Floats:
    """Sharp crests between rounded gullies, about -0.5 to 0.7 (folded noise, Musgrave 2003)."""
    total = np.zeros((len(deep), len(bearing)), np.float32)
    weight = np.ones_like(total)
    for octave in range(6):
        fold = 1 - np.minimum(np.abs(1.7 * _noise(bearing, deep, 0.10 / 2**octave, seed + 41 + octave, octaves=1)), 1)
        fold *= fold
        total += fold * weight * np.float32(0.58**octave)
        weight = np.clip(0.35 + 1.1 * fold, 0, 1).astype(np.float32)
    return total * np.float32(0.68) - np.float32(0.64)


def _mass(bearing: Array, deep: Array, seed: int) -> Floats:
    """The mountains' bulk, metres."""
    warp = 0.16 * _noise(bearing, deep, 0.14, seed + 51, octaves=3)
    total = np.full((len(deep), len(bearing)), 60.0**4, np.float32)
    for peak in PEAKS:
        middle = np.radians(peak.bearing)
        off = (bearing - middle + np.pi) % (2 * np.pi) - np.pi
        width = np.radians(peak.width)
        out = (deep - np.log(peak.distance)) / (2.6 * width)
        near = np.flatnonzero(np.abs(off) < 1.7 * width)
        off_squared = ((off[near] / width) ** 2).astype(np.float32)[None, :] + (out**2).astype(np.float32)[:, None]
        cone = np.clip(1.0 - np.sqrt(off_squared + np.float32(0.002)) + warp[:, near], 0, None)
        total[:, near] += np.float32(peak.height**4) * cone ** np.float32(4.6)
    return np.asarray(total**0.25, np.float32)


def _valley(away: Array, seed: int) -> Floats:
    """The lake valley's own sides where the sheet begins, and a level farther out."""
    columns = np.arange(0, COLUMNS + 1, 8)
    rows = np.arange(0, ROWS, 8)
    turn = columns * (2 * np.pi / COLUMNS)
    x, z = away[rows, None] * np.sin(turn), -away[rows, None] * np.cos(turn)
    coarse = valley_height(x, z, land_distance(x, z).astype(np.float64), seed)
    wide = np.stack([np.interp(np.arange(COLUMNS), columns, row) for row in coarse])
    return np.stack([np.interp(np.arange(ROWS), rows, column) for column in wide.T], axis=1).astype(np.float32)


def _grid(deep: int, wide: int) -> NDArray[np.int64]:
    """The triangles of a grid of vertices, counter-clockwise seen from above where columns run clockwise."""
    number = np.arange(deep * wide).reshape(deep, wide)
    near_left, near_right = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
    far_left, far_right = number[1:, :-1].ravel(), number[1:, 1:].ravel()
    return np.concatenate(
        [np.stack([near_left, near_right, far_right], 1), np.stack([near_left, far_right, far_left], 1)],
    )
