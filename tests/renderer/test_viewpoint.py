"""The forms of a camera: the same place in each of them, what each refuses, and the turn about a pivot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from renderer.camera import Matrix, pose, rotation_from_angles
from renderer.lens import Viewpoint, turn_point
from renderer.viewpoint import AnyViewpoint
from tests.reference import projection

ANY: TypeAdapter[Any] = TypeAdapter(AnyViewpoint)


def viewpoint(**fields: Any) -> Viewpoint:
    made = ANY.validate_python(fields)
    assert isinstance(made, Viewpoint)
    return made


def rows(matrix: Matrix) -> list[float]:
    return [float(v) for v in matrix.flat]


def far_apart(a: Viewpoint, b: Viewpoint) -> float:
    return float(np.abs(a.pose() - b.pose()).max())


def test_every_form_of_one_camera_has_one_pose() -> None:
    target, distance, azimuth, elevation = (1.0, 0.5, -2.0), 10.0, 130.0, 25.0
    orbit = viewpoint(orbit={"target": target, "distance": distance, "azimuth": azimuth, "elevation": elevation})
    eye = orbit.pose()[:3, 3]
    forms = [
        viewpoint(eye=eye, target=target),
        viewpoint(position=eye, yaw=180 - azimuth, pitch=-elevation),
        viewpoint(matrix=rows(orbit.pose())),
    ]

    assert np.linalg.norm(eye - target) == pytest.approx(distance)
    assert eye[1] - 0.5 == pytest.approx(distance * np.sin(np.radians(elevation)))
    assert max(far_apart(orbit, form) for form in forms) < 1e-12
    rotation, _ = projection.opencv_from_world(eye, target, (0, 1, 0))
    assert np.abs(orbit.pose()[:3, :3].T * [[1], [-1], [-1]] - rotation).max() < 1e-12


def test_an_orbit_may_look_straight_down() -> None:
    above = viewpoint(orbit={"target": [0, 0, 0], "distance": 5.0, "azimuth": 30.0, "elevation": 90.0})

    assert above.pose()[:3, 3] == pytest.approx([0, 5, 0], abs=1e-12)
    assert above.pose()[:3, 2] == pytest.approx([0, 1, 0], abs=1e-12)


def test_the_lens_is_a_field_of_view_a_matrix_or_parallel() -> None:
    eye: dict[str, Any] = {"eye": [0, 1, 5], "target": [0, 0, 0]}
    wide = viewpoint(**eye, fov_y=90.0).lens(640, 480)
    k = viewpoint(**eye, intrinsics={"fx": 700, "fy": 710, "cx": 300, "cy": 260}).lens(640, 480)
    flat = viewpoint(**eye, orthographic={"height": 12.0}).lens(640, 480)

    assert (wide.fx, wide.fy, wide.cx, wide.cy) == pytest.approx((240, 240, 320, 240))
    assert viewpoint(**eye).lens(640, 480) == viewpoint(**eye, fov_y=45.0).lens(640, 480)
    assert k.intrinsics.tolist() == [[700, 0, 300], [0, 710, 260], [0, 0, 1]]
    assert flat.is_orthographic
    assert flat.fx == flat.fy == pytest.approx(40)


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"eye": [1, 2, 3], "target": [1, 2, 3]}, "differ from eye"),
        ({"eye": [0, 0, 0], "target": [0, 5, 0]}, "parallel"),
        ({"eye": [0, 0, 0], "target": [0, -5, 0], "up": [0, 3, 0]}, "parallel"),
        ({"eye": [0, 0, 0], "target": [1, 0, 0], "up": [0, 0, 0]}, "zero"),
        ({"eye": [0, 0, 0]}, "required"),
        ({"eye": [0, 0, 0], "target": [1, 0, 0], "yaw": 3}, "one form"),
        ({"position": [0, 0, 0], "orbit": {}}, "one form"),
        ({"yaw": 3}, "required"),
        ({}, "one form"),
        ({"eye": [0, 0, 0], "target": [1, 0, 0], "fov_y": 40, "orthographic": {"height": 3}}, "one of fov_y"),
        ({"eye": [0, 0, 0], "target": [1, 0, 0], "fov_y": 0}, "greater"),
        ({"eye": [0, 0, 0], "target": [1, 0, 0], "fov_y": 180}, "less"),
        ({"eye": [0, 0, 0], "target": [1, 0, 0], "near": 2, "far": 1}, "beyond near"),
        ({"eye": [0, 0, 0], "target": [1, 0, 0], "far": 0.005}, "beyond near"),
        ({"matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]}, "rotation"),
        ({"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]}, "rotation"),
        ({"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1]}, "last row"),
        ({"matrix": [1, 0, 0, 1e9, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}, "too large"),
        ({"orbit": {"target": [0, 0, 0], "distance": 0}}, "greater"),
        ({"orbit": {"target": [0, 0, 0], "distance": 1, "elevation": 91}}, "less"),
    ],
)
def test_what_no_camera_can_be_is_one_error(fields: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValidationError, match=complaint) as caught:
        ANY.validate_python(fields)
    assert caught.value.error_count() == 1


def test_a_rounded_matrix_becomes_a_rotation() -> None:
    exact = pose(rotation_from_angles(20, 30, 40), np.array([1.0, 2.0, 3.0]))
    rotation = viewpoint(matrix=rows(exact.round(4))).pose()[:3, :3]

    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-12
    assert np.abs(rotation - exact[:3, :3]).max() < 1e-4


FORMS: list[dict[str, Any]] = [
    {"eye": [9.0, 3.0, 8.0], "target": [0.0, 0.4, 1.0], "up": [0.1, 1.0, 0.0]},
    {"position": [9.0, 3.0, 8.0], "yaw": 40.0, "pitch": -10.0, "roll": 15.0},
    {"orbit": {"target": [1.0, 0.4, 2.0], "distance": 9.0, "azimuth": 30.0, "elevation": 20.0}},
    {"matrix": rows(pose(rotation_from_angles(40, -10, 15), np.array([9.0, 3.0, 8.0])))},
]


@pytest.mark.parametrize("form", FORMS)
@given(turn=st.floats(-720, 720), pivot=st.tuples(*[st.floats(-20, 20)] * 3))
def test_a_turn_carries_the_whole_camera_clockwise(
    form: dict[str, Any], turn: float, pivot: tuple[float, float, float]
) -> None:
    camera = viewpoint(**form)
    about: NDArray[np.float64] = pose(rotation_from_angles(-turn, 0, 0), np.zeros(3))
    about[:3, 3] = np.array(pivot) - about[:3, :3] @ np.array(pivot)

    assert np.abs(camera.turned(pivot, turn).pose() - about @ camera.pose()).max() < 1e-9


def test_a_quarter_turn_goes_from_north_to_east() -> None:
    assert turn_point((0.0, 1.0, -5.0), (0.0, 0.0, 0.0), 90.0) == pytest.approx((5.0, 1.0, 0.0))


def test_forms_that_look_at_something_name_their_pivot() -> None:
    assert [viewpoint(**form).pivot for form in FORMS] == [(0.0, 0.4, 1.0), None, (1.0, 0.4, 2.0), None]
