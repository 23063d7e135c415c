"""Random cameras over water, and how many of its pixels a map drawn for them cannot answer."""

from __future__ import annotations

import numpy as np

from renderer.camera import Camera, Lens, pose, rotation_from_angles
from renderer.passes.mapping import map_look
from renderer.water.technique import MapSpec
from tests.renderer.world import LEVEL


def random_camera(rng: np.random.Generator, *, roll: float, pitch: float, is_centred: bool) -> Camera:
    """Any camera above the water that may see it, off-axis too unless it is centred."""
    turn = rotation_from_angles(rng.uniform(-180, 180), pitch, roll)
    eye = np.array([rng.uniform(-50, 50), LEVEL + np.exp(rng.uniform(-3, 3)), rng.uniform(-50, 50)])
    focal = rng.uniform(40, 400)
    cx, cy = (80, 45) if is_centred else (rng.uniform(-40, 200), rng.uniform(-40, 130))
    lens = Lens(focal, focal * rng.uniform(0.8, 1.25), cx, cy)
    return Camera(pose(turn, eye), lens, 160, 90)


def outside(spec: MapSpec, camera: Camera, rng: np.random.Generator) -> tuple[int, int]:
    """How many of the water's pixels read the map outside [0, 1], and how many pixels of water there are."""
    ndc = rng.uniform(-1, 1, (64, 2))
    rays = np.c_[ndc, np.ones(64), np.zeros(64)] @ camera.ray_from_ndc.T
    eye = camera.world_from_camera[:3, 3]
    with np.errstate(divide="ignore"):
        reach = (LEVEL - eye[1]) / rays[:, 1]
    water = eye + rays[:, :3] * np.where(np.isfinite(reach), reach, 0)[:, None]
    water = water[(reach > 0.02) & (reach < 1e5)]
    clip = np.c_[water, np.ones(len(water))] @ map_look(spec, camera, LEVEL).camera.clip_from_world.T
    place = 0.5 * clip[:, :2] / clip[:, 3:] + 0.5
    is_out = (place < -1e-6) | (place > 1 + 1e-6) | (clip[:, 3:] <= 0)
    return int(is_out.any(axis=1).sum()), len(water)


def loss(spec: MapSpec, *, roll: float = 0.0, pitch: float = 0.0, count: int = 200, is_centred: bool = True) -> float:
    """The share of the water's pixels that such a map cannot answer, over random cameras of up to these angles."""
    rng = np.random.default_rng(5)
    lost = seen = 0
    for _ in range(count):
        camera = random_camera(
            rng, roll=rng.uniform(-roll, roll), pitch=rng.uniform(-pitch, pitch), is_centred=is_centred
        )
        out, of = outside(spec, camera, rng)
        lost, seen = lost + out, seen + of
    assert seen > 10 * count
    return lost / seen
