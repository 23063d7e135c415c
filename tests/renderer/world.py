"""A small world to test with: a bowl with a pond, and saturated boxes in telling places. No textures, few triangles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.scene.catalogue import SCENES
from renderer.scene.entry import SceneEntry
from renderer.scene.material import Material
from renderer.scene.mesh import Mesh
from renderer.scene.scene import Scene, SceneObject

NAME, STILL, COPY, EMPTY = "test", "test still", "test copy", "test empty"
"""The world; the same without wind; its copy upside down below the water; nothing but a speck out of sight."""
LEVEL = 0.25
"""Metres: not zero, so that a forgotten level shows."""
EXTENTS = (-20.0, 20.0, -20.0, 20.0)
DRY = [900.0, 901.0, 900.0, 901.0]
"""Extents that lie out of every picture: the scene without its water."""
RED, GREEN, BLUE, YELLOW = (0.7, 0.02, 0.02), (0.02, 0.7, 0.02), (0.03, 0.05, 0.6), (0.7, 0.6, 0.05)
Vector = Sequence[float]
MATTE = Material("matte")


def box(low: Vector, high: Vector, color: Vector, *, sway: float = 0.0) -> Mesh:
    """A box with flat faces that look outwards."""
    corners = np.array([low, high], np.float64)
    position: list[NDArray[np.float64]] = []
    normal: list[NDArray[np.float64]] = []
    index: list[NDArray[np.int64]] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            face = np.empty((4, 3))
            face[:, axis] = corners[side, axis]
            face[:, u] = corners[[0, 1, 1, 0], u]
            face[:, v] = corners[[0, 0, 1, 1], v]
            turn = [[0, 1, 2], [0, 2, 3]] if side else [[0, 2, 1], [0, 3, 2]]
            index.append(np.array(turn) + 4 * len(position))
            position.append(face)
            normal.append(np.tile(np.eye(3)[axis] * (1 if side else -1), (4, 1)))
    colors = np.tile([*color, sway], (24, 1))
    return Mesh.build(np.concatenate(position), np.concatenate(index), normal=np.concatenate(normal), color=colors)


def bowl(cells: int = 24, half: float = 20.0) -> Mesh:
    """Ground that falls from 3 m to 2 m under water in the middle."""
    line = np.linspace(-half, half, cells + 1)
    x, z = np.meshgrid(line, line)
    y = np.clip((np.hypot(x / 12.0, z / 9.0) - 1.0) * 2.5, -2.0, 3.0) + 0.15 * np.sin(1.3 * x) * np.cos(1.1 * z)
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    index = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    position = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    color = np.where(position[:, 1:2] > LEVEL, [[0.10, 0.16, 0.05]], [[0.30, 0.24, 0.15]])
    return Mesh.build(position, index, color=color)


def objects(sway: float = 1.0) -> tuple[SceneObject, ...]:
    """What stands in the world: a red post half in the water, a green box under it, others beside and behind."""
    return (
        SceneObject("ground", bowl(), MATTE, frozenset({"terrain"})),
        SceneObject("post", box([-0.6, -2.5, -0.6], [0.6, 3.0, 0.6], RED), MATTE),
        SceneObject("drowned", box([2.0, -1.6, 1.0], [4.0, -0.5, 3.0], GREEN), MATTE),
        SceneObject("boat", box([-5.0, -0.2, -2.0], [-2.5, 1.0, -0.5], YELLOW), MATTE),
        SceneObject("hut", box([3.5, 0.0, -12.0], [8.0, 5.0, -9.5], BLUE), MATTE),
        SceneObject("reed", box([-3.0, -1.0, 2.0], [-2.8, 1.6, 2.2], (0.3, 0.45, 0.1), sway=sway), MATTE),
    )


OWN: Mapping[str, Any] = {
    "camera": {"eye": [7.0, 3.2, 9.0], "target": [0.0, 0.3, 0.0], "fov_y": 45.0},
    "sun": {"azimuth": 120.0, "elevation": 40.0, "color": [1.0, 0.95, 0.85], "intensity": 1.0},
    "ambient": [0.30, 0.32, 0.36],
    "sky": {"model": "gradient", "horizon": [0.7, 0.75, 0.8], "zenith": [0.15, 0.35, 0.7]},
}


def entry_of(name: str, parts: tuple[SceneObject, ...]) -> SceneEntry:
    """A card of the catalogue for these objects."""
    return SceneEntry(
        name=name,
        title="Test",
        summary="A bowl, boxes and water.",
        water_level=LEVEL,
        water_extents=EXTENTS,
        centre=(0.0, LEVEL, 0.0),
        own=OWN,
        load=lambda: Scene(name, parts),
    )


def cut_above(mesh: Mesh, level: float) -> Mesh:
    """What of a mesh lies above the plane, triangles cut exactly at it (Sutherland & Hodgman 1974, one plane)."""
    position: list[NDArray[np.float64]] = []
    normal: list[NDArray[np.float64]] = []
    color: list[NDArray[np.float64]] = []
    for corners in mesh.index:
        vertices = np.concatenate([mesh.position[corners], mesh.normal[corners], mesh.color[corners]], axis=1)
        kept: list[NDArray[np.float64]] = []
        for a, b in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
            over_a, over_b = float(a[1]) - level, float(b[1]) - level
            if over_a >= 0:
                kept.append(a)
            if (over_a >= 0) != (over_b >= 0):
                kept.append(a + (b - a) * (over_a / (over_a - over_b)))
        for i in range(1, len(kept) - 1):
            triangle = np.array([kept[0], kept[i], kept[i + 1]])
            position.append(triangle[:, :3])
            normal.append(triangle[:, 3:6])
            color.append(triangle[:, 6:])
    index = np.arange(3 * len(position)).reshape(-1, 3)
    return Mesh.build(np.concatenate(position), index, normal=np.concatenate(normal), color=np.concatenate(color))


def mirrored_copies(level: float) -> tuple[SceneObject, ...]:
    """The world above the water, built a second time upside down below it: a reflection without mirror or clip."""
    flip = np.diag([1.0, -1.0, 1.0, 1.0])
    flip[1, 3] = 2 * level
    return tuple(
        replace(part, name=f"{part.name} mirrored", mesh=cut_above(part.mesh, level).transformed(flip))
        for part in objects(sway=0.0)
        if part.mesh.position[:, 1].max() > level
    )


@contextmanager
def registered() -> Iterator[None]:
    """The worlds of this module stand in the catalogue for a while."""
    speck = SceneObject("speck", box([800, 0, 800], [801, 1, 801], RED), MATTE)
    scenes = {NAME: objects(), STILL: objects(sway=0.0), COPY: mirrored_copies(LEVEL), EMPTY: (speck,)}
    SCENES.update({name: entry_of(name, parts) for name, parts in scenes.items()})
    try:
        yield
    finally:
        for name in scenes:
            del SCENES[name]
