"""Frames over HTTP: both clients against a real server that misbehaves as told."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack

import millpond
import pytest

from tests.service.client_server import Answer, ScriptedServer, problem
from tests.service.client_talk import Serve, Talk, awaited, blocking, digest, image


@pytest.fixture
def serve() -> Iterator[Serve]:
    """Starts a server with these answers."""
    with ExitStack() as stack:
        yield lambda *answers: stack.enter_context(ScriptedServer(*answers).running())


@pytest.fixture(params=[blocking, awaited])
def talk(request: pytest.FixtureRequest) -> Talk:
    """Calls one method of a client of either kind."""
    found: Talk = request.param
    return found


def test_a_frame_comes_with_its_headers(serve: Serve, talk: Talk) -> None:
    server = serve(image())
    frame = talk(server.url, "frame", {"water": "luna", "width": 3}, width=640, time=2)

    assert (frame.data, frame.key, frame.media_type) == (b"image", "k", "image/png")
    seen = server.seen[0]
    assert (seen.method, seen.path) == ("POST", "/v1/frame")
    assert seen.json == {"water": "luna", "width": 640, "time": 2}
    assert seen.headers["content-type"] == "application/json"
    assert seen.headers["accept-encoding"] == "identity"
    assert seen.headers["user-agent"] == f"millpond-python/{millpond.__version__}"


def test_the_api_key_travels_in_its_header_and_nowhere_without_one(serve: Serve, talk: Talk) -> None:
    server = serve(image())
    talk(server.url, "frame", options={"api_key": "secret"})
    talk(server.url, "frame")

    assert server.seen[0].headers["authorization"] == "Bearer secret"
    assert "authorization" not in server.seen[1].headers
    assert "secret" not in server.seen[0].path


@pytest.mark.parametrize(
    "failure",
    [
        Answer(drops=True),
        image(missing=3),
        Answer(200, b"imagf", {"Repr-Digest": digest(b"image")}),
        problem(503, retry_after=0),
        problem(429, retry_after=0),
        problem(503),
    ],
    ids=["dropped", "cut short", "damaged", "503", "429", "503 without Retry-After"],
)
def test_what_passes_is_tried_again(serve: Serve, talk: Talk, failure: Answer) -> None:
    server = serve(failure, failure, image())

    assert talk(server.url, "frame").data == b"image"
    assert len(server.seen) == 3


def test_retry_after_is_waited_for(serve: Serve, talk: Talk) -> None:
    server = serve(problem(503, retry_after=1), image())
    begun = time.monotonic()

    assert talk(server.url, "frame").data == b"image"
    assert 1.0 <= time.monotonic() - begun < 5.0


def test_a_retry_after_beyond_the_timeout_fails_at_once(serve: Serve, talk: Talk) -> None:
    server = serve(problem(503, retry_after=30, detail="full"))
    begun = time.monotonic()

    with pytest.raises(millpond.Unavailable, match="full"):
        talk(server.url, "frame", options={"timeout": 5})
    assert time.monotonic() - begun < 3.0
    assert len(server.seen) == 1


@pytest.mark.parametrize(
    ("failure", "kind"),
    [
        (Answer(drops=True), millpond.ConnectionFailed),
        (image(missing=3), millpond.ConnectionFailed),
        (Answer(200, b"imagf", {"Repr-Digest": digest(b"image")}), millpond.Damaged),
    ],
    ids=["dropped", "cut short", "damaged"],
)
def test_what_does_not_pass_fails_in_the_end(serve: Serve, talk: Talk, failure: Answer, kind: type[Exception]) -> None:
    server = serve(failure)

    with pytest.raises(kind):
        talk(server.url, "frame", options={"retries": 1})
    assert len(server.seen) == 2


def test_nobody_there_is_a_clear_error(talk: Talk) -> None:
    with ScriptedServer(image()).running() as server:
        url = server.url

    with pytest.raises(millpond.ConnectionFailed, match="POST /v1/frame"):
        talk(url, "frame", options={"retries": 1})
    assert talk(url, "ready") is False


@pytest.mark.parametrize(
    "answer",
    [
        image(b"x" * 10, stalls=30),
        image(b"x" * 200, trickles=0.05),
        Answer(200, b"", {"Content-Length": "9"}, stalls=30),
    ],
    ids=["stalls", "trickles", "no body"],
)
def test_an_answer_without_end_ends_at_the_timeout(serve: Serve, talk: Talk, answer: Answer) -> None:
    server = serve(answer)
    begun = time.monotonic()

    with pytest.raises(millpond.TimedOut, match="no complete answer"):
        talk(server.url, "frame", options={"timeout": 0.6})
    assert 0.5 < time.monotonic() - begun < 1.6


def test_an_invalid_request_names_its_field(serve: Serve, talk: Talk) -> None:
    server = serve(problem(422, errors=[{"path": "width", "message": "too wide", "value": 10**5, "bound": "<= 4096"}]))

    with pytest.raises(millpond.InvalidRequest, match="width: too wide") as caught:
        talk(server.url, "frame", width=100_000)
    assert caught.value.errors[0].value == 100_000
    assert len(server.seen) == 1


def test_a_redirection_is_not_followed_with_the_key(serve: Serve, talk: Talk) -> None:
    elsewhere = serve(image())
    server = serve(Answer(307, b"", {"Location": elsewhere.url}))

    with pytest.raises(millpond.Problem, match=elsewhere.url):
        talk(server.url, "frame", options={"api_key": "secret"})
    assert elsewhere.seen == []


def test_loopback_is_not_asked_through_a_proxy(serve: Serve, talk: Talk, monkeypatch: pytest.MonkeyPatch) -> None:
    proxy, server = serve(Answer(500)), serve(image())
    monkeypatch.setenv("HTTP_PROXY", proxy.url)
    monkeypatch.setenv("ALL_PROXY", proxy.url)

    assert talk(server.url, "frame").data == b"image"
    assert proxy.seen == []


def test_a_base_url_may_have_a_path(serve: Serve, talk: Talk) -> None:
    server = serve(image())
    for url in (f"{server.url}/mill", f"{server.url}/mill/"):
        talk(url, "frame")

    assert [seen.path for seen in server.seen] == ["/mill/v1/frame"] * 2
