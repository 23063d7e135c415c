"""Pinhole projection in the OpenCV convention, apart from any clip space: R, t and K from a viewpoint's own numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def opencv_from_world(eye: ArrayLike, target: ArrayLike, up: ArrayLike) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and translation (3,) of a camera with x right, y down, z forward (Hartley & Zisserman, 6.1)."""
    e, t, u = (np.asarray(v, np.float64) for v in (eye, target, up))
    forward = (t - e) / np.linalg.norm(t - e)
    down = -(u - forward * (forward @ u))
    down /= np.linalg.norm(down)
    right = np.cross(down, forward)
    rotation = np.stack([right, down, forward])
    return rotation, -rotation @ e


def pixels(points: ArrayLike, rotation: Floats, translation: Floats, k: Floats) -> Floats:
    """Pixels (n, 2) of world points (n, 3), origin at the top left corner."""
    camera = np.asarray(points, np.float64) @ rotation.T + translation
    image = camera @ k.T
    return np.asarray(image[:, :2] / image[:, 2:])


def map_place(clip: ArrayLike) -> Floats:
    """Coordinates of a map, 0..1, v upwards, of clip space (Everitt 2001): the middle of the picture is (.5, .5)."""
    c = np.asarray(clip, np.float64)
    return np.asarray((c[..., :2] / c[..., 3:] + 1.0) / 2.0)
