"""The client against the real service, on a real port."""

from __future__ import annotations

import asyncio
import hashlib
import io
import zipfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import httpx
import millpond
import numpy as np
import pytest

from renderer.encode.verify import verify_movie
from renderer.request import FrameRequest
from tests.service.conftest import Server

SMALL: millpond.FrameRequest = {"width": 64, "height": 36, "msaa": 1}


@pytest.fixture
def pond(server: Server) -> Iterator[millpond.Millpond]:
    """A client of the shared server."""
    with millpond.Millpond(server.url) as client:
        yield client


def test_a_frame_has_its_pixels_and_its_provenance(pond: millpond.Millpond) -> None:
    frame = pond.frame(SMALL, water="luna", time=2)

    assert frame.array.shape == (36, 64, 3)
    assert frame.array.std() > 5
    assert frame.request is not None
    assert frame.key == FrameRequest.parse(frame.request).key()
    assert frame.request["time"] == 2
    assert set(frame.timings) == {"queue", "render", "encode"}
    assert frame.renderer
    assert frame.fingerprint
    assert frame.headers["repr-digest"].startswith("sha-256=:")


def test_every_way_to_ask_gives_the_same_bytes(pond: millpond.Millpond, server: Server) -> None:
    async def awaited() -> bytes:
        async with millpond.AsyncMillpond(server.url) as client:
            return (await client.frame({"width": 64, "height": 36, "msaa": 1, "time": 3.0})).data

    frame = pond.frame(SMALL, time=3)
    assert frame.request is not None
    again = pond.frame({**frame.request, "ambient": np.array(frame.request["ambient"])})

    assert asyncio.run(awaited()) == frame.data
    assert again.data == frame.data
    assert httpx.get(f"{server.url}{frame.url}").content == frame.data


@pytest.mark.parametrize("name", ["png", "jpeg", "webp"])
def test_every_format_is_read_back(pond: millpond.Millpond, name: str) -> None:
    frame = pond.frame({**SMALL, "format": name})

    assert frame.media_type == f"image/{name}"
    assert frame.array.shape == (36, 64, 3)
    assert frame.request is not None
    assert frame.request["format"] == name


def test_mistakes_are_named_by_their_path(pond: millpond.Millpond) -> None:
    with pytest.raises(millpond.InvalidRequest) as caught:
        pond.frame({"width": -1, "time": float("nan"), "colour": 1})

    assert {error.path for error in caught.value.errors} == {"width", "time", "colour"}
    assert caught.value.type == "/problems/invalid-request"


def test_the_service_says_what_it_is_and_that_it_is_ready(pond: millpond.Millpond) -> None:
    pond.wait_ready(30)

    assert pond.ready() is True
    assert pond.info()["name"] == "millpond"


def test_a_turntable_comes_as_a_movie_and_as_an_archive(pond: millpond.Millpond, tmp_path: Path) -> None:
    path = pond.turntable(SMALL, frames=6, fps=12, path=tmp_path / "turn.mp4")
    archive = pond.turntable(SMALL, frames=6, fps=12, format="zip")

    assert verify_movie(path, 6, 12, 64, 36).frames == 6
    with zipfile.ZipFile(io.BytesIO(archive.data)) as files:
        assert files.testzip() is None
        assert len([name for name in files.namelist() if name.endswith(".png")]) == 6


def test_a_job_from_its_submission_to_its_movie(pond: millpond.Millpond, tmp_path: Path) -> None:
    with pond.turntable_job(SMALL, frames=8, fps=12, outputs=["mp4"]) as job:
        assert not job.is_over
        job.wait(progress=False, timeout=120)
    frames = job.frames()

    assert (job.state, job.counts["done"]) == ("succeeded", 8)
    assert [frame["index"] for frame in frames] == list(range(8))
    assert {frame["state"] for frame in frames} == {"done"}
    third = job.frame(3)
    assert third.key == frames[3]["key"]
    assert hashlib.sha256(third.data).hexdigest() in str(frames[3]["digest"])
    assert third.data == pond.frame(third.request or {}).data
    assert verify_movie(job.result("mp4", tmp_path / "turn.mp4"), 8, 12, 64, 36).frames == 8
    assert job.result("mp4") == (tmp_path / "turn.mp4").read_bytes()
    assert zipfile.ZipFile(io.BytesIO(job.result("zip"))).testzip() is None
    assert job.contact_sheet().width > 500
    assert pond.job(job.id).state == "succeeded"


def test_the_same_idempotency_key_is_the_same_job(pond: millpond.Millpond) -> None:
    first = pond.turntable_job(SMALL, frames=4, idempotency_key="client-test")
    second = pond.turntable_job(SMALL, frames=4, idempotency_key="client-test")
    third = pond.turntable_job(SMALL, frames=4)

    assert first.id == second.id != third.id
    for job in (first, third):
        job.wait(progress=False, timeout=120)


def test_a_job_that_an_exception_leaves_is_cancelled(pond: millpond.Millpond) -> None:
    job = pond.turntable_job(SMALL, frames=60)
    with pytest.raises(ZeroDivisionError), job:
        raise ZeroDivisionError

    assert job.state == "cancelled"
    assert job.refresh().is_over
    with pytest.raises(millpond.JobFailed, match="cancelled"):
        job.wait(progress=False, timeout=30)


def test_a_movie_before_its_last_frame_is_a_conflict(pond: millpond.Millpond) -> None:
    with pond.turntable_job({**SMALL, "samples": 16}, frames=60) as job:
        with pytest.raises(millpond.Conflict):
            job.result("mp4")
        job.cancel()


def test_a_job_that_is_not_there_is_not_found(pond: millpond.Millpond) -> None:
    with pytest.raises(millpond.NotFound):
        pond.job("nobody")


def test_the_awaited_job_is_the_blocking_jobs_twin(server: Server) -> None:
    async def talk() -> tuple[str, int, bytes]:
        async with millpond.AsyncMillpond(server.url) as client:
            async with await client.turntable_job(SMALL, frames=4, fps=12) as job:
                await job.wait(progress=False, timeout=120)
            return job.state, len(await job.frames()), (await job.frame(0)).data

    state, count, data = asyncio.run(talk())

    assert (state, count) == ("succeeded", 4)
    assert data.startswith(b"\x89PNG")


@pytest.mark.slow  # a server of its own
def test_a_key_opens_a_server_that_asks_for_one(
    start_server: Callable[..., AbstractContextManager[Server]],
) -> None:
    with start_server("--api-keys=opensesame") as server:
        with millpond.Millpond(server.url) as stranger, pytest.raises(millpond.Unauthorized):
            stranger.frame(SMALL)
        with millpond.Millpond(server.url, api_key="opensesame") as guest:
            assert guest.frame(SMALL).array.shape == (36, 64, 3)
