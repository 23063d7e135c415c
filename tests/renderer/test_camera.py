"""Cameras against an independent projection (OpenCV's R, t, K), and the algebra of the mirror."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.camera import (
    Camera,
    Lens,
    compass_direction,
    look_at,
    mirror_about,
    pose,
    rigid_inverse,
    rotation_from_angles,
)
from tests.reference import projection

WIDTH, HEIGHT = 640, 360
LENS = Lens(500.0, 480.0, 300.0, 200.0)
SIDEWAYS = Lens(40.0, 40.0, 320.0, 180.0, is_orthographic=True)

place = st.tuples(*[st.floats(-50, 50)] * 3).map(np.array)
angle = st.floats(-180, 180)


def points(count: int, seed: int = 0) -> NDArray[np.float64]:
    return np.random.default_rng(seed).uniform(-20, 20, (count, 3))


def posed(yaw: float, pitch: float, roll: float, eye: NDArray[np.float64], lens: Lens = LENS) -> Camera:
    return Camera(pose(rotation_from_angles(yaw, pitch, roll), eye), lens, WIDTH, HEIGHT)


def pixels_of(camera: Camera, world: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pixels from the top left corner, by the camera's own clip space."""
    ndc = camera.project(world)
    return np.stack([(ndc[:, 0] + 1) / 2 * camera.width, (1 - ndc[:, 1]) / 2 * camera.height], axis=1)


@pytest.mark.parametrize("up", [(0, 1, 0), (0.4, 1, -0.2), (0, -1, 0)])
def test_look_at_projects_as_opencv_does(up: tuple[float, float, float]) -> None:
    eye, target = np.array([7.0, 3.0, 9.0]), np.array([0.5, 0.2, -1.0])
    camera = Camera(look_at(eye, target, np.array(up, float)), LENS, WIDTH, HEIGHT)
    rotation, translation = projection.opencv_from_world(eye, target, up)
    world = points(200)
    world = world[(world @ rotation.T + translation)[:, 2] > 0.1]
    expected = projection.pixels(world, rotation, translation, LENS.intrinsics)

    assert len(world) > 50
    assert np.abs(pixels_of(camera, world) - expected).max() < 1e-6


def test_a_point_behind_the_eye_has_no_place() -> None:
    camera = posed(0, 0, 0, np.zeros(3))

    assert np.isnan(camera.project(np.array([[0.0, 0.0, 5.0]]))).all()
    assert np.isfinite(camera.project(np.array([[0.0, 0.0, -5.0]]))).all()


@pytest.mark.parametrize(("distance", "depth"), [(0.01, 1.0), (0.02, 0.5), (10.0, 1e-3), (60_000.0, 0.01 / 60_000)])
def test_depth_is_reversed_and_falls_with_distance(distance: float, depth: float) -> None:
    assert posed(0, 0, 0, np.zeros(3)).project(np.array([[0, 0, -distance]]))[0, 2] == pytest.approx(depth)


@pytest.mark.parametrize("lens", [LENS, SIDEWAYS])
def test_a_far_plane_lies_at_depth_zero(lens: Lens) -> None:
    camera = replace(posed(0, 0, 0, np.zeros(3), lens), near=0.5, far=80.0)

    assert camera.project(np.array([[0, 0, -0.5], [0, 0, -80.0]]))[:, 2] == pytest.approx([1.0, 0.0])


def test_a_float_tells_a_centimetre_from_two_at_the_shore_and_at_sixty_kilometres() -> None:
    camera = posed(0, 0, 0, np.zeros(3))
    far = camera.project(np.array([[0, 0, -60_000.0], [0, 0, -60_000.5]]))[:, 2].astype(np.float32)

    assert far[0] > far[1]


def test_orthographic_pixels_do_not_depend_on_distance() -> None:
    camera = posed(30, -20, 10, np.array([1.0, 2.0, 3.0]), SIDEWAYS)
    world = points(20)
    ahead = -camera.world_from_camera[:3, 2]

    assert np.abs(pixels_of(camera, world) - pixels_of(camera, world + 7 * ahead)).max() < 1e-9
    assert np.linalg.norm(
        pixels_of(camera, world + camera.world_from_camera[:3, 0]) - pixels_of(camera, world), axis=1
    ) == (pytest.approx(np.full(20, 40.0)))


@settings(max_examples=50)
@given(place, angle, angle, angle, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_jitter_moves_the_sampling_point_right_and_down(
    eye: NDArray[np.float64], yaw: float, pitch: float, roll: float, x: float, y: float
) -> None:
    camera = posed(yaw, pitch, roll, eye)
    world = eye + points(30) - 50 * camera.world_from_camera[:3, 2]

    assert np.abs(pixels_of(camera.jittered(x, y), world) - (pixels_of(camera, world) - [x, y])).max() < 1e-7


@settings(max_examples=50)
@given(place, angle, angle, angle, st.booleans())
def test_rays_lead_to_the_points_that_are_seen(
    eye: NDArray[np.float64], yaw: float, pitch: float, roll: float, is_parallel: bool
) -> None:
    camera = posed(yaw, pitch, roll, eye, SIDEWAYS if is_parallel else LENS)
    world = eye + points(20) - 60 * camera.world_from_camera[:3, 2]
    ndc = camera.project(world)
    rays = np.c_[ndc[:, :2], np.ones(20), np.zeros(20)] @ camera.ray_from_ndc.T
    if is_parallel:
        expected = np.tile(-camera.eye[:3], (20, 1))
    else:
        expected = (world - eye) / np.linalg.norm(world - eye, axis=1, keepdims=True)
    found = rays[:, :3] / np.linalg.norm(rays[:, :3], axis=1, keepdims=True)

    assert np.abs(found - expected).max() < 1e-9


def test_the_inverse_of_a_pose_is_its_inverse_even_if_it_mirrors() -> None:
    rigid = pose(rotation_from_angles(20, -30, 40), np.array([1.0, 2.0, 3.0]))

    for matrix in (rigid, mirror_about(1.7) @ rigid):
        assert np.abs(rigid_inverse(matrix) @ matrix - np.eye(4)).max() < 1e-12


@pytest.mark.parametrize(
    ("azimuth", "direction"), [(0, (0, 0, -1)), (90, (1, 0, 0)), (180, (0, 0, 1)), (270, (-1, 0, 0))]
)
def test_the_compass_runs_clockwise_from_minus_z(azimuth: float, direction: tuple[float, float, float]) -> None:
    assert compass_direction(azimuth, 0) == pytest.approx(direction, abs=1e-12)
    assert compass_direction(azimuth, 90) == pytest.approx((0, 1, 0), abs=1e-12)


@pytest.mark.parametrize(
    ("angles", "axis", "image"),
    [((90, 0, 0), (0, 0, -1), (-1, 0, 0)), ((0, 90, 0), (0, 0, -1), (0, 1, 0)), ((0, 0, 90), (1, 0, 0), (0, 1, 0))],
)
def test_angles_turn_left_up_and_anticlockwise(
    angles: tuple[float, float, float], axis: tuple[float, float, float], image: tuple[float, float, float]
) -> None:
    assert rotation_from_angles(*angles) @ np.array(axis) == pytest.approx(image, abs=1e-12)


# ----------------------------------------------------------------------------------------------------------- the mirror


@pytest.mark.parametrize("level", [0.0, 2.75, -40.0])
def test_the_mirror_is_a_reflection_about_its_plane(level: float) -> None:
    mirror = mirror_about(level)
    on_plane = np.c_[points(20)[:, 0], np.full(20, level), points(20)[:, 2], np.ones(20)]

    assert np.linalg.det(mirror) == pytest.approx(-1)
    assert np.abs(mirror @ mirror - np.eye(4)).max() < 1e-12
    assert np.abs(on_plane @ mirror.T - on_plane).max() < 1e-12
    assert mirror @ [3, level + 5, 7, 1] == pytest.approx([3, level - 5, 7, 1])


def worst_shift(camera: Camera, level: float, mirrored: Camera, count: int = 40) -> float:
    """How far apart, in half pictures, a camera and a mirrored one show points of the plane."""
    world = points(count, seed=1) * [3, 0, 3] + [0, level, 0]
    direct, indirect = camera.project(world)[:, :2], mirrored.project(world)[:, :2]
    seen = np.isfinite(direct).all(axis=1) & (np.abs(direct) < 2).all(axis=1)
    if not seen.any():
        return 0.0
    return float(np.nan_to_num(np.abs(direct - indirect)[seen], nan=np.inf).max())


@settings(max_examples=100)
@given(place, angle, st.floats(-89, 89), angle, st.floats(-5, 5), st.booleans())
def test_points_of_the_plane_stay_where_they_are_seen(
    eye: NDArray[np.float64], yaw: float, pitch: float, roll: float, level: float, is_parallel: bool
) -> None:
    camera = posed(yaw, pitch, roll, eye, SIDEWAYS if is_parallel else LENS)
    mirrored = camera.mirrored(level)

    assert worst_shift(camera, level, mirrored) < 1e-5
    assert mirrored.is_mirrored
    assert not camera.is_mirrored
    assert mirrored.mirrored(level).world_from_camera == pytest.approx(camera.world_from_camera)
    if not is_parallel:
        assert mirrored.eye == pytest.approx([eye[0], 2 * level - eye[1], eye[2], 1])


def test_a_mirror_at_another_level_is_told_apart() -> None:
    camera = posed(20, -25, 10, np.array([1.0, 6.0, 9.0]))

    assert worst_shift(camera, 1.0, camera.mirrored(1.0)) < 1e-9
    assert worst_shift(camera, 1.0, camera.mirrored(1.05)) > 1e-3
