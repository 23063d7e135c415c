"""Textures of built stone, drawn with NumPy: veined marble, an inlaid floor, brickwork and a court's paving.

Colours are stored as square roots of linear values. All but the floor repeat.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from renderer.scene.noise import Floats, grid_fbm, grid_noise, hashed, scattered, smoothstep
from renderer.scene.textures import packed

Bytes = NDArray[np.uint8]

BRICKS, COURSES = 15, 48
"""Bricks in a course, and courses, of one tile of brickwork."""
BRICK_TILE = 6.24
"""Side of that tile, metres: bricks of 0.416 by 0.13 with their joints."""

PAVING_TILE = 8.0
"""Side of the paving's tile, metres."""
DEPTHS = (0.9, 0.7, 1.1, 0.8, 1.0, 0.75, 0.95, 0.8, 1.0)
"""Depths of the courses of slabs in one tile, metres."""
JOINT = 0.016
"""Half the width of a joint between slabs, metres."""

_WHITE = np.array([0.56, 0.545, 0.515], np.float32)
_CLOUD = np.array([0.30, 0.305, 0.315], np.float32)
_VEIN = np.array([0.085, 0.090, 0.100], np.float32)
_GOLD = np.array([0.34, 0.225, 0.115], np.float32)
_CLAYS = np.array(
    [[0.36, 0.165, 0.095], [0.30, 0.120, 0.070], [0.42, 0.235, 0.130], [0.25, 0.115, 0.080], [0.40, 0.200, 0.120]],
    np.float32,
)
_MORTAR = np.array([0.42, 0.375, 0.305], np.float32)
_GREEN = np.array([0.055, 0.115, 0.085], np.float32)
_RED = np.array([0.30, 0.110, 0.080], np.float32)

VEINS = ((2, 1, 0.040, 1.0), (1, -2, 0.034, 0.75), (3, 2, 0.040, 0.60), (5, -3, 0.050, 0.35))
"""Systems of veins: how often each crosses a tile along x and z, its width in parts of that, and its strength."""


def marble(size: int, seed: int) -> Bytes:
    """White marble, (size, size, 4): soft grey clouds, and veins that thicken, branch and fade."""
    texel = np.arange(size, dtype=np.float64) + 0.5
    period = float(size)

    def noise(parts: int, number: int, octaves: int, gain: float = 0.5) -> Floats:
        return grid_fbm(texel, texel, size / parts, seed + 211 * number, octaves=octaves, gain=gain, period=period)

    bend = [(size / 22) * noise(3, number, 5, 0.55) for number in (1, 2)]
    clouds = smoothstep(-0.5, 1.1, _moved(noise(4, 3, 6, 0.58), *bend))
    color = _WHITE + (_CLOUD - _WHITE) * (0.80 * clouds)[..., None]
    for number, (along, across, width, strength) in enumerate(VEINS):
        bent = np.float32(0.34) * noise(3, number + 5, 6, 0.56) + np.float32(0.02) * _moved(noise(16, 8, 3), *bend)
        phase = (along * texel[None, :] + across * texel[:, None]) / period + bent
        course = np.abs(2 * (phase - np.floor(phase)) - 1).astype(np.float32)
        swell = smoothstep(-0.6, 0.9, noise(6, number + 20, 3))
        shows = smoothstep(-0.45, 0.55, noise(4, number + 40, 3)) * np.float32(strength)
        thin = smoothstep(1.0, 0.0, course / (np.float32(width) * (np.float32(0.25) + swell)))
        halo = smoothstep(1.0, 0.0, course / np.float32(11 * width)) * np.float32(0.34)
        warm = smoothstep(0.1, 0.9, noise(3, number + 60, 2))[..., None]
        tone = _VEIN + (_GOLD - _VEIN) * (0.75 * warm)
        color += (tone - color) * (np.maximum(thin * shows, halo * shows))[..., None]
    grain = 1 + np.float32(0.03) * noise(128, 9, 2)
    return _encoded(color * grain[..., None])


def inlay(size: int, seed: int) -> Bytes:
    """A floor of inlaid marbles, (size, size, 4): bands, corner squares and a rosette, their joints thin and dark."""
    line = ((np.arange(size) + 0.5) / size * 2 - 1).astype(np.float32)
    x, z = (axis.astype(np.float32) for axis in np.meshgrid(line, line))
    square = np.maximum(np.abs(x), np.abs(z))
    away = np.sqrt(x * x + z * z)
    diamond = np.abs(x) + np.abs(z)
    white = np.square(marble(size, seed)[..., :3].astype(np.float32) / 255)
    tone = (white.mean(axis=2) / 0.6)[..., None]
    color = white.copy()
    petals = np.float32(0.31) + np.float32(0.07) * _cosine_of_eight(x / np.maximum(away, 1e-6))
    shapes: list[tuple[NDArray[np.floating], Floats]] = [
        (np.minimum(square - 0.86, 0.95 - square), _GREEN),
        (np.minimum(square - 0.74, 0.775 - square), _RED),
        (np.minimum(0.70 - square, diamond - 0.98), _GREEN),
        (np.minimum(0.66 - away, away - 0.60), _RED),
        (petals - away, _GREEN),
        (0.15 - away, _RED),
        (0.075 - away, _WHITE),
    ]
    joint: Floats = np.full_like(x, 9.0)
    for inside, stone in shapes:
        share = smoothstep(-1.0 / size, 1.0 / size, inside.astype(np.float32))[..., None]
        veined = stone * (0.75 + 0.45 * (1 - tone)) + np.float32(0.10) * (1 - tone)
        color += ((veined if stone is not _WHITE else white) - color) * share
        joint = np.minimum(joint, np.abs(inside)).astype(np.float32)
    return _encoded(color * (1 - np.float32(0.45) * smoothstep(0.005, 0.0, joint))[..., None])


def _cosine_of_eight(c: NDArray[np.floating]) -> Floats:
    """cos(8 t) of c = cos t."""
    two = 2 * c * c - 1
    four = 2 * two * two - 1
    return np.asarray(2 * four * four - 1, np.float32)


def brickwork(size: int, seed: int) -> Bytes:
    """Old bricks in running bond, (size, size, 4): no two of one colour, arrises worn, joints of pale mortar."""
    texel = np.arange(size, dtype=np.float64) + 0.5
    period = float(size)
    worn = grid_fbm(texel, texel, size / 128, seed, octaves=3, gain=0.7, period=period)
    mottle = grid_fbm(texel, texel, size / 64, seed + 3, octaves=4, gain=0.7, period=period)
    u, v = np.meshgrid(texel / size * BRICKS, texel / size * COURSES)
    course = np.floor(v).astype(np.int64)
    u = u + 0.5 * (course % 2) + 0.06 * (hashed(seed + 5, course) - 0.5)
    brick = np.floor(u).astype(np.int64)
    pick = [hashed(seed + 7 + number, brick % BRICKS, course) for number in range(3)]
    metre = BRICK_TILE / BRICKS, BRICK_TILE / COURSES
    edge = np.minimum(
        np.minimum(u - brick, brick + 1 - u) * metre[0],
        np.minimum(v - course, course + 1 - v) * metre[1],
    ).astype(np.float32)
    inside = smoothstep(0.005, 0.013, edge + np.float32(0.0028) * worn)
    clay = _CLAYS[(pick[0] * len(_CLAYS)).astype(np.int64)]
    color = clay * (0.78 + 0.40 * pick[1] + 0.16 * mottle)[..., None]
    burnt = (pick[2] > 0.93)[..., None]
    color = np.where(burnt, color * np.float32(0.6), color) * (0.72 + 0.28 * smoothstep(0.010, 0.028, edge))[..., None]
    mortar = _MORTAR * (0.86 + 0.16 * worn + 0.10 * mottle)[..., None]
    return _encoded(mortar + (color - mortar) * inside[..., None])


@cache
def slab_joints(seed: int) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Where courses begin along z, and where slabs begin along x in each course, metres of one tile."""
    ends = np.concatenate([[0.0], np.cumsum(DEPTHS)])
    rows = []
    for number, depth in enumerate(DEPTHS):
        share = 0.75 + scattered(seed + number, 1, 7 if depth > 0.9 else 8)[0]
        start = np.cumsum(share) / share.sum() * PAVING_TILE
        rows.append((start + PAVING_TILE * scattered(seed + 40 + number, 1, 1)[0, 0]) % PAVING_TILE)
        rows[-1].sort()
    return ends, rows


def slabs(x: NDArray[np.floating], z: NDArray[np.floating], seed: int) -> tuple[NDArray[np.int64], Floats]:
    """Which slab of the paving lies at axes x and z, as one number, and how far its nearest joint, both (z, x)."""
    ends, rows = slab_joints(seed)
    local_z = z % PAVING_TILE
    course = np.clip(np.searchsorted(ends, local_z, side="right") - 1, 0, len(DEPTHS) - 1)
    band = np.floor(z / PAVING_TILE).astype(np.int64) * len(DEPTHS) + course
    edge_z = np.minimum(local_z - ends[course], ends[course + 1] - local_z)
    number = np.zeros((len(z), len(x)), np.int64)
    edge = np.zeros((len(z), len(x)), np.float32)
    local_x, column = x % PAVING_TILE, np.floor(x / PAVING_TILE).astype(np.int64)
    for at, starts in enumerate(rows):
        round_it = np.concatenate([[starts[-1] - PAVING_TILE], starts, [starts[0] + PAVING_TILE]])
        slab = np.searchsorted(round_it, local_x, side="right") - 1
        edge_x = np.minimum(local_x - round_it[slab], round_it[slab + 1] - local_x)
        chosen = course == at
        number[chosen] = (column * len(starts) + slab)[None, :]
        edge[chosen] = np.minimum(edge_x[None, :], edge_z[chosen, None])
    return number * 65537 + band[:, None], edge


def paving_detail(size: int, seed: int) -> Bytes:
    """One tile of paving as a detail map: dressed slabs between sunk joints."""
    texel = np.arange(size, dtype=np.float64) + 0.5
    period = float(size)
    metre = texel / size * PAVING_TILE
    _, edge = slabs(metre, metre, seed)
    chipped = grid_fbm(texel, texel, size / 64, seed + 3, octaves=4, gain=0.7, period=period)
    grain = grid_noise(texel, texel, size / 512, seed + 4, period=period)
    pits = smoothstep(0.55, 1.1, grid_noise(texel, texel, size / 256, seed + 5, period=period))
    top = smoothstep(JOINT * 0.6, JOINT * 1.9, edge + np.float32(0.006) * chipped)
    height = 2.2 * top + 0.28 * chipped + 0.12 * grain - 0.5 * pits * top
    return packed(height, 0.35, 0.20 + 0.36 * top + 0.045 * chipped + 0.035 * grain - 0.10 * pits * top)


def limestone_detail(size: int, seed: int) -> Bytes:
    """Dressed limestone as a detail map: fine tooling, a few pits, and two joints across v in one tile."""
    texel = np.arange(size, dtype=np.float64) + 0.5
    period = float(size)
    lumps = grid_fbm(texel, texel, size / 8, seed, octaves=6, gain=0.6, period=period)
    grain = grid_noise(texel, texel, size / 256, seed + 3, period=period)
    pits = smoothstep(0.75, 1.15, grid_noise(texel, texel, size / 64, seed + 5, period=period))
    wobble = grid_noise(texel, texel, size / 32, seed + 7, period=period)
    away = np.abs((2 * texel / size) % 1 - 0.5).astype(np.float32)[:, None] * np.float32(size / 2)
    joint = smoothstep(2.4, 0.8, away + np.float32(0.5) * wobble)
    height = 2.2 * lumps + 0.22 * grain - 1.6 * pits - 2.4 * joint
    return packed(height, 0.3, 0.5 + 0.085 * lumps + 0.035 * grain - 0.09 * pits - 0.26 * joint)


def _moved(field: Floats, right: Floats, down: Floats) -> Floats:
    """A repeating field read at a displacement in texels, between four texels."""
    size = len(field)
    row, column = np.meshgrid(np.arange(size, dtype=np.float32), np.arange(size, dtype=np.float32), indexing="ij")
    x, z = column + right, row + down
    x0, z0 = np.floor(x), np.floor(z)
    part_x, part_z = x - x0, z - z0
    left, top = x0.astype(np.int64) % size, z0.astype(np.int64) % size
    beside, below = (left + 1) % size, (top + 1) % size
    upper = field[top, left] * (1 - part_x) + field[top, beside] * part_x
    lower = field[below, left] * (1 - part_x) + field[below, beside] * part_x
    moved: Floats = upper * (1 - part_z) + lower * part_z
    return moved


def _encoded(color: NDArray[np.floating]) -> Bytes:
    """Linear rgb as roots in eight bits, opaque."""
    image = np.full((*color.shape[:2], 4), 255, np.uint8)
    image[..., :3] = np.sqrt(np.clip(color, 0, 1)) * 255 + 0.5
    return image
