from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from renderer.errors import InvalidRequest
from renderer.request import FrameRequest
from renderer.trajectory import Turntable

ORBIT = {"orbit": {"target": [1.0, 0.5, -2.0], "distance": 8.0, "azimuth": 20.0, "elevation": 15.0}}


def frame(**fields: Any) -> FrameRequest:
    return FrameRequest.parse({"width": 64, "height": 36, **fields})


def eyes(requests: list[FrameRequest]) -> np.ndarray[Any, Any]:
    return np.array([request.view().world_from_camera[:3, 3] for request in requests])


def test_the_first_frame_is_the_given_camera_at_the_given_time() -> None:
    start = frame(time=1.25, camera=ORBIT)
    first = start.along(Turntable(frames=8, loop=False))[0]

    assert first == start
    assert first.key() == start.key()


def test_a_loop_repeats_after_the_sequence_and_another_keeps_the_frames_period() -> None:
    assert {r.period for r in frame(period=7.0).along(Turntable(frames=60, fps=30))} == {2.0}
    assert {r.period for r in frame(period=7.0).along(Turntable(frames=60, fps=30, loop=False))} == {7.0}
    assert {r.period for r in frame().along(Turntable(frames=60, fps=30, sweep=90, loop=False))} == {None}


def test_time_runs_by_the_frame_rate() -> None:
    times = [request.time for request in frame(time=2.0).along(Turntable(frames=6, fps=4))]

    assert times == [2.0, 2.25, 2.5, 2.75, 3.0, 3.25]


@pytest.mark.parametrize("sweep", [360.0, -720.0, 90.0])
def test_the_camera_keeps_its_height_and_distance_on_its_way_round(sweep: float) -> None:
    requests = frame(camera=ORBIT).along(Turntable(frames=12, sweep=sweep, loop=False))
    offset = eyes(requests) - [1.0, 0.5, -2.0]
    azimuth = np.degrees(np.unwrap(np.arctan2(offset[:, 0], -offset[:, 2])))

    assert np.linalg.norm(offset, axis=1) == pytest.approx(np.full(12, 8.0))
    assert offset[:, 1] == pytest.approx(np.full(12, offset[0, 1]))
    assert azimuth == pytest.approx(20.0 + sweep * np.arange(12) / 12), "even steps, clockwise, no frame twice"


def test_the_frame_after_a_loop_would_be_its_first() -> None:
    start = frame(camera=ORBIT)
    requests = start.along(Turntable(frames=5))
    beyond = requests[-1].camera.turned((1.0, 0.5, -2.0), 72.0)

    assert np.abs(beyond.pose() - start.camera.pose()).max() < 1e-9


def test_the_pivot_is_the_given_one_else_the_target_else_the_scenes_centre() -> None:
    posed = {"position": [6.0, 2.0, 0.0], "yaw": 90.0}
    half = Turntable(frames=2, loop=False)
    given = Turntable(frames=2, loop=False, pivot=(0.0, 0.0, 10.0))

    assert eyes(frame(camera=ORBIT).along(half)).mean(axis=0)[[0, 2]] == pytest.approx([1.0, -2.0])
    assert eyes(frame(camera=ORBIT).along(given)).mean(axis=0)[[0, 2]] == pytest.approx([0.0, 10.0])
    assert eyes(frame(camera=posed).along(half)).mean(axis=0)[[0, 2]] == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize("sweep", [90.0, 361.0, -100.0, 0.5])
def test_a_loop_needs_whole_turns(sweep: float) -> None:
    with pytest.raises(ValidationError, match="whole turns") as caught:
        Turntable(frames=10, sweep=sweep)
    assert caught.value.error_count() == 1
    assert Turntable(frames=10, sweep=sweep, loop=False).sweep == sweep


@pytest.mark.parametrize(
    "fields",
    [
        {"frames": 0},
        {"frames": 2.5},
        {"fps": 0.0},
        {"fps": 1e-9},
        {"fps": 1000.0},
        {"sweep": float("nan")},
        {"maps_every": 0},
        {"maps_every": 1.5},
        {"speed": 1},
    ],
)
def test_what_is_no_turntable_is_refused(fields: dict[str, Any]) -> None:
    with pytest.raises(ValidationError) as caught:
        Turntable.model_validate(fields)
    assert caught.value.error_count() == 1


@pytest.mark.parametrize(
    "turntable",
    [
        Turntable(frames=1, fps=240),
        Turntable(frames=3, fps=0.01),
        Turntable(frames=7),
        Turntable(frames=5, maps_every=2),
    ],
)
def test_every_frame_is_a_request_that_stands_by_itself(turntable: Turntable) -> None:
    for request in frame(camera=ORBIT).along(turntable):
        assert FrameRequest.parse(json.loads(request.canonical())).key() == request.key()


def test_a_turntable_that_ends_too_late_is_refused() -> None:
    with pytest.raises(InvalidRequest, match="too late") as caught:
        frame(time=9.9e6).along(Turntable(frames=100_000, fps=0.01, loop=False))
    assert [problem.path for problem in caught.value.problems] == ["turntable.frames"]


def test_frames_that_share_maps_name_the_time_and_the_camera_of_the_first() -> None:
    start = frame(time=2.0, camera=ORBIT)
    plain = start.along(Turntable(frames=7, fps=4))
    shared = start.along(Turntable(frames=7, fps=4, maps_every=3))

    assert [request.maps is None for request in shared] == [True, False, False, True, False, False, True]
    for i, (request, alone) in enumerate(zip(shared, plain, strict=True)):
        first = plain[i - i % 3]
        if request.maps is not None:
            assert (request.maps.time, request.maps.camera) == (first.time, first.camera)
        assert request.model_copy(update={"maps": None}) == alone


def test_maps_that_the_frame_names_itself_hold_for_every_frame() -> None:
    own = {"time": 0.5, "camera": ORBIT}
    requests = frame(maps=own).along(Turntable(frames=4))

    assert {request.maps for request in requests} == {frame(maps=own).maps}
    with pytest.raises(InvalidRequest, match="maps") as caught:
        frame(maps=own).along(Turntable(frames=4, maps_every=2))
    assert [problem.path for problem in caught.value.problems] == ["turntable.maps_every"]
