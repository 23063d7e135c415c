"""Cameras as matrices: pose, projection, and the mirror about a plane.

Conventions: world right-handed, +y up, metres. Camera axes are OpenGL's (x right, y up, looking down
−z). Pixel origin top-left, centres at +0.5. Matrices act on columns and are named
``destination_from_source``. Depth is reversed (1 at the near plane, 0 far away) in a 0..1 clip range.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

NEAR = 0.01
"""Metres: the near plane where a request leaves it to us; reversed float depth can afford it."""
ORTHOGRAPHIC_FAR = 10_000.0
"""Metres: the far plane of an orthographic camera that names none (its depth is linear, so finite)."""


@dataclass(frozen=True)
class Lens:
    """A projection in pixels.

    ``fx fy cx cy`` of a pinhole, or with ``is_orthographic`` pixels per metre and the principal point.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    is_orthographic: bool = False

    @property
    def intrinsics(self) -> Matrix:
        """K, 3×3, y down: pixel = K @ (x, y, z) in the OpenCV camera frame."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], np.float64)


@dataclass(frozen=True, eq=False)
class Camera:
    """Where a picture is taken from, and how.

    ``world_from_camera`` is a rigid pose, or a mirrored one (determinant −1): then front faces turn
    clockwise, and nothing else changes.
    """

    world_from_camera: Matrix
    lens: Lens
    width: int
    height: int
    near: float = NEAR
    far: float | None = None
    jitter: tuple[float, float] = (0.0, 0.0)
    """Pixels by which the sampling point moves right and down."""

    @property
    def camera_from_world(self) -> Matrix:
        """The inverse of the pose."""
        return rigid_inverse(self.world_from_camera)

    @property
    def clip_from_camera(self) -> Matrix:
        """The projection: reversed depth in 0..1; an unset far plane lies at infinity."""
        lens = self.lens
        cx = lens.cx - self.jitter[0]
        cy = lens.cy - self.jitter[1]
        scale = np.array([2 * lens.fx / self.width, 2 * lens.fy / self.height])
        shift = np.array([1 - 2 * cx / self.width, 2 * cy / self.height - 1])
        clip = np.zeros((4, 4))
        clip[0, 0], clip[1, 1] = scale
        if lens.is_orthographic:
            far = self.far or ORTHOGRAPHIC_FAR
            clip[:2, 3] = -shift
            clip[2, 2] = 1 / (far - self.near)
            clip[2, 3] = far / (far - self.near)
            clip[3, 3] = 1
        else:
            clip[:2, 2] = shift
            clip[3, 2] = -1
            if self.far is None:
                clip[2, 3] = self.near
            else:
                clip[2, 2] = self.near / (self.far - self.near)
                clip[2, 3] = self.near * self.far / (self.far - self.near)
        return clip

    @property
    def clip_from_world(self) -> Matrix:
        """From world to clip space."""
        return self.clip_from_camera @ self.camera_from_world

    @property
    def eye(self) -> NDArray[np.float64]:
        """The homogeneous place of the eye: ``(x, y, z, 1)``, or ``(direction towards the eye, 0)``."""
        if self.lens.is_orthographic:
            return np.append(self.world_from_camera[:3, 2], 0.0)
        return np.append(self.world_from_camera[:3, 3], 1.0)

    @property
    def ray_from_ndc(self) -> Matrix:
        """Directions: ``(ray_from_ndc @ (x, y, 1, 0)).xyz`` looks through that place of the image."""
        clip = self.clip_from_camera
        ray = np.zeros((4, 4))
        rotation = self.world_from_camera[:3, :3]
        if self.lens.is_orthographic:
            ray[:3, 2] = -rotation[:, 2]
        else:
            ray[:3, 0] = rotation[:, 0] / clip[0, 0]
            ray[:3, 1] = rotation[:, 1] / clip[1, 1]
            offset = np.array([clip[0, 2] / clip[0, 0], clip[1, 2] / clip[1, 1], -1.0])
            ray[:3, 2] = rotation @ offset
        return ray

    @property
    def is_mirrored(self) -> bool:
        """Whether the pose mirrors the world, so that front faces turn clockwise."""
        return bool(np.linalg.det(self.world_from_camera[:3, :3]) < 0)

    def mirrored(self, level: float) -> Camera:
        """The camera that sees the world mirrored about the plane y = level: ``view @ mirror``."""
        return replace(self, world_from_camera=mirror_about(level) @ self.world_from_camera)

    def jittered(self, x: float, y: float) -> Camera:
        """The camera with its sampling points moved by a fraction of a pixel."""
        return replace(self, jitter=(x, y))

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World points (n, 3) to normalised device coordinates (n, 3); behind the eye gives NaN."""
        clip = np.c_[points, np.ones(len(points))] @ self.clip_from_world.T
        with np.errstate(divide="ignore", invalid="ignore"):
            ndc = clip[:, :3] / clip[:, 3:]
        ndc[clip[:, 3] <= 0] = np.nan
        return np.asarray(ndc)


def mirror_about(level: float) -> Matrix:
    """The reflection about the plane y = level: its own inverse, determinant −1."""
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    mirror[1, 3] = 2 * level
    return mirror


def rigid_inverse(pose: Matrix) -> Matrix:
    """The inverse of an orthonormal pose, mirrored or not: transpose the axes, turn the origin back."""
    inverse = np.eye(4)
    inverse[:3, :3] = pose[:3, :3].T
    inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return inverse


def look_at(
    eye: NDArray[np.float64],
    target: NDArray[np.float64],
    up: NDArray[np.float64],
) -> Matrix:
    """The pose at ``eye`` that looks at ``target``; ``up`` may not be parallel to the view."""
    back = eye - target
    back = back / np.linalg.norm(back)
    right = np.cross(up, back)
    right = right / np.linalg.norm(right)
    return pose(np.stack([right, np.cross(back, right), back], axis=1), eye)


def pose(rotation: NDArray[np.float64], position: NDArray[np.float64]) -> Matrix:
    """The matrix with these axes as columns and this origin."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = position
    return matrix


def rotation_from_angles(yaw: float, pitch: float, roll: float) -> NDArray[np.float64]:
    """``Ry(yaw) @ Rx(pitch) @ Rz(roll)``, degrees, by the right-hand rule about +y, +x and +z."""
    y, p, r = np.radians([yaw, pitch, roll])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(p), -np.sin(p)], [0, np.sin(p), np.cos(p)]])
    about_z = np.array([[np.cos(r), -np.sin(r), 0], [np.sin(r), np.cos(r), 0], [0, 0, 1]])
    return np.asarray(about_y @ about_x @ about_z)


def compass_direction(azimuth: float, elevation: float) -> NDArray[np.float64]:
    """The unit vector at a compass azimuth (degrees clockwise from −z, so 90 is +x) and elevation."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.sin(a) * np.cos(e), np.sin(e), -np.cos(a) * np.cos(e)])
