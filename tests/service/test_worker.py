"""The worker with the real renderer: same bytes everywhere, whatever happens to processes."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import signal
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from PIL import Image

from renderer.encode.image import REQUEST_KEYWORD, read_png_text
from renderer.encode.png import encode_png
from renderer.errors import Cancelled, InvalidRequest
from renderer.source_digest import source_digest
from service import worker
from service.artifacts import LocalArtifacts, artifact_name
from service.engines.base import Lane
from service.engines.inline import InlineEngine
from service.engines.local import LocalEngine
from service.errors import EngineUnavailable, FrameError, WorkerDied
from service.frames import FrameCache
from service.jobs import Jobs
from service.jobs.job import FrameRecord
from service.worker import FrameTask, Worker, WorkerConfig, portable
from tests.service.core import eventually, frame, jobs_on, running, task, turntable


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("worker")


@pytest.fixture(scope="module")
def drawer(room: Path) -> Iterator[Worker]:
    made = Worker(WorkerConfig(room / "artifacts", threads=2))
    yield made
    made.close()


def test_a_frame_is_drawn_encoded_and_stored(drawer: Worker, room: Path) -> None:
    wanted = task(0.25)
    report = drawer.render(wanted)
    _, data = LocalArtifacts(room / "artifacts").read(artifact_name(wanted.key, report.fingerprint))
    with Image.open(room / "artifacts" / wanted.key[:2] / _only(room, wanted)) as image:
        pixels = np.asarray(image)

    assert pixels.shape == (36, 64, 3)
    assert pixels.std() > 5
    assert hashlib.sha256(data).hexdigest() == report.digest
    assert json.loads(read_png_text(data)[REQUEST_KEYWORD]) == json.loads(wanted.request)
    assert report.timings["render"] > 0
    assert report.pid == os.getpid()
    assert report.rss > 1 << 20


def _only(room: Path, wanted: FrameTask) -> str:
    (name,) = [path.name for path in (room / "artifacts" / wanted.key[:2]).glob(f"{wanted.key}-*")]
    return name


def test_a_frame_that_is_there_is_not_drawn_again(drawer: Worker) -> None:
    first, second = drawer.render(task(0.5)), drawer.render(task(0.5))

    assert first.timings != {}
    assert second.timings == {}
    assert second.digest == first.digest


def test_no_opengl_objects_are_left_by_a_frame(drawer: Worker) -> None:
    for moment in (1.0, 2.0):
        drawer.render(task(moment))
    before = drawer.render(task(3.0)).live_objects
    for moment in range(4, 24):
        after = drawer.render(task(float(moment))).live_objects

    assert after == before > 0


def test_a_cancelled_frame_stops_between_samples_and_stores_nothing(drawer: Worker, room: Path) -> None:
    request = frame(7.5, samples=8)
    asked: list[int] = []

    def is_cancelled() -> bool:
        asked.append(1)
        return len(asked) > 2

    with pytest.raises(Cancelled):
        drawer.render(FrameTask(request.key(), request.canonical(), source_digest(), 10.0), is_cancelled)
    assert LocalArtifacts(room / "artifacts").find(artifact_name(request.key(), drawer.facts.fingerprint)) is None


def test_a_frame_of_other_sources_is_refused(drawer: Worker) -> None:
    with pytest.raises(EngineUnavailable, match="restart"):
        drawer.render(replace(task(), sources="0" * 64))


def test_the_canary_is_compared_with_the_reference(
    drawer: Worker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pixels = drawer._renderer.render(worker.canary_request()).color
    reference = tmp_path / "canary.png"
    off = np.clip(pixels.astype(int) + np.where(pixels > 128, -7, 7), 0, 255).astype(np.uint8)
    found = []
    for image in (pixels, off):
        reference.write_bytes(encode_png(image, {}))
        monkeypatch.setattr(worker, "CANARY_REFERENCE", reference)
        found.append(drawer._draw_canary().canary_error)

    assert found == [0.0, 7.0]
    assert pixels.std() > 5


def test_drawing_does_not_depend_on_processes_lanes_or_order(drawer: Worker, tmp_path: Path) -> None:
    moments = [10.0, 11.0, 12.0]
    expected = [drawer.render(task(moment)).digest for moment in moments]
    with running(LocalEngine(tmp_path / "one", workers=1, interactive=False)) as engine:
        backwards = [engine.submit(task(moment), Lane.BATCH) for moment in reversed(moments)]
        batch = [future.result(60) for future in reversed(backwards)]
    with running(LocalEngine(tmp_path / "three", workers=2)) as engine:
        at_once = [engine.submit(task(moment), Lane.INTERACTIVE) for moment in moments]
        screen = [future.result(60) for future in at_once]
        canaries = {status.canary for status in engine.status()}

    assert [report.digest for report in batch] == [report.digest for report in screen] == expected
    assert len({report.pid for report in batch + screen}) >= 3
    assert canaries == {drawer.facts.canary}


def test_a_worker_killed_in_the_middle_of_a_job_changes_no_byte(drawer: Worker, tmp_path: Path) -> None:
    """SIGKILL in one job, SIGSTOP in the next: the frame at hand is drawn again, and both end as if nothing was."""
    records: list[FrameRecord] = []
    with running(LocalEngine(tmp_path / "artifacts", workers=2, interactive=False)) as engine:
        cache = FrameCache(engine, LocalArtifacts(tmp_path / "artifacts", budget=1 << 30))
        with jobs_on(cache, tmp_path) as jobs:
            for number in (signal.SIGKILL, signal.SIGSTOP):
                body = turntable(6, frame={"width": 64, "height": 36, "samples": 8, "time": float(number)})
                records += _struck(jobs, engine, body, number)
        counts = cache.flights.counts
        eventually(lambda: engine.readiness().is_ready)

    expected = [drawer.render(FrameTask(r.key, r.request, source_digest(), 60.0)).digest for r in records]
    assert [record.digest for record in records] == expected
    assert 1 <= counts.deaths <= 2
    assert counts.drawn == 12


def _struck(jobs: Jobs, engine: LocalEngine, body: dict[str, Any], number: signal.Signals) -> list[FrameRecord]:
    """The frames of a job that lost a worker on its way."""
    job_id = jobs.submit(body).job.id
    eventually(lambda: jobs.job(job_id).counts.done >= 1, 60)
    _strike(engine, number)
    eventually(lambda: jobs.job(job_id).job.finished is not None, 60)

    assert jobs.job(job_id).job.state == "succeeded"
    return jobs.store.frames(job_id)


def _strike(engine: LocalEngine, number: signal.Signals) -> None:
    eventually(lambda: any(w.state == "busy" for w in engine.status()))
    pid = next((w.pid for w in engine.status() if w.state == "busy"), None)
    if pid is not None:
        psutil.Process(pid).send_signal(number)


def test_the_inline_engine_draws_what_processes_draw(drawer: Worker, tmp_path: Path) -> None:
    with running(InlineEngine(WorkerConfig(tmp_path / "artifacts", threads=1))) as engine:
        report = engine.submit(task(20.0), Lane.BATCH).result(60)

    assert report.digest == drawer.render(task(20.0)).digest


# ------------------------------------------------------------------------------------------------- without a renderer


def test_errors_cross_the_pipe_or_turn_into_ones_that_can() -> None:
    odd = type("Odd", (Exception,), {})("words")
    died = WorkerDied(exit_code=-9)
    for error in (Cancelled(), InvalidRequest(()), EngineUnavailable("x", retry_after=9.0), odd, died):
        crossed = _crossed(portable(error, "k"))

        assert str(error) in str(crossed)
    assert isinstance(portable(odd, "k"), FrameError)
    assert isinstance(portable(Cancelled()), Cancelled)
    kept = _crossed(portable(EngineUnavailable("x", retry_after=9.0)))
    assert isinstance(kept, EngineUnavailable)
    assert kept.retry_after == 9.0


def _crossed(error: Exception) -> object:
    return pickle.loads(pickle.dumps(error))  # noqa: S301 -- our own bytes, made just now


def test_a_process_without_a_worker_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker._here, "worker", None)
    monkeypatch.setattr(worker._here, "failure", InvalidRequest(()))
    with pytest.raises(InvalidRequest):
        worker.introduce()
    with pytest.raises(InvalidRequest):
        worker.render_frame(task())


def test_a_thread_other_than_its_own_can_not_draw(drawer: Worker) -> None:
    raised: list[BaseException] = []

    def draw() -> None:
        try:
            drawer.render(task(99.0))
        except Exception as error:  # noqa: BLE001 -- which one is the question
            raised.append(error)

    thread = threading.Thread(target=draw)
    thread.start()
    thread.join()

    assert type(raised[0]).__name__ == "WrongThread"
