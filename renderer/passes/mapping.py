"""The reflection and refraction maps. This pass knows only ``MapSpec``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera, Matrix, look_at, rotation_from_angles
from renderer.gpu.target import Target
from renderer.passes.view import NO_CLIP, WHOLE, Look, Window, quadruple
from renderer.water.technique import Extents, MapSpec

EDGE_SLACK = 0.75
"""Pixels: where edges are smooth, a pixel that the water covers in part may have its centre past the water's edge."""
EPSILON = 1e-3
"""Metres: an eye nearer than this to the plane counts as this far from it."""
W_LEAST = 1e-6
"""Metres before the eye from which on a point has a place in the image."""


@dataclass(frozen=True, eq=False)
class DrawnMap:
    """A map, and the projection by which it is read."""

    target: Target
    clip_from_world: Matrix


Paint = Callable[[Target, Look, MapSpec], None]
"""Draws the world into a target as a map wants it."""


def map_look(spec: MapSpec, camera: Camera, level: float, window: Window = WHOLE, slack: float = 0.0) -> Look:
    """How a map looks at the scene: its camera at the map's size, the side of the water it keeps, its window.

    The window holds for maps that are read by the picture's own projection, and past their edge at that edge. ``slack``
    is how many pixels past the water are kept besides the bias, at any distance.
    """
    if spec.camera not in ("mirror", "direct") or spec.wrap != "clamp":
        window = WHOLE
    size = map_size(spec, camera)
    across, down = size[0] / camera.width, size[1] / camera.height
    lens = camera.lens
    scaled = replace(
        camera,
        lens=replace(lens, fx=lens.fx * across, fy=lens.fy * down, cx=lens.cx * across, cy=lens.cy * down),
        width=size[0],
        height=size[1],
    )
    made = MAP_CAMERAS[spec.camera](scaled, level)
    if spec.clip is None:
        return Look(made, NO_CLIP, window)
    sign = eye_side(camera, level) * (1.0 if spec.clip == "above" else -1.0)
    plane = np.array([0.0, sign, 0.0, -sign * level + spec.bias])
    # A pixel's height grows with w, which is linear in the place: a tilt of the plane adds as much everywhere.
    return Look(made, quadruple(plane + slack / scaled.lens.fy * made.clip_from_world[3]), window)


def water_window(
    camera: Camera,
    level: float,
    extents: Extents,
    reach: tuple[float, float],
) -> Window:
    """The part of the image in which the water may look into a map.

    That is the box round the plane's rectangle, clipped at the eye, and ``reach`` more on each side: the farthest
    that the technique moves a map's coordinates, as fractions of the map.
    """
    polygon = _in_front(_corners(level, extents) @ camera.clip_from_world.T)
    if not len(polygon):
        return (0.0, 0.0, 0.0, 0.0)
    ndc = polygon[:, :2] / polygon[:, 3:]
    margin = 2 * np.array(reach) + 4 / np.array([camera.width, camera.height])
    left, bottom = np.clip(ndc.min(axis=0) - margin, -1, 1)
    right, top = np.clip(ndc.max(axis=0) + margin, -1, 1)
    return float(left), float(right), float(bottom), float(top)


def seen_water_is_before(source: Camera, camera: Camera, level: float, extents: Extents) -> bool:
    """Whether all water in a picture of ``camera`` lies before the eye of ``source``, which projects it then."""
    corners = _corners(level, extents)
    seen = _in_front(np.c_[corners @ camera.clip_from_world.T, corners @ source.clip_from_world[3]])
    for axis in (0, 1):
        for sign in (-1.0, 1.0):
            seen = _kept_part(seen, seen[:, 3] + sign * seen[:, axis])
    return bool((seen[:, 4] >= W_LEAST).all())


def _corners(level: float, extents: Extents) -> NDArray[np.float64]:
    x0, x1, z0, z1 = extents
    return np.array([[x, level, z, 1.0] for x, z in ((x0, z0), (x1, z0), (x1, z1), (x0, z1))])


def _in_front(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of a polygon in clip space before the eye."""
    return _kept_part(polygon, polygon[:, 3] - W_LEAST)


def _kept_part(polygon: NDArray[np.float64], over: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of a polygon where a linear function of its corners is not negative (Sutherland and Hodgman 1974)."""
    kept = []
    for here, after, over_here, over_after in zip(
        polygon, np.roll(polygon, -1, axis=0), over, np.roll(over, -1), strict=True
    ):
        if over_here >= 0:
            kept.append(here)
        if (over_here >= 0) != (over_after >= 0):
            kept.append(here + over_here / (over_here - over_after) * (after - here))
    return np.array(kept).reshape(-1, polygon.shape[1])


def map_size(spec: MapSpec, camera: Camera) -> tuple[int, int]:
    """The map's size in pixels."""
    if spec.size is not None:
        return spec.size
    return max(1, round(camera.width * spec.scale)), max(1, round(camera.height * spec.scale))


def eye_side(camera: Camera, level: float) -> float:
    """1 where the eye is above the plane, −1 below it; a parallel view by its direction."""
    eye = camera.eye
    height = eye[1] - level if eye[3] else eye[1]
    return 1.0 if height >= 0 else -1.0


def draw_maps(
    looks: Mapping[str, tuple[MapSpec, Look]],
    lend: Callable[[str, MapSpec, Camera], Target],
    paint: Paint,
) -> dict[str, DrawnMap]:
    """Draw each map of a technique."""
    drawn = {}
    for name, (spec, look) in looks.items():
        target = lend(name, spec, look.camera)
        paint(target, look, spec)
        drawn[name] = DrawnMap(target, look.camera.clip_from_world)
    return drawn


def _mirror(camera: Camera, level: float) -> Camera:
    return camera.mirrored(level)


def _direct(camera: Camera, _level: float) -> Camera:
    return camera


def _look_at(camera: Camera, level: float) -> Camera:
    """The Lake article's mirrored camera: eye and target mirrored, the side vector not; wrong under roll."""
    pose = camera.world_from_camera
    forward = -pose[:3, 2] * [1, -1, 1]
    eye = pose[:3, 3] * [1, -1, 1] + [0, 2 * level, 0]
    up = np.cross(pose[:3, 0], forward)
    return replace(camera, world_from_camera=look_at(eye, eye + forward, up))


def _yaw_only(camera: Camera, level: float) -> Camera:
    """Rastertek tutorial 27's mirrored camera: the eye mirrored, the view by yaw alone."""
    back = camera.world_from_camera[:3, 2]
    yaw = float(np.degrees(np.arctan2(back[0], back[2])))
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_from_angles(yaw, 0.0, 0.0)
    matrix[:3, 3] = camera.world_from_camera[:3, 3] * [1, -1, 1] + [0, 2 * level, 0]
    return replace(camera, world_from_camera=matrix)


MAP_CAMERAS: dict[str, Callable[[Camera, float], Camera]] = {
    "mirror": _mirror,
    "look_at": _look_at,
    "yaw_only": _yaw_only,
    "direct": _direct,
}
