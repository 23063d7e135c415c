"""The marble bath: a square basin with a moulded foot and rim, a bench under water and an inlaid floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.scene.mesh import Mesh
from renderer.scene.mouldings import Path, curve, facing, swept
from renderer.scene.noise import point_fbm

Array = NDArray[np.float64]

HALF = 3.3
"""Half the side of the water, metres: the rectangle between the bath's inner faces."""
FOOT, RIM, FLOOR, BENCH = 1.0, 3.0, 1.14, 1.95
"""Heights of the ground, the rim, the floor and the bench, metres."""
BENCH_WIDTH = 0.55
FLOOR_HALF = HALF - BENCH_WIDTH - 0.13
"""Half the side of the inlaid floor."""
CORNER = 0.10
"""Radius of the corners, inside and outside, metres."""
TILE = 6.0
"""Side of the marble texture's tile, metres."""
WATERLINE = 2.75

OUTSIDE = (
    (0.80, FOOT - 0.05),
    *curve((0.80, FOOT + 0.24), (0.74, FOOT + 0.30), 0.2, 3),
    *curve((0.72, FOOT + 0.30), (0.68, FOOT + 0.44), 0.40, 7),
    *curve((0.66, FOOT + 0.46), (0.48, FOOT + 0.74), -0.20, 8),
    *curve((0.45, 2.44), (0.62, 2.66), -0.2, 8),
    (0.62, 2.72),
)
"""The outer face from the ground to under the rim: plinth, torus, hollow, wall, hollow; (offset, height), metres."""
RIM_EDGE = (
    (0.62, 2.72),
    (0.69, 2.72),
    (0.72, 2.75),
    *curve((0.72, 2.86), (0.58, RIM), 0.2, 5),
    *curve((0.10, RIM), (0.0, RIM - 0.10), 0.2, 4),
)
"""The rim, whose top is rounded on both sides."""
INSIDE = (
    (0.0, RIM - 0.10),
    (0.0, WATERLINE + 0.07),
    (0.0, WATERLINE - 0.05),
    (0.0, BENCH + 0.08),
    *curve((0.0, BENCH + 0.08), (-0.08, BENCH), -0.2, 3),
    *curve((0.03 - BENCH_WIDTH, BENCH), (-BENCH_WIDTH, BENCH - 0.03), 0.2, 3),
    *curve((-BENCH_WIDTH, FLOOR + 0.13), (FLOOR_HALF - HALF, FLOOR), -0.2, 4),
)
"""The inner face down to the floor: wall, bench, riser, cove."""


def bath(seed: int) -> Mesh:
    """The bath without its floor, as one mesh; uv in tiles of the marble."""
    path = Path((HALF, HALF), radius=CORNER, pieces=14)
    parts = [
        swept(profile, path, tile=TILE, offset=offset)
        for profile, offset in ((OUTSIDE, 0.0), (RIM_EDGE, 0.43), (INSIDE, 0.71))
    ]
    whole = Mesh.merge(parts)
    return _tinted(whole, seed)


def floor(seed: int) -> Mesh:
    """The bath's floor; uv runs once over it."""
    line = np.linspace(-1, 1, 9)
    x, z = np.meshgrid(line, line)
    position = np.stack([x * FLOOR_HALF, np.full_like(x, FLOOR), z * FLOOR_HALF], axis=2).reshape(-1, 3)
    number = np.arange(81).reshape(9, 9)
    corners = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    index = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    uv = np.stack([x, z], axis=2).reshape(-1, 2) / 2 + 0.5
    return _tinted(facing(position, index, np.tile([0.0, 1.0, 0.0], (81, 1)), uv), seed)


def _tinted(mesh: Mesh, seed: int) -> Mesh:
    """Dust at the foot, a line where the water stands, and a green cast where it always covers the stone."""
    position = mesh.position.astype(np.float64)
    height = position[:, 1]
    reach = np.abs(position[:, [0, 2]]).max(axis=1)
    is_inner = reach < HALF + 0.03
    rough = point_fbm(position, 1.3, seed, octaves=3)
    dust = np.clip(1 - (height - FOOT) / 0.5, 0, 1) ** 2 * ~is_inner
    covered = np.clip((WATERLINE + 0.02 - height) / 0.05, 0, 1) * is_inner
    color = np.ones((len(position), 3)) * (1 + 0.035 * rough)[:, None]
    color *= 1 - dust[:, None] * np.array([0.34, 0.38, 0.46]) * (0.8 + 0.4 * rough)[:, None]
    deep = np.clip((WATERLINE - height) / 1.6, 0, 1) * is_inner
    color *= 1 - covered[:, None] * np.array([0.10, 0.05, 0.05])
    color *= 1 - deep[:, None] * np.array([0.24, 0.06, 0.04])
    return Mesh.build(mesh.position, mesh.index, normal=mesh.normal, uv=mesh.uv, color=np.clip(color, 0, 1.2))
