"""Many blades, petals and spikes at once, as bare triangles.

A blade is a ribbon that bends in one vertical plane and ends in a point: solid geometry needs no alpha
test, costs few pixels and gets its edges from multisampling. All arrays have one row for a blade.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderer.scene import leaves
from renderer.scene.mesh import Mesh
from renderer.scene.plant_drawing import strip

Array = NDArray[np.float64]

STEPS = 12
"""Pieces in which a blade's bend is summed up where something hangs on it."""


@dataclass(frozen=True, eq=False)
class Blades:
    """What makes n blades. Lengths in metres, angles in radians."""

    root: Array
    """(n, 3) where each starts."""
    azimuth: Array
    """(n,) the direction in which it bends: 0 is +x, π/2 is +z."""
    tilt: Array
    """(n, 2) from the vertical, at the root and at the tip; over π/2 hangs down."""
    length: Array
    width: Array
    """(n,) where the profile is 1."""
    tint: Array
    """(n, 3) factor on the colour."""
    twist: Array | float = 0.0
    """Turns the flat side about the vertical away from the bend."""

    def wide(self, width: float) -> Blades:
        """The blades with their widths times ``width``."""
        return replace(self, width=self.width * width)

    def along(self, share: Array, chosen: NDArray[np.integer] | None = None) -> Array:
        """Points (n, k, 3) at ``share`` (n, k) of the lengths of all, or of the chosen, blades."""
        pick = slice(None) if chosen is None else chosen
        azimuth, tilt, length = self.azimuth[pick], self.tilt[pick], self.length[pick]
        u = (np.arange(STEPS) + 0.5) / STEPS
        angle = tilt[:, :1] + (tilt[:, 1:] - tilt[:, :1]) * u
        start = np.zeros((len(length), 1))
        out, up = (np.concatenate([start, np.cumsum(part(angle), axis=1) / STEPS], axis=1) for part in (np.sin, np.cos))
        place = np.clip(share, 0, 1) * STEPS
        low = np.minimum(place.astype(np.int64), STEPS - 1)
        row = np.arange(len(length))[:, None]
        away, high = (part[row, low] + (part[row, low + 1] - part[row, low]) * (place - low) for part in (out, up))
        local = np.stack([away * np.cos(azimuth)[:, None], high, away * np.sin(azimuth)[:, None]], axis=-1)
        return np.asarray(self.root[pick][:, None] + local * length[:, None, None])


def ribbons(
    blades: Blades,
    *,
    paint: str,
    profile: Sequence[float] = (1.0, 0.8),
    gradient: tuple[float, float] = (0.6, 1.1),
    lift: float = 0.6,
    sway: float = 1.0,
) -> Mesh:
    """Draw blades as ribbons that end in a point.

    ``paint`` names a strip; ``profile`` gives the relative width at each node before the tip;
    ``gradient`` the shade at root and tip; ``lift`` how much the soft normal looks up (0 the flat
    side's own); ``sway`` the weight at one metre over the root, growing with the height's square.
    """
    nodes = len(profile)
    count = len(blades.root)
    u = np.linspace(0, 1, nodes + 1)
    middle = (u[:-1] + u[1:]) / 2
    tilt = blades.tilt[:, :1] + (blades.tilt[:, 1:] - blades.tilt[:, :1]) * middle
    cos, sin = np.cos(blades.azimuth)[:, None], np.sin(blades.azimuth)[:, None]
    ahead = np.stack([np.sin(tilt) * cos, np.cos(tilt), np.sin(tilt) * sin], axis=-1)
    spine = np.cumsum(ahead, axis=1) * (blades.length / nodes)[:, None, None]
    spine = np.concatenate([np.zeros((count, 1, 3)), spine], axis=1)
    turned = blades.azimuth + blades.twist
    flat = np.stack([-np.sin(turned), np.zeros(count), np.cos(turned)], axis=-1)[:, None]
    offset = flat * blades.width[:, None, None] * (np.array(profile) / 2)[:, None]
    body = spine[:, :-1]
    local = np.stack([body - offset, body + offset], axis=2).reshape(count, 2 * nodes, 3)
    local = np.concatenate([local, spine[:, -1:]], axis=1)
    normal = _soft_normals(ahead, flat, lift)
    along = np.append(np.repeat(u[:-1], 2), 1.0)
    mid, half = strip(paint)
    across = mid + half * np.append(np.tile([-1.0, 1.0], nodes), 0.0)
    uv = np.broadcast_to(leaves.at("strips", np.stack([across, along], axis=-1)), (count, 2 * nodes + 1, 2))
    shade = gradient[0] + (gradient[1] - gradient[0]) * along
    height = np.maximum(local[..., 1:2], 0)
    color = np.concatenate([blades.tint[:, None] * shade[:, None], np.minimum(sway * height**2, 1)], axis=2)
    steps = 2 * np.arange(nodes - 1)[:, None]
    quads = (steps + np.array([0, 2, 1, 1, 2, 3])).reshape(-1, 3)
    last = 2 * nodes
    triangles = np.concatenate([quads, [[last - 2, last, last - 1]]])
    return _joined(local + blades.root[:, None], normal, uv, color, triangles)


def spindles(root: Array, axis: Array, radius: Array, tint: Array, *, paint: str, sway: Array, sides: int = 5) -> Mesh:
    """Closed spikes from ``root`` (n, 3) along ``axis`` (n, 3) metres, rounded at both ends."""
    count = len(root)
    turn = np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(turn), np.zeros(sides), np.sin(turn)], axis=-1)
    out = np.broadcast_to(ring, (count, sides, 3))
    levels = [root[:, None] + axis[:, None] * t + out * radius[:, None, None] for t in (0.06, 0.94)]
    ends = [(root + axis * t)[:, None] for t in (0.0, 1.0)]
    position = np.concatenate([*levels, *ends], axis=1)
    up = np.broadcast_to([0.0, 1.0, 0.0], (count, 1, 3))
    normal = np.concatenate([out, out, -up, up], axis=1)
    mid, half = strip(paint)
    s = np.concatenate([np.tile(mid + half * np.cos(turn), 2), [mid, mid]])
    t = np.concatenate([np.zeros(sides), np.ones(sides), [0, 1]])
    uv = np.broadcast_to(leaves.at("strips", np.stack([s, t], axis=-1)), (count, 2 * sides + 2, 2))
    rgb = np.broadcast_to(tint[:, None], position.shape)
    weight = np.broadcast_to(sway[:, None, None], (count, 2 * sides + 2, 1))
    k = np.arange(sides)
    n = (k + 1) % sides
    triangles = np.concatenate(
        [
            np.stack([k, k + sides, n], axis=1),
            np.stack([n, k + sides, n + sides], axis=1),
            np.stack([k, n, np.full(sides, 2 * sides)], axis=1),
            np.stack([k + sides, np.full(sides, 2 * sides + 1), n + sides], axis=1),
        ],
    )
    return _joined(position, normal, uv, np.concatenate([rgb, weight], axis=2), triangles)


def swaying(mesh: Mesh, places: Array, weight: float) -> Mesh:
    """Let what hangs on a stem move with it: the weight follows the height over the plants' mean ground."""
    ground = float(np.mean(places[:, 1])) if len(places) else 0.0
    color = mesh.color.copy()
    color[:, 3] = np.clip(weight * np.maximum(mesh.position[:, 1] - ground, 0) ** 2, 0, 1)
    return Mesh.build(mesh.position, mesh.index, normal=mesh.normal, uv=mesh.uv, color=color)


def _soft_normals(ahead: Array, flat: Array, lift: float) -> Array:
    """Normals of the ribbons' flat side, rounded across and turned upwards: (n, nodes * 2 + 1, 3)."""
    face = np.cross(flat, ahead)
    face *= np.where(face[..., 1:2] < 0, -1.0, 1.0)
    face = np.concatenate([face, face[:, -1:]], axis=1)
    sides = np.stack([face[:, :-1] - 0.4 * flat, face[:, :-1] + 0.4 * flat], axis=2)
    normal = np.concatenate([sides.reshape(len(face), 2 * ahead.shape[1], 3), face[:, -1:]], axis=1)
    normal[..., 1] += lift
    return np.asarray(normal / np.linalg.norm(normal, axis=2, keepdims=True))


def _joined(position: Array, normal: Array, uv: Array, color: Array, triangles: NDArray[np.int64]) -> Mesh:
    count, corners = position.shape[:2]
    index = (np.arange(count) * corners)[:, None, None] + triangles
    return Mesh.build(
        position.reshape(-1, 3),
        index.reshape(-1, 3),
        normal=normal.reshape(-1, 3),
        uv=uv.reshape(-1, 2),
        color=color.reshape(-1, 4),
    )
