"""What the client asks and what it makes of answers, operation by operation, without a network."""

from __future__ import annotations

import json
import warnings

import millpond
import numpy as np
import pytest
from millpond import operations
from millpond.exchange import Reply

from tests.service.client_clock import OK, Clock, job, refusal


def test_one_idempotency_key_serves_all_tries_of_one_submission() -> None:
    clock = Clock()
    for _ in range(2):
        clock.play(operations.submit(clock.policy(), {"kind": "turntable"}), refusal(503), refusal(503), job("queued"))
    keys = [step.call.headers["Idempotency-Key"] for step in clock.sent]

    assert len(set(keys[:3])) == len(set(keys[3:])) == 1
    assert keys[0] != keys[3]
    assert all(len(key) >= 32 for key in keys)


def test_the_callers_own_idempotency_key_is_used() -> None:
    clock = Clock()
    clock.play(operations.submit(clock.policy(), {}, "mine"), job("queued"))

    assert clock.sent[0].call.headers["Idempotency-Key"] == "mine"


def test_waiting_shows_every_look_and_ends_with_success() -> None:
    clock, shown = Clock(), list[str]()
    script = operations.wait(clock.policy(), "a", 100.0, lambda facts: shown.append(facts["state"]))
    facts = clock.play(script, job("queued"), job("running", 1), job("paused", 2), job("succeeded", 4))

    assert shown == ["queued", "running", "paused", "succeeded"]
    assert facts["counts"]["done"] == 4
    assert clock.slept == sorted(clock.slept)
    assert max(clock.slept) <= 1.0


@pytest.mark.parametrize("state", ["failed", "cancelled", "expired"])
def test_waiting_for_a_job_that_ends_otherwise_raises(state: str) -> None:
    clock = Clock()
    error = {"title": "It broke", "detail": "frame 3: no luck"}
    script = operations.wait(clock.policy(), "a", 100.0, lambda _: None)

    with pytest.raises(millpond.JobFailed, match=rf"job a {state}: frame 3: no luck \(2 of 4") as caught:
        clock.play(script, job("running"), job(state, 2, error=error))
    assert caught.value.job["error"] == error


def test_an_unknown_state_warns_once_and_is_waited_for_until_the_deadline() -> None:
    clock = Clock()
    script = operations.wait(clock.policy(), "a", 20.0, lambda _: None)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with pytest.raises(millpond.TimedOut, match=r"within 20 s: dreaming, 1 of 4"):
            clock.play(script, job("dreaming", 1))
    assert [warning.category for warning in caught] == [millpond.UnknownJobState]
    assert 18.0 < clock.now - 1000.0 <= 20.0


def test_an_unknown_state_may_still_end_well() -> None:
    clock = Clock()
    script = operations.wait(clock.policy(), "a", 20.0, lambda _: None)

    with pytest.warns(millpond.UnknownJobState, match="dreaming"):
        assert clock.play(script, job("dreaming"), job("succeeded", 4))["state"] == "succeeded"


def test_waiting_survives_a_service_that_restarts() -> None:
    clock = Clock()
    script = operations.wait(clock.policy(), "a", 60.0, lambda _: None)
    gone = millpond.ConnectionFailed("gone")

    assert clock.play(script, job("running"), gone, gone, refusal(503), job("succeeded"))["state"] == "succeeded"


def test_frames_are_gathered_over_all_pages() -> None:
    clock = Clock()
    pages = [{"frames": [{"index": 0}, {"index": 1}], "next": "c1"}, {"frames": [{"index": 2}], "next": None}]
    found = clock.play(
        operations.frames(clock.policy(), "a"), *(Reply(200, {}, json.dumps(page).encode()) for page in pages)
    )

    assert [frame["index"] for frame in found] == [0, 1, 2]
    assert [step.call.query.get("cursor") for step in clock.sent] == [None, "c1"]


@pytest.mark.parametrize("failure", [refusal(503), millpond.ConnectionFailed("gone"), millpond.TimedOut("late")])
def test_a_service_that_cannot_be_asked_is_not_ready(failure: Reply | Exception) -> None:
    clock = Clock()

    assert clock.play(operations.ready(clock.policy()), failure) is False
    assert len(clock.sent) == 1
    assert clock.play(operations.ready(clock.policy()), OK) is True


def test_waiting_for_readiness_ends_with_the_reason() -> None:
    clock = Clock()
    clock.play(operations.wait_ready(clock.policy(), 30.0), millpond.ConnectionFailed("gone"), refusal(503), OK)

    with pytest.raises(millpond.TimedOut, match="not ready within 5 s: 503"):
        clock.play(operations.wait_ready(clock.policy(), 5.0), refusal(503))


def test_an_answer_of_something_else_is_a_clear_error() -> None:
    clock = Clock()

    with pytest.raises(millpond.MillpondError, match="is this a Millpond service"):
        clock.play(operations.info(clock.policy()), Reply(200, {}, b"<html>"))
    with pytest.raises(millpond.MillpondError, match="is this a Millpond service"):
        clock.play(operations.job(clock.policy(), "a"), Reply(200, {}, b"[]"))


def test_numpy_and_tuples_travel_as_json() -> None:
    clock = Clock()
    fields = {
        "camera": {"eye": np.array([1, 2.5, 3]), "fov_y": np.float32(45)},
        "width": np.int64(64),
        "layers": ("color",),
    }
    clock.play(operations.frame(clock.policy(), {"width": 3, "time": 1}, fields), OK)

    assert json.loads(clock.sent[0].call.body or b"") == {
        "width": 64, "time": 1, "camera": {"eye": [1, 2.5, 3], "fov_y": 45}, "layers": ["color"],
    }  # fmt: skip


def test_nan_is_left_to_the_service_to_refuse() -> None:
    clock = Clock()
    clock.play(operations.frame(clock.policy(), {"time": float("nan")}, {}), OK)

    assert clock.sent[0].call.body == b'{"time":NaN}'


@pytest.mark.parametrize("job_id", ["../../livez", "a/b", "a?b=c", "ä", "a b", "a#b"])
def test_a_job_id_cannot_leave_its_place_in_the_path(job_id: str) -> None:
    clock = Clock()
    clock.play(operations.job(clock.policy(), job_id), job("queued"))
    path = clock.sent[0].call.path

    assert path.startswith("/v1/jobs/")
    assert path.count("/") == 3
    assert not set("?# ") & set(path)
