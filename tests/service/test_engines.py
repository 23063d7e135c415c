"""The contract of every engine: the same tests run on each of the catalogue."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import wait
from pathlib import Path

import pytest

from renderer.errors import Cancelled, EncodeError
from service.artifacts import LocalArtifacts, artifact_name
from service.engines.base import Engine, Lane, WorkerStatus, judge
from service.engines.catalogue import ENGINES
from service.errors import EngineUnavailable, FrameError
from tests.service.core import eventually, make_inline, make_local, running, task
from tests.service.scripted import DRIVER, FINGERPRINT, Seed, begun, open_gate

MAKERS: dict[str, Callable[[Path], Engine]] = {
    "inline": make_inline,
    "local": lambda room: make_local(room, workers=1, interactive=False),
}


@pytest.fixture(params=MAKERS, scope="module")
def shared(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Engine, Path]]:
    room = tmp_path_factory.mktemp(request.param)
    with running(MAKERS[request.param](room)) as started:
        yield started, room


@pytest.fixture
def engine(shared: tuple[Engine, Path]) -> Iterator[Engine]:
    """An engine that is idle and has drawn nothing yet, as far as its room tells."""
    engine, room = shared
    for path in [room / "begun", room / "gate", *(room / "artifacts").glob("*/*")]:
        path.unlink(missing_ok=True)
    yield engine
    open_gate(room)
    eventually(lambda: all(worker.state == "idle" for worker in engine.status()))


@pytest.fixture
def room(shared: tuple[Engine, Path]) -> Path:
    return shared[1]


@pytest.fixture(params=MAKERS)
def closing(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Engine]:
    """An engine that the test may close."""
    with running(MAKERS[request.param](tmp_path)) as started:
        yield started


def test_every_engine_is_tested_here() -> None:
    assert set(MAKERS) == set(ENGINES)


def test_a_frame_is_drawn_stored_and_reported(engine: Engine, room: Path) -> None:
    wanted = task(1.5)
    report = engine.submit(wanted, Lane.INTERACTIVE).result(30)
    artifact, data = LocalArtifacts(room / "artifacts").read(artifact_name(wanted.key, FINGERPRINT))

    assert (report.key, report.fingerprint, report.driver) == (wanted.key, FINGERPRINT, DRIVER)
    assert (report.digest, report.size) == (artifact.digest, len(data))
    assert set(report.timings) == {"queue", "render", "encode"}


def test_an_engine_names_its_driver_and_fingerprint(engine: Engine) -> None:
    assert engine.driver == DRIVER
    assert engine.fingerprint == FINGERPRINT
    assert engine.capacity == 1


def test_what_the_renderer_raises_arrives(engine: Engine) -> None:
    with pytest.raises(EncodeError, match="the pencil broke"):
        engine.submit(task(seed=Seed.RAISE), Lane.BATCH).result(30)


def test_an_odd_exception_hurts_only_its_frame(engine: Engine) -> None:
    odd = engine.submit(task(seed=Seed.FAIL_ODDLY), Lane.BATCH)
    fine = engine.submit(task(), Lane.BATCH)

    with pytest.raises(Exception, match="odd"):
        odd.result(30)
    assert fine.result(30).size > 0


def test_interactive_frames_are_drawn_before_batch_frames(engine: Engine, room: Path) -> None:
    blocker = engine.submit(task(seed=Seed.WAIT), Lane.BATCH)
    eventually(lambda: begun(room))
    batch = [engine.submit(task(float(i)), Lane.BATCH) for i in range(3)]
    screen = engine.submit(task(9.0), Lane.INTERACTIVE)
    open_gate(room)
    wait([blocker, screen, *batch], 30)

    assert begun(room)[1] == task(9.0).key


def test_a_promoted_frame_overtakes(engine: Engine, room: Path) -> None:
    blocker = engine.submit(task(seed=Seed.WAIT), Lane.BATCH)
    eventually(lambda: begun(room))
    batch = [engine.submit(task(float(i)), Lane.BATCH) for i in range(3)]
    engine.promote(batch[2])
    engine.promote(blocker)  # it runs already: nothing to move
    open_gate(room)
    wait([blocker, *batch], 30)

    assert begun(room)[1] == task(2.0).key


def test_a_cancelled_frame_that_waits_is_never_begun(engine: Engine, room: Path) -> None:
    blocker = engine.submit(task(seed=Seed.WAIT), Lane.BATCH)
    eventually(lambda: begun(room))
    unwanted = engine.submit(task(1.0), Lane.BATCH)
    wanted = engine.submit(task(2.0), Lane.BATCH)
    engine.cancel(unwanted)
    open_gate(room)
    wait([blocker, wanted], 30)

    assert unwanted.cancelled()
    assert task(1.0).key not in begun(room)


def test_a_cancelled_frame_that_runs_stops_by_itself(engine: Engine, room: Path) -> None:
    running_frame = engine.submit(task(seed=Seed.WAIT), Lane.BATCH)
    eventually(lambda: begun(room))
    before = engine.status()[0].pid
    engine.cancel(running_frame)

    with pytest.raises(Cancelled):
        running_frame.result(10)
    assert engine.submit(task(), Lane.BATCH).result(10).size > 0
    assert engine.status()[0].pid == before


def test_cancelling_one_frame_does_not_cancel_the_next(engine: Engine, room: Path) -> None:
    first = engine.submit(task(1.0, Seed.WAIT), Lane.BATCH)
    second = engine.submit(task(2.0, Seed.WAIT), Lane.BATCH)
    eventually(lambda: begun(room))
    engine.cancel(first)
    eventually(lambda: len(begun(room)) == 2)
    open_gate(room)

    assert second.result(10).size > 0


def test_the_status_tells_what_a_worker_does(engine: Engine, room: Path) -> None:
    (idle,) = engine.status()
    drawn = idle.frames
    frame = engine.submit(task(seed=Seed.WAIT), Lane.BATCH)
    eventually(lambda: begun(room))
    time.sleep(0.05)
    (busy,) = engine.status()
    open_gate(room)
    frame.result(30)
    eventually(lambda: engine.status()[0].state == "idle")
    (done,) = engine.status()

    assert (idle.state, idle.busy_seconds) == ("idle", 0.0)
    assert busy.state == "busy"
    assert busy.busy_seconds > 0.04
    assert (done.frames, done.driver, done.canary) == (drawn + 1, DRIVER, "c0ffee")
    assert done.last_frame_age is not None


def test_an_engine_whose_canaries_were_drawn_is_ready(engine: Engine) -> None:
    assert engine.readiness().is_ready


def test_a_closed_engine_takes_nothing_and_drops_what_waits(closing: Engine, tmp_path: Path) -> None:
    engine = closing
    engine.submit(task(seed=Seed.WAIT), Lane.BATCH)
    eventually(lambda: begun(tmp_path))
    waiting = engine.submit(task(1.0), Lane.BATCH)
    open_gate(tmp_path)
    engine.close(grace=0.0)

    with pytest.raises(EngineUnavailable):
        waiting.result(10)
    with pytest.raises(EngineUnavailable):
        engine.submit(task(2.0), Lane.BATCH)
    assert not engine.readiness().is_ready


def test_a_frame_that_runs_at_the_close_is_given_its_grace(closing: Engine) -> None:
    engine = closing
    slow = engine.submit(task(seed=Seed.DRAW_SLOWLY), Lane.BATCH)
    eventually(slow.running)
    engine.close(grace=20.0)

    assert slow.result(0).size > 0


# ---------------------------------------------------------------------------------------------------------- readiness


def _status(**facts: object) -> WorkerStatus:
    base = {"name": "w", "lane": Lane.BATCH, "state": "idle", "canary": "aa", "fingerprint": "f", "canary_error": 0.0}
    return WorkerStatus(**{**base, **facts})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("status", "complaint"),
    [
        ((), "no workers"),
        ((_status(), _status(state="starting", canary=None)), "starting"),
        ((_status(), _status(state="failed", canary=None, error="no EGL")), "no EGL"),
        ((_status(), _status(canary=None)), "w: idle"),
        ((_status(), _status(canary="bb")), "different canary"),
        ((_status(canary_error=4.0),), "4/255"),
    ],
)
def test_an_engine_is_not_ready(status: tuple[WorkerStatus, ...], complaint: str) -> None:
    verdict = judge(status)

    assert not verdict.is_ready
    assert complaint in verdict.detail


def test_canaries_may_differ_between_fingerprints_and_by_little_from_the_reference() -> None:
    assert judge((_status(), _status(canary="bb", fingerprint="g", canary_error=3.0), _status(state="busy"))).is_ready


def test_a_frame_error_keeps_its_key() -> None:
    assert FrameError("broken", key="k").key == "k"
