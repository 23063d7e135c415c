"""The client's protocol without a network: when it tries again, what it makes of answers."""

from __future__ import annotations

import inspect
import json
import pickle
import warnings
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from typing import Any, TypeVar

import millpond
import numpy as np
import pytest
from millpond import operations
from millpond.exchange import Call, Policy, Reply, Script, Send, Sleep, ask, problem_of, retry_after_of

T = TypeVar("T")
CALL = Call("GET", "/v1/thing")


class Clock:
    """Time that passes when a script sleeps, and by ``cost`` for each call."""

    def __init__(self, cost: float = 0.0) -> None:
        self.now = 1000.0
        self.cost = cost
        self.slept: list[float] = []
        self.sent: list[Send] = []

    def policy(self, timeout: float = 60.0, retries: int = 5, jitter: float = 1.0) -> Policy:
        return Policy(timeout, retries, lambda: self.now, lambda: jitter)

    def play(self, script: Script[T], *answers: Reply | Exception) -> T:
        """Carry a script out with these answers; the last is repeated for ever."""
        left: list[Reply | Exception] = list(answers)
        given: Reply | Exception | None = None
        while True:
            try:
                step = script.throw(given) if isinstance(given, Exception) else script.send(given)
            except StopIteration as stop:
                result: T = stop.value
                return result
            if isinstance(step, Sleep):
                self.slept.append(step.seconds)
                self.now += step.seconds
                given = None
            else:
                self.sent.append(step)
                self.now += self.cost
                given = left.pop(0) if len(left) > 1 else left[0]


def refusal(status: int, **headers: str) -> Reply:
    return Reply(status, {name.replace("_", "-"): value for name, value in headers.items()}, b"{}")


def job(state: str, done: int = 0, **facts: Any) -> Reply:
    counts = {"total": 4, "done": done, "failed": 0, "pending": 4 - done, "leased": 0}
    return Reply(
        200, {}, json.dumps({"id": "a", "kind": "turntable", "state": state, "counts": counts, **facts}).encode()
    )


OK = Reply(200, {}, b'{"fine": true}')


def test_a_good_answer_is_returned_at_once() -> None:
    clock = Clock()

    assert clock.play(ask(CALL, clock.policy()), OK) is OK
    assert (len(clock.sent), clock.slept) == (1, [])


@pytest.mark.parametrize(
    "failure", [millpond.ConnectionFailed("gone"), millpond.Damaged("bits"), refusal(429), refusal(503)]
)
def test_what_may_pass_is_tried_again_after_growing_pauses(failure: Reply | Exception) -> None:
    clock = Clock()

    assert clock.play(ask(CALL, clock.policy()), failure, failure, failure, OK) is OK
    assert clock.slept == [0.25, 0.5, 1.0]


@pytest.mark.parametrize("status", [301, 400, 401, 403, 404, 409, 410, 413, 422, 500, 502, 504])
def test_what_will_not_pass_is_not_tried_again(status: int) -> None:
    clock = Clock()

    with pytest.raises(millpond.Problem) as caught:
        clock.play(ask(CALL, clock.policy()), refusal(status), OK)
    assert caught.value.status == status
    assert len(clock.sent) == 1


def test_retry_after_is_honoured_to_the_second() -> None:
    clock = Clock()

    assert clock.play(ask(CALL, clock.policy()), refusal(503, retry_after="7"), refusal(429, retry_after="3"), OK) is OK
    assert clock.slept == [7.0, 3.0]


@pytest.mark.parametrize(("asked", "timeout"), [("61", 60.0), ("121", 10_000.0), ("99999999999", 10_000.0)])
def test_a_pause_that_does_not_fit_ends_the_trying_at_once(asked: str, timeout: float) -> None:
    clock = Clock()

    with pytest.raises(millpond.Unavailable) as caught:
        clock.play(ask(CALL, clock.policy(timeout)), refusal(503, retry_after=asked), OK)
    assert caught.value.retry_after == float(asked)
    assert clock.slept == []


def test_the_number_of_tries_is_bounded() -> None:
    clock = Clock()

    with pytest.raises(millpond.TooManyRequests):
        clock.play(ask(CALL, clock.policy(retries=3)), refusal(429))
    assert len(clock.sent) == 4


def test_the_whole_time_is_bounded_and_each_try_gets_what_is_left() -> None:
    clock = Clock(cost=3.0)

    with pytest.raises(millpond.ConnectionFailed):
        clock.play(ask(CALL, clock.policy(timeout=10.0, retries=1000)), millpond.ConnectionFailed("gone"))
    assert clock.now <= 1000.0 + 10.0
    assert [step.seconds for step in clock.sent] == [10.0, 6.75, 3.25]


def test_jitter_spreads_pauses_over_their_upper_half() -> None:
    assert Policy(jitter=lambda: 0.0).backoff(2) == 0.5
    assert Policy(jitter=lambda: 1.0).backoff(2) == 1.0
    assert Policy(jitter=lambda: 1.0).backoff(60) == 8.0
    assert len({Policy().backoff(3) for _ in range(20)}) > 1


def test_a_retry_after_may_be_a_date() -> None:
    soon = format_datetime(datetime.now(UTC) + timedelta(seconds=30), usegmt=True)
    past = format_datetime(datetime.now(UTC) - timedelta(days=3), usegmt=True)

    assert retry_after_of({"retry-after": soon}) == pytest.approx(30, abs=2)
    assert retry_after_of({"retry-after": past}) == 0.0


@pytest.mark.parametrize("text", ["", "soon", "-3", "1.5", "NaN", "12 apples"])
def test_a_retry_after_that_says_nothing_is_none(text: str) -> None:
    assert retry_after_of({"retry-after": text}) is None


KINDS = {
    401: millpond.Unauthorized, 403: millpond.Forbidden, 404: millpond.NotFound, 409: millpond.Conflict,
    410: millpond.Gone, 422: millpond.InvalidRequest, 429: millpond.TooManyRequests, 503: millpond.Unavailable,
    400: millpond.Problem, 500: millpond.Problem, 418: millpond.Problem, 599: millpond.Problem,
}  # fmt: skip


@pytest.mark.parametrize(("status", "kind"), KINDS.items())
def test_each_status_has_its_class(status: int, kind: type[millpond.Problem]) -> None:
    assert type(problem_of(refusal(status))) is kind


def test_a_problem_tells_all_that_the_service_told() -> None:
    errors = [{"path": "water.refraction_bias", "message": "too large", "value": 9, "bound": "<= 1"}, {"path": "eye"}]
    body = {
        "type": "/problems/invalid-request",
        "title": "Not valid",
        "detail": "d",
        "errors": errors,
        "request_id": "r",
    }
    found = problem_of(Reply(422, {}, json.dumps(body).encode()))

    assert found.errors[0] == millpond.FieldError("water.refraction_bias", "too large", 9, "<= 1")
    assert (found.type, found.title, found.detail) == ("/problems/invalid-request", "Not valid", "d")
    assert found.body["request_id"] == "r"
    assert "water.refraction_bias: too large (allowed: <= 1)" in str(found)


@pytest.mark.parametrize(
    "body",
    [b"", b"<html>Bad gateway</html>", b"[1, 2]", b"\xff\xfe", b'{"errors": 3}', b'{"errors": [1, {}]}', b"x" * 10**6],
)
def test_an_error_that_is_no_problem_json_is_still_a_problem(body: bytes) -> None:
    found = problem_of(Reply(502, {}, body))

    assert found.status == 502
    assert "502 Bad Gateway" in str(found)
    assert len(str(found)) < 1000


def test_a_redirection_names_the_place() -> None:
    assert "https://elsewhere.example/" in str(problem_of(Reply(301, {"location": "https://elsewhere.example/"})))


@pytest.mark.parametrize(
    "error",
    [
        problem_of(refusal(422)),
        millpond.JobFailed({"id": "a", "state": "failed"}),
        millpond.TimedOut("late"),
        millpond.ConnectionFailed(),
    ],
)
def test_errors_survive_pickling(error: millpond.MillpondError) -> None:
    back = pickle.loads(pickle.dumps(error))  # noqa: S301 -- made just now

    assert (type(back), str(back), vars(back)) == (type(error), str(error), vars(error))


def test_an_error_without_words_says_what_its_class_says() -> None:
    assert str(millpond.TimedOut()) == "There was no end within the time allowed."


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


@pytest.mark.parametrize("url", ["127.0.0.1:8000", "", "ftp://pond.example", "http://", "/v1"])
def test_what_is_no_address_is_refused(url: str) -> None:
    with pytest.raises(ValueError, match="no address"):
        millpond.Millpond(url)


@pytest.mark.parametrize("timeout", [0, -1, float("nan"), float("inf")])
def test_a_timeout_is_finite_and_above_zero(timeout: float) -> None:
    with pytest.raises(ValueError, match="timeout"):
        millpond.Millpond(timeout=timeout)


def public(kind: type) -> Iterator[tuple[str, Callable[..., Any]]]:
    return ((name, value) for name, value in vars(kind).items() if not name.startswith("_") and callable(value))


@pytest.mark.parametrize(
    ("blocking", "awaited"), [(millpond.Millpond, millpond.AsyncMillpond), (millpond.Job, millpond.AsyncJob)]
)
def test_the_two_clients_are_twins(blocking: type, awaited: type) -> None:
    def shape(method: Callable[..., Any]) -> list[tuple[str, Any, Any]]:
        return [(item.name, item.kind, item.default) for item in inspect.signature(method).parameters.values()]

    assert {name: shape(method) for name, method in public(blocking)} == {
        name: shape(method) for name, method in public(awaited)
    }
    assert all(inspect.iscoroutinefunction(method) for _, method in public(awaited))
