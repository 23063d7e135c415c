"""Mouldings: a profile carried round a rectangle, as a mason cuts a plinth, a rim, a pillar or a ball."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene.mesh import Mesh

Array = NDArray[np.float64]

CREASE = np.cos(np.radians(40.0))
"""Cosine of the angle past which two pieces of a profile meet in an edge."""


@dataclass(frozen=True)
class Path:
    """The rectangle that a profile goes round; at an offset it is that much wider on each side."""

    half: tuple[float, float]
    """Half extents along x and z, metres."""
    centre: tuple[float, float] = (0.0, 0.0)
    """(x, z), metres."""
    radius: float = 0.04
    """Radius of its corners, metres; a radius without end makes it round."""
    arcs: int = 3
    """Pieces of half a corner."""
    pieces: int = 1
    """Pieces of the straight part of a side."""


def curve(
    start: tuple[float, float], end: tuple[float, float], bulge: float, count: int = 5
) -> list[tuple[float, float]]:
    """Points from start to end, both included, on an arc that bulges to the right by a share of the chord."""
    a, b = np.array(start), np.array(end)
    t = np.linspace(0, 1, count + 1)[:, None]
    right = np.array([b[1] - a[1], a[0] - b[0]])
    points = a + (b - a) * t + right * bulge * 4 * t * (1 - t)
    return [(float(x), float(y)) for x, y in points]


def swept(profile: Sequence[tuple[float, float]], path: Path, *, tile: float = 1.0, offset: float = 0.0) -> Mesh:
    """A profile of (offset outwards, height) carried round a path; it looks to the right of where it runs.

    uv runs along the side and along the profile in units of ``tile`` metres; each side starts at another place of the
    texture, as slabs that meet at a mitre do. ``offset`` moves all of them.
    """
    line = np.array([point for point, after in zip(profile, [*profile[1:], None], strict=True) if point != after])
    step = np.diff(line, axis=0)
    length = np.hypot(*step.T)
    line_normal = np.stack([step[:, 1], -step[:, 0]], axis=1) / np.maximum(length, 1e-9)[:, None]
    start_normal, end_normal = line_normal.copy(), line_normal.copy()
    joined = line_normal[:-1] + line_normal[1:]
    is_smooth = (line_normal[:-1] * line_normal[1:]).sum(axis=1) > CREASE
    joined /= np.maximum(np.linalg.norm(joined, axis=1, keepdims=True), 1e-9)
    end_normal[:-1][is_smooth] = joined[is_smooth]
    start_normal[1:][is_smooth] = joined[is_smooth]
    along = np.concatenate([[0.0], np.cumsum(length)])
    rows = np.stack([np.arange(len(step)), np.arange(len(step)) + 1], axis=1).reshape(-1)
    normal = np.stack([start_normal, end_normal], axis=1).reshape(-1, 2)
    sides = []
    for number in range(4):
        place, outwards, u = _side(line[rows, 0], path, number)
        position = np.stack([place[..., 0], np.broadcast_to(line[rows, 1, None], u.shape), place[..., 1]], axis=2)
        direction = np.concatenate(
            [
                normal[:, None, :1] * outwards[..., :1],
                np.broadcast_to(normal[:, None, 1:], (*u.shape, 1)),
                normal[:, None, :1] * outwards[..., 1:],
            ],
            axis=2,
        )
        uv = np.stack([u / tile + offset + 0.37 * number, np.broadcast_to(along[rows, None] / tile, u.shape)], axis=2)
        uv[..., 1] += offset * 1.7
        wide = u.shape[1]
        first = 2 * np.arange(len(step))[:, None] * wide + np.arange(wide - 1)[None, :]
        index = quads(first, first + 1, first + wide + 1, first + wide)
        flat = position.reshape(-1, 3)
        sides.append(facing(flat, index, direction.reshape(-1, 3), uv.reshape(-1, 2)))
    return Mesh.merge(sides)


def quads(
    a: NDArray[np.integer], b: NDArray[np.integer], c: NDArray[np.integer], d: NDArray[np.integer]
) -> NDArray[np.int64]:
    """Two triangles for each quadrangle of corner numbers, (2n, 3)."""
    corners = np.stack([a, b, c, d], axis=-1).reshape(-1, 4).astype(np.int64)
    return np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def facing(position: Array, index: NDArray[np.integer], normal: Array, uv: Array) -> Mesh:
    """A mesh whose triangles turn as their normals say; those without area are left out."""
    corner = position[index]
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    is_solid = np.linalg.norm(flat, axis=1) > 1e-9
    towards = (flat * normal[index].sum(axis=1)).sum(axis=1)
    turned = np.where((towards < 0)[:, None], index[:, ::-1], index)
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    return Mesh.build(position, turned[is_solid], normal=unit, uv=uv)


def _side(offsets: Array, path: Path, number: int) -> tuple[Array, Array, Array]:
    """A side from the middle of one corner to the middle of the next: places, outward directions, metres along."""
    half = np.array(path.half if number % 2 == 0 else path.half[::-1])
    wide = half[None, :] + offsets[:, None]
    radius = np.clip(np.minimum(path.radius, wide.min(axis=1)), 0, None)
    turn = np.linspace(0, np.pi / 4, path.arcs + 1)
    bend = np.stack([np.sin(turn), np.cos(turn)], axis=1)
    core = wide - radius[:, None]
    right = core[:, None, :] + radius[:, None, None] * bend
    left = right[:, ::-1] * np.array([-1.0, 1.0])
    inner = np.linspace(-1, 1, path.pieces + 1)[1:-1]
    straight = np.stack(np.broadcast_arrays(core[:, :1] * inner, wide[:, 1:]), axis=2)
    place = np.concatenate([left, straight, right], axis=1)
    directions = [bend[::-1] * [-1.0, 1.0], np.tile([0.0, 1.0], (len(inner), 1)), bend]
    outwards = np.broadcast_to(np.concatenate(directions), place.shape)
    along = np.concatenate([left[..., 0], straight[..., 0], right[..., 0]], axis=1)
    cos, sin = ((1, 0), (0, 1), (-1, 0), (0, -1))[number]
    spin = np.array([[cos, sin], [-sin, cos]], float)
    return np.array(path.centre) + place @ spin, outwards @ spin, along
