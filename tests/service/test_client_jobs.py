"""Jobs and downloads over HTTP: both clients against a real server that misbehaves as told."""

from __future__ import annotations

import asyncio
import threading
import tracemalloc
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import millpond
import pytest

from tests.service.client_server import Answer, ScriptedServer, as_json, problem
from tests.service.client_talk import Serve, Talk, awaited, blocking, digest, image

COUNTS = {"total": 4, "done": 0, "failed": 0, "pending": 4, "leased": 0}
JOB = {"id": "a1", "kind": "turntable", "state": "queued", "counts": COUNTS}


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


def test_a_lost_answer_does_not_submit_a_job_twice(serve: Serve, talk: Talk) -> None:
    server = serve(Answer(drops=True), problem(503, retry_after=0), as_json(JOB, 202))
    job = talk(server.url, "turntable_job", {"width": 64}, frames=4, loop=False, outputs=["mp4"])

    assert (job.id, job.state, job.counts["total"], job.is_over) == ("a1", "queued", 4, False)
    assert len({seen.headers["idempotency-key"] for seen in server.seen}) == 1
    assert server.seen[0].json == {
        "kind": "turntable", "frame": {"width": 64}, "turntable": {"frames": 4, "loop": False}, "outputs": ["mp4"],
    }  # fmt: skip


def test_a_turntable_is_one_answer_in_memory_or_on_disk(serve: Serve, talk: Talk, tmp_path: Path) -> None:
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
    serve: Serve, talk: Talk, tmp_path: Path, answer: Answer
) -> None:
    (tmp_path / "movie.mp4").write_bytes(b"older")
    server = serve(answer)

    with pytest.raises(millpond.MillpondError):
        talk(server.url, "turntable", path=tmp_path / "movie.mp4", options={"retries": 0, "timeout": 0.6})
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"older"]


def test_a_large_download_takes_little_memory(serve: Serve, tmp_path: Path) -> None:
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


def test_an_exception_cancels_the_job_it_leaves_behind(serve: Serve) -> None:
    server = serve(as_json(JOB), as_json({**JOB, "state": "cancelled"}))
    with millpond.Millpond(server.url) as client:
        job = client.job("a1")
        with pytest.raises(KeyboardInterrupt), job:
            raise KeyboardInterrupt

    assert job.state == "cancelled"
    assert (server.seen[-1].method, server.seen[-1].path) == ("POST", "/v1/jobs/a1/cancel")


def test_an_exception_cancels_the_awaited_job_too(serve: Serve) -> None:
    server = serve(as_json(JOB), as_json({**JOB, "state": "cancelled"}))

    async def talk() -> None:
        async with millpond.AsyncMillpond(server.url) as client, await client.job("a1"):
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        asyncio.run(talk())
    assert server.seen[-1].path == "/v1/jobs/a1/cancel"


@pytest.mark.parametrize("state", ["running", "succeeded"])
def test_a_job_that_is_left_in_peace_is_not_cancelled(serve: Serve, state: str) -> None:
    server = serve(as_json({**JOB, "state": state}))
    with millpond.Millpond(server.url) as client:
        with client.job("a1"):
            pass
        if state == "succeeded":
            with pytest.raises(ZeroDivisionError), client.job("a1"):
                raise ZeroDivisionError

    assert {seen.method for seen in server.seen} == {"GET"}


def test_a_cancel_that_fails_does_not_hide_the_exception(serve: Serve) -> None:
    server = serve(as_json(JOB), problem(404))
    with millpond.Millpond(server.url) as client, pytest.raises(ZeroDivisionError) as caught, client.job("a1"):
        raise ZeroDivisionError

    assert any("could not be cancelled" in note for note in caught.value.__notes__)


def test_the_files_of_a_job_have_their_places(serve: Serve, tmp_path: Path) -> None:
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


def test_waiting_keeps_the_job_up_to_date(serve: Serve) -> None:
    done = {**JOB, "state": "succeeded", "counts": {**COUNTS, "done": 4}}
    server = serve(as_json(JOB), as_json({**JOB, "state": "running"}), as_json(done))
    with millpond.Millpond(server.url) as client:
        job = client.job("a1").wait(progress=False, timeout=30)

    assert (job.state, job.counts["done"], job.is_over) == ("succeeded", 4, True)


def test_one_client_serves_many_threads(serve: Serve) -> None:
    server = serve(image())
    got: list[bytes] = []
    with millpond.Millpond(server.url) as client:
        threads = [threading.Thread(target=lambda: got.append(client.frame().data)) for _ in range(16)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    assert got == [b"image"] * 16
