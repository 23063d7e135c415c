"""What a pass looks with: matrices, clip plane and eye, as a uniform block."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.blocks import Block
from renderer.camera import Camera
from renderer.passes.shadows import Shadows
from renderer.units import Length, Mat4, Number, Vec2, Vec4

NO_CLIP = (0.0, 0.0, 0.0, 1.0)
"""A plane that keeps everything."""


Window = tuple[float, float, float, float]
"""Left, right, bottom and top of the part of an image that is wanted, in normalised device coordinates."""
WHOLE: Window = (-1.0, 1.0, -1.0, 1.0)


class ViewBlock(Block):
    """The view of one pass."""

    block_name = "View"

    clip_from_world: Mat4
    """From world to clip space, depth reversed."""
    ray_from_ndc: Mat4
    """From a place of the image to the direction seen there."""
    shadow_from_world: Mat4
    """From world to the shadow map's coordinates and depth, 0..1."""
    eye: Vec4
    """The eye's place and 1, or the direction towards it and 0."""
    clip_plane: Vec4
    """What is kept: dot(plane, (position, 1)) >= 0."""
    eye_reach: Length
    """Of a parallel view: how far the camera's place lies along the direction towards the eye."""
    shadow_offset: Length
    """How far a surface is moved along its normal before it is looked up in the shadow map."""


class WaterPlane(Block):
    """The water's plane and how its maps are read."""

    reflection_from_world: Mat4
    """From world to the reflection map's clip space."""
    refraction_from_world: Mat4
    """From world to the refraction map's clip space."""
    extents: Vec4
    """x0, x1, z0, z1."""
    picture_size: Vec2
    """Width and height of the picture, pixels."""
    reach: Vec2
    """The farthest that the waves move a map's coordinates, as fractions of the map."""
    level: Length
    """Height of the plane."""
    side: Number
    """1 where the eye is above the plane, -1 below."""


class Wind(Block):
    """How far plants have swayed."""

    slow_phase: Number
    """Radians, reduced to one turn."""
    fast_phase: Number
    """Radians, reduced to one turn."""

    @classmethod
    def at(cls, time: float, period: float | None) -> Wind:
        """The wind's phases; with a period each swings a whole number of times in it."""
        return cls(
            slow_phase=_phase(0.23, time, period),
            fast_phase=_phase(0.79, time, period),
        )


def _phase(hertz: float, time: float, period: float | None) -> float:
    if period is not None:
        hertz = max(1, round(hertz * period)) / period
    turns = hertz * time
    return 2 * math.pi * (turns - math.floor(turns))


@dataclass(frozen=True, eq=False)
class Look:
    """One way of looking at the scene: a camera, the half-space that is kept, the window that is wanted."""

    camera: Camera
    clip_plane: tuple[float, float, float, float] = NO_CLIP
    window: Window = WHOLE

    def block(self, shadows: Shadows) -> ViewBlock:
        """The uniform block of this look."""
        return ViewBlock(
            clip_from_world=flat(self.camera.clip_from_world),
            ray_from_ndc=flat(self.camera.ray_from_ndc),
            shadow_from_world=flat(shadows.shadow_from_world),
            eye=quadruple(self.camera.eye),
            clip_plane=self.clip_plane,
            eye_reach=float(self.camera.world_from_camera[:3, 2] @ self.camera.world_from_camera[:3, 3]),
            shadow_offset=shadows.offset,
        )

    def sees(self, low: NDArray[np.float32], high: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Which boxes, corners (n, 3), may be seen: a conservative test against each plane of the view."""
        clip = self.camera.clip_from_world
        left, right, bottom, top = self.window
        planes = [
            clip[0] - left * clip[3],
            right * clip[3] - clip[0],
            clip[1] - bottom * clip[3],
            top * clip[3] - clip[1],
            clip[3] - clip[2],
        ]
        planes.append(np.array(self.clip_plane))
        if self.camera.far is not None or self.camera.lens.is_orthographic:
            planes.append(clip[2])
        matrix = np.array(planes)
        positive = np.maximum(matrix[:, :3], 0) @ high.T.astype(np.float64)
        negative = np.minimum(matrix[:, :3], 0) @ low.T.astype(np.float64)
        return np.asarray((positive + negative + matrix[:, 3:] >= 0).all(axis=0))

    def distance_to(self, low: NDArray[np.float32], high: NDArray[np.float32]) -> NDArray[np.float64]:
        """How far each box's nearest point lies, for drawing front to back."""
        eye = self.camera.world_from_camera[:3, 3]
        nearest = np.clip(eye, low, high)
        return np.asarray(np.linalg.norm(nearest - eye, axis=1))


def quadruple(vector: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """A vector of four as the tuple that a block takes."""
    x, y, z, w = (float(v) for v in vector)
    return x, y, z, w


def flat(matrix: NDArray[np.float64]) -> tuple[float, ...]:
    """A matrix as the row-major tuple that a block takes."""
    return tuple(float(v) for v in matrix.flat)
