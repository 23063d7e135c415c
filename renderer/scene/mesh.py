"""Triangles with their vertex data, in metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.errors import SceneError

Floats = NDArray[np.float32]

VERTEX = np.dtype(
    [("position", "3f4"), ("normal", "3f4"), ("uv", "2f4"), ("color", "4f2")],
)
"""How a vertex lies in a buffer: 40 bytes."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Indexed triangles.

    ``position`` (n, 3) metres; ``normal`` (n, 3) unit; ``uv`` (n, 2); ``color`` (n, 4): a linear
    factor on the albedo, and in alpha the sway weight (0 rigid, 1 moves fully with the wind);
    ``index`` (m, 3), counter-clockwise seen from outside.
    """

    position: Floats
    normal: Floats
    uv: Floats
    color: Floats
    index: NDArray[np.uint32]

    def __post_init__(self) -> None:
        count = len(self.position)
        shapes = {"position": 3, "normal": 3, "uv": 2, "color": 4}
        for name, width in shapes.items():
            array = np.ascontiguousarray(getattr(self, name), np.float32)
            if array.shape != (count, width):
                raise SceneError(f"mesh {name} is {array.shape}, expected {(count, width)}")
            object.__setattr__(self, name, array)
        index = np.ascontiguousarray(self.index, np.uint32).reshape(-1, 3)
        if index.size and int(index.max()) >= count:
            raise SceneError(f"mesh index {int(index.max())} is past its {count} vertices")
        object.__setattr__(self, "index", index)

    @classmethod
    def build(
        cls,
        position: NDArray[np.floating],
        index: NDArray[np.integer],
        *,
        normal: NDArray[np.floating] | None = None,
        uv: NDArray[np.floating] | None = None,
        color: NDArray[np.floating] | None = None,
    ) -> Mesh:
        """Make a mesh; what is left out gets smooth normals, zero uv and a neutral, rigid colour."""
        count = len(position)
        triangles = np.asarray(index, np.uint32).reshape(-1, 3)
        if color is not None and color.shape[1] == 3:
            color = np.concatenate([color, np.zeros((count, 1), np.float32)], axis=1)
        return cls(
            position=np.asarray(position, np.float32),
            normal=smooth_normals(position, triangles) if normal is None else np.asarray(normal, np.float32),
            uv=np.zeros((count, 2), np.float32) if uv is None else np.asarray(uv, np.float32),
            color=np.tile(np.array([1, 1, 1, 0], np.float32), (count, 1))
            if color is None
            else np.asarray(color, np.float32),
            index=triangles,
        )

    @classmethod
    def merge(cls, meshes: Sequence[Mesh]) -> Mesh:
        """Join meshes into one; an empty sequence gives an empty mesh."""
        if not meshes:
            empty = np.zeros((0, 3), np.float32)
            return cls.build(empty, np.zeros((0, 3), np.uint32), normal=empty)
        starts = np.cumsum([0] + [len(mesh.position) for mesh in meshes[:-1]])
        return cls(
            position=np.concatenate([mesh.position for mesh in meshes]),
            normal=np.concatenate([mesh.normal for mesh in meshes]),
            uv=np.concatenate([mesh.uv for mesh in meshes]),
            color=np.concatenate([mesh.color for mesh in meshes]),
            index=np.concatenate(
                [mesh.index + np.uint32(start) for mesh, start in zip(meshes, starts, strict=True)],
            ),
        )

    def transformed(self, world_from_local: NDArray[np.floating]) -> Mesh:
        """Move the mesh by a 4×4 affine matrix; normals go by the inverse transpose."""
        matrix = np.asarray(world_from_local, np.float64)
        linear = matrix[:3, :3]
        normal = self.normal @ np.linalg.inv(linear)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        index = self.index if np.linalg.det(linear) > 0 else self.index[:, ::-1]
        return Mesh(
            position=(self.position @ linear.T + matrix[:3, 3]).astype(np.float32),
            normal=normal.astype(np.float32),
            uv=self.uv,
            color=self.color,
            index=np.ascontiguousarray(index),
        )

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The lowest and the highest corner of the box round the mesh, metres."""
        if not len(self.position):
            return np.zeros(3, np.float32), np.zeros(3, np.float32)
        return self.position.min(axis=0), self.position.max(axis=0)

    def vertices(self) -> NDArray[np.void]:
        """The vertices as one interleaved array of ``VERTEX`` records."""
        records = np.empty(len(self.position), VERTEX)
        for name in VERTEX.names or ():
            records[name] = getattr(self, name)
        return records


def smooth_normals(
    position: NDArray[np.floating],
    index: NDArray[np.integer],
) -> Floats:
    """Area-weighted vertex normals; a vertex without area looks up."""
    corners = np.asarray(position, np.float64)[index]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.zeros((len(position), 3))
    for corner in range(3):
        np.add.at(normal, index[:, corner], face)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 1e-20, normal / np.maximum(length, 1e-20), [0.0, 1.0, 0.0])
    return normal.astype(np.float32)
