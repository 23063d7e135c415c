"""The wall behind the bath: brickwork pierced by arched windows, with stone pillars standing before it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from renderer.scene.mesh import Mesh
from renderer.scene.mouldings import Path, curve, facing, quads, swept
from renderer.scene.noise import point_fbm, point_noise

Array = NDArray[np.float64]

CENTRE = (0.0, 6.0, -8.0)
"""The middle of the wall, metres."""
GROUND = 1.0
PILLARS = (-8.2, -4.1, 0.0, 4.1, 8.2)
"""Where the pillars stand along x; a window lies midway between two."""
THICK = 0.40
"""Half the wall's thickness."""
TOP = 9.25
"""Where the brickwork ends and the cornice begins."""
SILL, SPRING, WIDE = 2.3, 5.7, 1.02
"""A window: heights of its sill and of where its arch springs, and half its width."""
TRIM, PROUD = 0.28, 0.07
"""Width of the stone round a window, and how far it stands out."""
STONE_TILE = 1.7
ARC = 12
"""Pieces of half an arch."""

_STONE = np.array([0.43, 0.385, 0.305])
_LEVELS = (0.9, 1.15, 1.5, SILL, 3.3, 4.5, SPRING)


def brickwork(tile: float, seed: int) -> Mesh:
    """The wall itself, both faces and both ends; uv in tiles of ``tile`` metres."""
    parts = []
    for side in (1.0, -1.0):
        flats: list[Mesh] = []
        for left, right in pairwise(PILLARS):
            flats += _bay(left, right, side)
        parts += flats
    for end in (-1.0, 1.0):
        x = end * (PILLARS[-1] + 0.25)
        z = np.array([CENTRE[2] - THICK, CENTRE[2] + THICK])
        height = np.array([*_LEVELS, 7.5, TOP])
        position = np.stack(np.broadcast_arrays(x, height[:, None], z[None, :]), axis=2)
        parts.append(_sheet(position, np.array([end, 0.0, 0.0])))
    wall = Mesh.merge(parts)
    place = wall.position.astype(np.float64)
    across = np.where(np.abs(wall.normal[:, 0]) > 0.5, place[:, 2], place[:, 0])
    uv = np.stack([across, place[:, 1] - GROUND], axis=1) / tile
    return Mesh.build(wall.position, wall.index, normal=wall.normal, uv=uv, color=_weathered(place, seed))


def dressings(seed: int) -> Mesh:
    """All that is of stone: pillars, window frames, plinth and cornice; uv in metres."""
    wall = Path((PILLARS[-1] + 0.25, THICK), (CENTRE[0], CENTRE[2]), radius=0.03, arcs=1, pieces=40)
    cornice = [
        (0.0, TOP - 0.12), (0.06, TOP - 0.10), (0.06, TOP + 0.04),
        *curve((0.08, TOP + 0.06), (0.30, TOP + 0.30), -0.18, 4),
        (0.36, TOP + 0.30), (0.36, TOP + 0.40), *curve((0.36, TOP + 0.40), (0.44, TOP + 0.54), 0.2, 3),
        (0.40, TOP + 0.58), (-0.10, TOP + 0.72), (-THICK, TOP + 0.76),
    ]  # fmt: skip
    plinth = [
        (0.12, GROUND - 0.05),
        (0.12, GROUND + 0.50),
        *curve((0.12, GROUND + 0.50), (0.0, GROUND + 0.62), -0.2, 3),
    ]
    parts = [_turned(swept(cornice, wall), 0.6), _turned(swept(plinth, wall, offset=0.3), 0.6)]
    parts += [_pillar(x, number) for number, x in enumerate(PILLARS)]
    for left, right in pairwise(PILLARS):
        parts += _frame((left + right) / 2)
    stone = Mesh.merge(parts)
    place = stone.position.astype(np.float64)
    color = _stained(place, stone.normal.astype(np.float64), seed)
    return Mesh.build(stone.position, stone.index, normal=stone.normal, uv=stone.uv, color=color)


def _pillar(x: float, number: int) -> Mesh:
    """A square pillar with base, necking and capital, and a ball on top."""
    base, cap, ball = GROUND, 9.55, 10.62
    shaft = [
        (0.72, base - 0.05), (0.72, base + 0.42), *curve((0.72, base + 0.42), (0.66, base + 0.50), 0.2, 2),
        *curve((0.66, base + 0.50), (0.66, base + 0.66), 0.4, 5), (0.60, base + 0.66), (0.60, base + 0.70),
        *curve((0.60, base + 0.70), (0.52, base + 0.84), -0.2, 4),
        *[(0.52 - 0.02 * share, base + 0.84 + 6.76 * share) for share in (0.1, 0.3, 0.5, 0.7, 0.9)],
        *curve((0.50, 8.60), (0.54, 8.72), -0.2, 3),
        *curve((0.54, 8.74), (0.54, 8.84), 0.4, 4), (0.51, 8.86), (0.51, 9.16),
        *curve((0.52, 9.18), (0.72, 9.42), -0.2, 5), (0.78, 9.42),
        (0.78, cap), *curve((0.78, cap), (0.86, 9.72), 0.2, 3),
        (0.86, 9.80), (0.20, 9.98), (0.0, 9.98),
    ]  # fmt: skip
    square = Path((0.0, 0.0), (x, CENTRE[2]), radius=0.03, arcs=2, pieces=1)
    turned = Path((0.0, 0.0), (x, CENTRE[2]), radius=np.inf, arcs=4)
    angle = np.linspace(-0.42 * np.pi, np.pi / 2, 11)
    foot = [(0.34, 9.90), (0.34, 10.04), *curve((0.30, 10.06), (0.14, 10.24), -0.2, 4)]
    globe = [(float(0.38 * np.cos(a)), float(ball + 0.38 * np.sin(a))) for a in angle]
    offset = 0.23 * number
    return Mesh.merge([swept(shaft, square, offset=offset), swept(foot, turned), swept(globe, turned, offset=offset)])


def _outline(radius: float) -> Array:
    """A window's edge from the left of its sill over the arch to the right, (n, 2) of x from its middle, and y."""
    turn = np.linspace(np.pi, 0, 2 * ARC + 1)
    arch = np.stack([radius * np.cos(turn), SPRING + radius * np.sin(turn)], axis=1)
    jamb = np.linspace(SILL, SPRING, 5)[:-1]
    left = np.stack([np.full(4, -radius), jamb], axis=1)
    return np.concatenate([left, arch, left[::-1] * [-1.0, 1.0]])


def _bay(left: float, right: float, side: float) -> list[Mesh]:
    """One face of the wall from pillar to pillar, round its window."""
    middle, z = (left + right) / 2, CENTRE[2] + side * THICK
    normal = np.array([0.0, 0.0, side])
    jambs = [(left, middle - WIDE), (middle + WIDE, right)]
    heights = np.array([*_LEVELS, SPRING + WIDE, 8.0, TOP])
    sheets = [_upright(np.linspace(a, b, 3), heights, z) for a, b in jambs]
    sheets.append(_upright(np.linspace(middle - WIDE, middle + WIDE, 5), np.array(_LEVELS[:4]), z))
    arch = _outline(WIDE)[4:-4]
    share = np.linspace(0, 1, 5)[:, None]
    high = arch[:, 1] + (TOP - arch[:, 1]) * share
    sheets.append(np.stack(np.broadcast_arrays(middle + arch[:, 0], high, z), axis=2))
    return [_sheet(sheet, normal) for sheet in sheets]


def _frame(middle: float) -> list[Mesh]:
    """The stone round one window: its reveal, a moulded band on both faces, and the sill."""
    inner, outer = _outline(WIDE), _outline(WIDE + TRIM)
    towards = np.gradient(inner, axis=0)
    inwards = np.stack([towards[:, 1], -towards[:, 0]], axis=1)
    depth = np.array([-THICK - PROUD, 0.0, THICK + PROUD])
    reveal = np.stack(
        np.broadcast_arrays(middle + inner[:, :1], inner[:, 1:], CENTRE[2] + depth[None, :]),
        axis=2,
    )
    normal = np.concatenate([inwards, np.zeros((len(inner), 1))], axis=1)
    course = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(inner, axis=0).T))])
    parts = [_sheet(reveal, np.repeat(normal[:, None], 3, axis=1))]
    for side in (1.0, -1.0):
        near, far = CENTRE[2] + side * (THICK + PROUD), CENTRE[2] + side * (THICK - 0.05)
        lines = [
            (inner, near),
            (outer - 0.06 * (outer - inner) / TRIM, near),
            (outer, near - 0.06 * side),
            (outer, far),
        ]
        rows = [np.stack(np.broadcast_arrays(middle + p[:, 0], p[:, 1], z), axis=1) for p, z in lines]
        front = np.array([0.0, 0.0, side])
        slant = -normal / np.linalg.norm(normal, axis=1, keepdims=True)
        for row, facet in ((0, front + 0 * slant), (1, front + slant), (2, slant)):
            band = _sheet(np.stack(rows[row : row + 2]), np.broadcast_to(facet, (2, *facet.shape)), course)
            parts.append(_turned(band, 1.0))
    sill = [
        (0.0, SILL - 0.24),
        (0.10, SILL - 0.22),
        (0.10, SILL - 0.03),
        *curve((0.10, SILL - 0.03), (0.07, SILL), 0.2, 2),
    ]
    ledge = Path((WIDE + TRIM + 0.06, THICK + PROUD), (middle, CENTRE[2]), radius=0.02, arcs=1, pieces=4)
    return [*parts, _turned(swept([*sill, (-THICK - PROUD, SILL + 0.03)], ledge), 0.6)]


def _upright(x: Array, y: Array, z: float) -> Array:
    return np.stack(np.broadcast_arrays(x[None, :], y[:, None], z), axis=2)


def _sheet(position: Array, normal: Array, course: Array | None = None) -> Mesh:
    """A grid of points (m, n, 3) as a mesh; uv in metres along its first row (or ``course``) and first column."""
    deep, wide = position.shape[:2]
    number = np.arange(deep * wide).reshape(deep, wide)
    index = quads(number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    along = [np.linalg.norm(np.diff(position, axis=axis), axis=2) for axis in (1, 0)]
    first = np.concatenate([[0.0], np.cumsum(along[0][0])]) if course is None else course
    u = first[None, :] + np.zeros((deep, 1))
    v = np.concatenate([[0.0], np.cumsum(along[1][:, 0])])[:, None] + np.zeros((1, wide))
    facet = np.broadcast_to(normal, position.shape).reshape(-1, 3)
    return facing(position.reshape(-1, 3), index, facet, np.stack([u, v], axis=2).reshape(-1, 2))


def _turned(mesh: Mesh, scale: float) -> Mesh:
    """The mesh with its texture turned, so that the joints run across it, ``1 / scale`` times as far apart."""
    return Mesh.build(mesh.position, mesh.index, normal=mesh.normal, uv=mesh.uv[:, ::-1] * scale, color=mesh.color)


def _weathered(place: Array, seed: int) -> Array:
    """Bricks darker and greener towards the ground, streaked under the cornice and below the sills."""
    rough = point_fbm(place, 2.6, seed, octaves=4)
    streak = point_noise(place * [1.0, 0.08, 1.0], 0.7, seed + 5)
    damp = np.clip(1 - (place[:, 1] - GROUND) / (1.4 + 0.8 * rough), 0, 1)
    under = np.clip(1 - (TOP - place[:, 1]) / (1.6 + 1.0 * streak), 0, 1)
    color = np.ones((len(place), 3)) * (1.0 + 0.13 * rough)[:, None]
    color *= 1 - damp[:, None] * np.array([0.42, 0.32, 0.40])
    return color * (1 - 0.30 * under)[:, None]


def _stained(place: Array, normal: Array, seed: int) -> Array:
    """Limestone: warm, greyer where rain lies, darker at the foot."""
    rough = point_fbm(place, 1.7, seed + 9, octaves=4)
    wet = np.clip(normal[:, 1], 0, 1) * 0.30 + np.clip(1 - (place[:, 1] - GROUND) / 0.9, 0, 1) * 0.30
    under = np.clip(-normal[:, 1], 0, 1) * 0.35
    color = _STONE * (1 + 0.13 * rough)[:, None]
    grey = color.mean(axis=1, keepdims=True) * np.array([0.96, 1.0, 0.94])
    color = color + (grey - color) * np.clip(0.35 + 0.8 * rough, 0, 1)[:, None]
    return np.asarray(color * (1 - np.clip(wet + under + 0.10 * rough, 0, 0.6))[:, None])
