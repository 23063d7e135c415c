"""The client's protocol without a network: when it tries again, what it makes of refusals."""

from __future__ import annotations

import inspect
import json
import pickle
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from typing import Any

import millpond
import pytest
from millpond.exchange import Call, Policy, Reply, ask, problem_of, retry_after_of

from tests.service.client_clock import OK, Clock, refusal

CALL = Call("GET", "/v1/thing")


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
