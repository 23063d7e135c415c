"""Both clients against a real HTTP server that misbehaves as told."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import threading
import time
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import millpond
import pytest

from tests.service.client_server import Answer, ScriptedServer, as_json, problem

Talk = Callable[..., Any]
COUNTS = {"total": 4, "done": 0, "failed": 0, "pending": 4, "leased": 0}
JOB = {"id": "a1", "kind": "turntable", "state": "queued", "counts": COUNTS}


def digest(body: bytes) -> str:
    return f"sha-256=:{base64.b64encode(hashlib.sha256(body).digest()).decode()}:"


def image(body: bytes = b"image", **facts: Any) -> Answer:
    return Answer(200, body, {"Content-Type": "image/png", "Repr-Digest": digest(body), "X-Frame-Key": "k"}, **facts)


@pytest.fixture
def serve() -> Iterator[Callable[..., ScriptedServer]]:
    """Starts a server with these answers."""
    with ExitStack() as stack:
        yield lambda *answers: stack.enter_context(ScriptedServer(*answers).running())


def blocking(url: str, method: str, /, *arguments: Any, options: dict[str, Any] | None = None, **named: Any) -> Any:
    with millpond.Millpond(url, **(options or {})) as client:
        return getattr(client, method)(*arguments, **named)


def awaited(url: str, method: str, /, *arguments: Any, options: dict[str, Any] | None = None, **named: Any) -> Any:
    async def talk() -> Any:
        async with millpond.AsyncMillpond(url, **(options or {})) as client:
            return await getattr(client, method)(*arguments, **named)

    return asyncio.run(talk())


@pytest.fixture(params=[blocking, awaited])
def talk(request: pytest.FixtureRequest) -> Talk:
    """Calls one method of a client of either kind."""
    found: Talk = request.param
    return found


def test_a_frame_comes_with_its_headers(serve: Callable[..., ScriptedServer], talk: Talk) -> None:
    server = serve(image())
    frame = talk(server.url, "frame", {"water": "luna", "width": 3}, width=640, time=2)

    assert (frame.data, frame.key, frame.media_type) == (b"image", "k", "image/png")
    seen = server.seen[0]
    assert (seen.method, seen.path) == ("POST", "/v1/frame")
    assert seen.json == {"water": "luna", "width": 640, "time": 2}
    assert seen.headers["content-type"] == "application/json"
    assert seen.headers["accept-encoding"] == "identity"
    assert seen.headers["user-agent"] == f"millpond-python/{millpond.__version__}"


def test_the_api_key_travels_in_its_header_and_nowhere_without_one(
    serve: Callable[..., ScriptedServer], talk: Talk
) -> None:
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
def test_what_passes_is_tried_again(serve: Callable[..., ScriptedServer], talk: Talk, failure: Answer) -> None:
    server = serve(failure, failure, image())

    assert talk(server.url, "frame").data == b"image"
    assert len(server.seen) == 3


def test_retry_after_is_waited_for(serve: Callable[..., ScriptedServer], talk: Talk) -> None:
    server = serve(problem(503, retry_after=1), image())
    begun = time.monotonic()

    assert talk(server.url, "frame").data == b"image"
    assert 1.0 <= time.monotonic() - begun < 5.0


def test_a_retry_after_beyond_the_timeout_fails_at_once(serve: Callable[..., ScriptedServer], talk: Talk) -> None:
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
def test_what_does_not_pass_fails_in_the_end(
    serve: Callable[..., ScriptedServer], talk: Talk, failure: Answer, kind: type[Exception]
) -> None:
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
def test_an_answer_without_end_ends_at_the_timeout(
    serve: Callable[..., ScriptedServer], talk: Talk, answer: Answer
) -> None:
    server = serve(answer)
    begun = time.monotonic()

    with pytest.raises(millpond.TimedOut, match="no complete answer"):
        talk(server.url, "frame", options={"timeout": 0.6})
    assert 0.5 < time.monotonic() - begun < 1.6


def test_an_invalid_request_names_its_field(serve: Callable[..., ScriptedServer], talk: Talk) -> None:
    server = serve(problem(422, errors=[{"path": "width", "message": "too wide", "value": 10**5, "bound": "<= 4096"}]))

    with pytest.raises(millpond.InvalidRequest, match="width: too wide") as caught:
        talk(server.url, "frame", width=100_000)
    assert caught.value.errors[0].value == 100_000
    assert len(server.seen) == 1


def test_a_redirection_is_not_followed_with_the_key(serve: Callable[..., ScriptedServer], talk: Talk) -> None:
    elsewhere = serve(image())
    server = serve(Answer(307, b"", {"Location": elsewhere.url}))

    with pytest.raises(millpond.Problem, match=elsewhere.url):
        talk(server.url, "frame", options={"api_key": "secret"})
    assert elsewhere.seen == []


def test_loopback_is_not_asked_through_a_proxy(
    serve: Callable[..., ScriptedServer], talk: Talk, monkeypatch: pytest.MonkeyPatch
) -> None:
    proxy, server = serve(Answer(500)), serve(image())
    monkeypatch.setenv("HTTP_PROXY", proxy.url)
    monkeypatch.setenv("ALL_PROXY", proxy.url)

    assert talk(server.url, "frame").data == b"image"
    assert proxy.seen == []


def test_a_base_url_may_have_a_path(serve: Callable[..., ScriptedServer], talk: Talk) -> None:
    server = serve(image())
    for url in (f"{server.url}/mill", f"{server.url}/mill/"):
        talk(url, "frame")

    assert [seen.path for seen in server.seen] == ["/mill/v1/frame"] * 2


def test_a_lost_answer_does_not_submit_a_job_twice(serve: Callable[..., ScriptedServer], talk: Talk) -> None:
    server = serve(Answer(drops=True), problem(503, retry_after=0), as_json(JOB, 202))
    job = talk(server.url, "turntable_job", {"width": 64}, frames=4, loop=False, outputs=["mp4"])

    assert (job.id, job.state, job.counts["total"], job.is_over) == ("a1", "queued", 4, False)
    assert len({seen.headers["idempotency-key"] for seen in server.seen}) == 1
    assert server.seen[0].json == {
        "kind": "turntable", "frame": {"width": 64}, "turntable": {"frames": 4, "loop": False}, "outputs": ["mp4"],
    }  # fmt: skip


def test_a_turntable_is_one_answer_in_memory_or_on_disk(
    serve: Callable[..., ScriptedServer], talk: Talk, tmp_path: Path
) -> None:
    server = serve(Answer(200, b"movie", {"Content-Type": "video/mp4"}))
    movie = talk(server.url, "turntable", {"width": 64}, frames=4)
    path = talk(server.url, "turntable", frames=4, format="zip", path=tmp_path / "frames.zip")

    assert (movie.data, movie.media_type) == (b"movie", "video/mp4")
    assert "<video" in movie._repr_html_()
    assert path.read_bytes() == b"movie"
    assert server.seen[1].json == {"frame": {}, "turntable": {"frames": 4}, "format": "zip"}


@pytest.mark.parametrize(
    "answer",
    [image(b"y" * 9, missing=3), image(b"y" * 50, trickles=0.05), problem(409, detail="3 of 4"),
     Answer(200, b"yyy", {"Repr-Digest": digest(b"zzz")})],
    ids=["cut short", "too slow", "not finished", "damaged"],
)  # fmt: skip
def test_a_download_that_fails_leaves_the_folder_as_it_was(
    serve: Callable[..., ScriptedServer], talk: Talk, tmp_path: Path, answer: Answer
) -> None:
    (tmp_path / "movie.mp4").write_bytes(b"older")
    server = serve(answer)

    with pytest.raises(millpond.MillpondError):
        talk(server.url, "turntable", path=tmp_path / "movie.mp4", options={"retries": 0, "timeout": 0.6})
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"older"]


def test_a_large_download_takes_little_memory(serve: Callable[..., ScriptedServer], tmp_path: Path) -> None:
    body = bytes(48 << 20)
    server = serve(as_json({**JOB, "state": "succeeded"}), Answer(200, body))
    with millpond.Millpond(server.url) as client:
        job = client.job("a1")
        tracemalloc.start()
        job.result("zip", tmp_path / "all.zip")
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()

    assert (tmp_path / "all.zip").stat().st_size == len(body)
    assert peak < 4 << 20
    assert server.seen[1].path == "/v1/jobs/a1/result.zip"


def test_an_exception_cancels_the_job_it_leaves_behind(serve: Callable[..., ScriptedServer]) -> None:
    server = serve(as_json(JOB), as_json({**JOB, "state": "cancelled"}))
    with millpond.Millpond(server.url) as client:
        job = client.job("a1")
        with pytest.raises(KeyboardInterrupt), job:
            raise KeyboardInterrupt

    assert job.state == "cancelled"
    assert (server.seen[-1].method, server.seen[-1].path) == ("POST", "/v1/jobs/a1/cancel")


def test_an_exception_cancels_the_awaited_job_too(serve: Callable[..., ScriptedServer]) -> None:
    server = serve(as_json(JOB), as_json({**JOB, "state": "cancelled"}))

    async def talk() -> None:
        async with millpond.AsyncMillpond(server.url) as client, await client.job("a1"):
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        asyncio.run(talk())
    assert server.seen[-1].path == "/v1/jobs/a1/cancel"


@pytest.mark.parametrize("state", ["running", "succeeded"])
def test_a_job_that_is_left_in_peace_is_not_cancelled(serve: Callable[..., ScriptedServer], state: str) -> None:
    server = serve(as_json({**JOB, "state": state}))
    with millpond.Millpond(server.url) as client:
        with client.job("a1"):
            pass
        if state == "succeeded":
            with pytest.raises(ZeroDivisionError), client.job("a1"):
                raise ZeroDivisionError

    assert {seen.method for seen in server.seen} == {"GET"}


def test_a_cancel_that_fails_does_not_hide_the_exception(serve: Callable[..., ScriptedServer]) -> None:
    server = serve(as_json(JOB), problem(404))
    with millpond.Millpond(server.url) as client, pytest.raises(ZeroDivisionError) as caught, client.job("a1"):
        raise ZeroDivisionError

    assert any("could not be cancelled" in note for note in caught.value.__notes__)


def test_the_files_of_a_job_have_their_places(serve: Callable[..., ScriptedServer], tmp_path: Path) -> None:
    server = serve(as_json({**JOB, "state": "succeeded"}), image(b"bytes"))
    with millpond.Millpond(server.url) as client:
        job = client.job("a1")
        assert job.frame(3).data == b"bytes"
        assert job.frame(3, "jpg").key == "k"
        assert job.result("mp4") == b"bytes"
        assert job.contact_sheet().data == b"bytes"
        assert job.contact_sheet(tmp_path / "sheet.png").read_bytes() == b"bytes"

    assert [seen.path.removeprefix("/v1/jobs/a1/") for seen in server.seen[1:]] == [
        "frames/3.png", "frames/3.jpg", "result.mp4", "contact-sheet.png", "contact-sheet.png",
    ]  # fmt: skip


def test_waiting_keeps_the_job_up_to_date(serve: Callable[..., ScriptedServer]) -> None:
    done = {**JOB, "state": "succeeded", "counts": {**COUNTS, "done": 4}}
    server = serve(as_json(JOB), as_json({**JOB, "state": "running"}), as_json(done))
    with millpond.Millpond(server.url) as client:
        job = client.job("a1").wait(progress=False, timeout=30)

    assert (job.state, job.counts["done"], job.is_over) == ("succeeded", 4, True)


def test_one_client_serves_many_threads(serve: Callable[..., ScriptedServer]) -> None:
    server = serve(image())
    got: list[bytes] = []
    with millpond.Millpond(server.url) as client:
        threads = [threading.Thread(target=lambda: got.append(client.frame().data)) for _ in range(16)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    assert got == [b"image"] * 16
