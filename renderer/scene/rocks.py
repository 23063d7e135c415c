"""Boulders and stones: spheres cut by planes, worn round, mossy above and dark where the water licks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from renderer.scene.mesh import Mesh, smooth_normals
from renderer.scene.noise import point_fbm, point_noise, scattered

Array = NDArray[np.float64]
HeightAt = Callable[[Array, Array], Array]

TILE = 1.7
"""Side of the rock texture's tile, metres."""

_STONE = np.array([[0.245, 0.225, 0.200], [0.195, 0.190, 0.182], [0.290, 0.260, 0.215], [0.225, 0.195, 0.160]])
_MOSS = np.array([0.072, 0.088, 0.026])
_LICHEN = np.array([0.33, 0.33, 0.26])
_ALGAE = np.array([0.060, 0.068, 0.026])


@dataclass(frozen=True)
class Stone:
    """One stone: where its middle stands on the ground, its half extents and how it is turned."""

    x: float
    z: float
    size: tuple[float, float, float]
    """Half extents along its own x, y, z, metres."""
    turn: float
    """Degrees about the vertical."""
    sink: float = 0.35
    """Share of its height that is in the ground."""
    top: float | None = None
    """Height of its top over the water, metres, in place of ``sink``."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What the vertices of some stones know of the world."""

    owner: NDArray[np.int64]
    """Which stone each vertex belongs to."""
    size: Array
    """Half the length of each stone, metres."""
    above: Array
    """Height of each vertex over the water, metres."""
    clear: Array
    """Height of each vertex over the ground, metres."""


def stones(placed: Sequence[Stone], seed: int, level: int, height_at: HeightAt, water_level: float = 0.0) -> Mesh:
    """The stones as one mesh; ``level`` 0, 1, 2 or 3 has 20, 80, 320 or 1280 triangles each."""
    if not placed:
        return Mesh.merge([])
    direction, faces = icosphere(level)
    count, corners = len(placed), len(direction)
    size = np.array([stone.size for stone in placed])
    spot = np.array([(stone.x, stone.z) for stone in placed])
    position = _worn(direction, count, seed, edge=18 if level > 1 else 7) * size[:, None]
    turn = np.radians([stone.turn for stone in placed])[:, None]
    x = position[..., 0] * np.cos(turn) + position[..., 2] * np.sin(turn) + spot[:, :1]
    z = position[..., 2] * np.cos(turn) - position[..., 0] * np.sin(turn) + spot[:, 1:]
    lift = height_at(spot[:, 0], spot[:, 1]) + size[:, 1] * (1 - 2 * np.array([stone.sink for stone in placed]))
    for number, stone in enumerate(placed):
        if stone.top is not None:
            lift[number] = water_level + stone.top - float(position[number, :, 1].max())
    position = np.stack([x, position[..., 1] + lift[:, None], z], axis=2).reshape(-1, 3)
    index = (np.arange(count)[:, None, None] * corners + faces).reshape(-1, 3)
    normal = smooth_normals(position, index).astype(np.float64)
    owner = np.repeat(np.arange(count), corners)
    clear = position[:, 1] - height_at(position[:, 0], position[:, 2])
    above = position[:, 1] - water_level
    color = _color(position, normal, Setting(owner, size.max(axis=1), above, clear), seed)
    return _unfolded(position, normal, color, index)


@cache
def icosphere(level: int) -> tuple[Array, NDArray[np.int64]]:
    """Unit directions (n, 3) and outward triangles (20 · 4^level, 3)."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([
        [-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0], [0, -1, golden], [0, 1, golden],
        [0, -1, -golden], [0, 1, -golden], [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1],
    ])  # fmt: skip
    faces = np.array([
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2],
        [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11],
        [6, 2, 10], [8, 6, 7], [9, 8, 1],
    ])  # fmt: skip
    for _ in range(level):
        pairs = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges, number = np.unique(pairs, axis=0, return_inverse=True)
        middle = len(corners) + number.reshape(-1, 3)
        corners = np.concatenate([corners, corners[edges].mean(axis=1)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.concatenate(
            [np.stack(part, 1) for part in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))],
        )
        corners = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    return corners / np.linalg.norm(corners, axis=1, keepdims=True), faces


def _worn(direction: Array, count: int, seed: int, edge: int) -> Array:
    """(count, n, 3) points of unit stones: balls that planes have cut; a higher ``edge`` rounds less."""
    planes = scattered(seed, count * 15, 4)
    facing = planes[:, :3] * 2 - 1
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    offset = (0.52 + 0.42 * planes[:, 3]).reshape(count, 1, 15)
    reach = np.maximum(np.einsum("nk,cpk->cnp", direction, facing.reshape(count, 15, 3)), 0) / offset
    radius = (1 + (reach**edge).sum(axis=2)) ** (-1 / edge)
    apart = (direction[None] + 17.0 * np.arange(count)[:, None, None]).reshape(-1, 3)
    lumps = 0.12 * point_noise(apart, 0.9, seed + 1) + 0.07 * point_fbm(apart, 0.4, seed + 2, octaves=3)
    worn: Array = direction[None] * (radius * (1 + lumps.reshape(count, -1)))[..., None]
    worn /= np.abs(worn).max(axis=1, keepdims=True)
    return worn


def _color(position: Array, normal: Array, setting: Setting, seed: int) -> Array:
    owner, above = setting.owner, setting.above
    pick = scattered(seed + 3, len(setting.size), 3)[owner]
    size = setting.size[owner]
    base = _STONE[(pick[:, 0] * len(_STONE)).astype(np.int64)] * (0.8 + 0.4 * pick[:, 1:2])
    blotch = point_fbm(position / (0.5 * size + 0.1)[:, None], 1.0, seed + 4, octaves=3)
    color = base * (1 + 0.22 * blotch)[:, None]
    lichen = np.clip((point_noise(position, 0.22, seed + 5) - 0.35) * 4, 0, 1) * (normal[:, 1] > -0.2)
    color = color + (_LICHEN - color) * (0.45 * lichen)[:, None]
    is_dry = np.clip((above - 0.12) / 0.18, 0, 1)
    moss = np.clip((normal[:, 1] - 0.45 + 0.45 * point_fbm(position, 0.6, seed + 6, octaves=3)) * 2.6, 0, 1)
    moss *= is_dry * np.minimum(1.0, 1.6 * size) * (0.35 + 0.65 * (pick[:, 2] > 0.3))
    color = color + (_MOSS * (1 + 0.3 * blotch)[:, None] - color) * moss[:, None]
    under = np.clip(-above / 0.25, 0, 1)
    color = color + (_ALGAE * (1 + 0.5 * blotch)[:, None] - color) * (0.72 * under)[:, None]
    edge = above + 0.05 * point_noise(position, 0.3, seed + 8)
    wet = np.clip(1 - edge / 0.11, 0, 1) * (1 - 0.45 * under)
    color *= (1 - 0.48 * wet)[:, None]
    return color * (0.5 + 0.5 * np.clip(setting.clear / (0.4 * size), 0, 1))[:, None]


def _unfolded(position: Array, normal: Array, color: Array, faces: NDArray[np.int64]) -> Mesh:
    """A mesh with each triangle projected along its own main axis, in tiles of the rock texture."""
    corners = position[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(flat).argmax(axis=1)
    key = faces * 3 + axis[:, None]
    used, index = np.unique(key, return_inverse=True)
    vertex, side = used // 3, used % 3
    place = position[vertex]
    u = np.where(side == 0, place[:, 2], place[:, 0])
    v = np.where(side == 1, place[:, 2], place[:, 1])
    return Mesh.build(
        place,
        index.reshape(-1, 3),
        normal=normal[vertex],
        uv=np.stack([u, v], axis=1),
        color=color[vertex],
    )
