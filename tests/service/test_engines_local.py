"""What the local engine does about processes that die, stop, hang, grow old or never come up."""

from __future__ import annotations

import os
import signal
import threading
import time
from concurrent.futures import Future, wait
from itertools import pairwise
from pathlib import Path

import psutil
import pytest

from renderer.errors import NoDevice
from service.engines import local
from service.engines.base import Lane
from service.engines.local import NICENESS, LocalEngine
from service.engines.queue import Entry
from service.engines.slot import NeverBegun, Slot
from service.errors import EngineUnavailable, FrameTimedOut, WorkerDied
from service.worker import FrameReport
from tests.service.core import eventually, make_local, running, task
from tests.service.scripted import Seed, begun, no_device, open_gate


def _pid(engine: LocalEngine, name: str = "batch-0") -> int | None:
    return next(worker.pid for worker in engine.status() if worker.name == name)


def _processes() -> set[int]:
    return {child.pid for child in psutil.Process().children(recursive=True) if "python" in child.name()}


def test_a_worker_that_dies_fails_its_own_frame_only(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=2)) as engine:
        neighbours = [engine.submit(task(float(i), Seed.DRAW_SLOWLY), Lane.BATCH) for i in range(6)]
        victim = engine.submit(task(seed=Seed.DIE), Lane.BATCH)
        more = [engine.submit(task(10.0 + i, Seed.DRAW_SLOWLY), Lane.BATCH) for i in range(6)]

        with pytest.raises(WorkerDied, match="SIGKILL") as death:
            victim.result(30)
        assert death.value.signal == "SIGKILL"
        assert death.value.key == task(seed=Seed.DIE).key
        assert all(frame.result(30).size > 0 for frame in neighbours + more)
        eventually(lambda: engine.readiness().is_ready)
        assert sum(worker.restarts for worker in engine.status()) == 1


def test_a_stopped_worker_is_ended_and_replaced(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=1, interactive=False)) as engine:
        began = time.monotonic()
        with pytest.raises(WorkerDied, match="stopped"):
            engine.submit(task(seed=Seed.STOP_ONCE), Lane.BATCH).result(30)
        freed = time.monotonic() - began
        after = engine.submit(task(1.0), Lane.BATCH).result(30)

        assert freed < 5
        assert after.size > 0


def test_a_worker_that_is_stopped_without_a_frame_is_seen_and_replaced(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=1, interactive=False)) as engine:
        pid = _pid(engine)
        assert pid is not None
        os.kill(pid, signal.SIGSTOP)
        eventually(lambda: not engine.readiness().is_ready, 5)
        eventually(lambda: engine.readiness().is_ready)

        assert _pid(engine) != pid


def test_a_worker_that_uses_no_cpu_is_ended(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=1, interactive=False)) as engine:
        began = time.monotonic()
        with pytest.raises(WorkerDied, match="no CPU"):
            engine.submit(task(seed=Seed.SLEEP), Lane.BATCH).result(30)

        assert 1.5 < time.monotonic() - began < 8


@pytest.mark.parametrize(
    ("seed", "lane"),
    [(Seed.SPIN, Lane.INTERACTIVE), (Seed.SPIN_UNGUARDED, Lane.INTERACTIVE), (Seed.SPIN, Lane.BATCH)],
    ids=["held inside", "held outside", "CPU time"],
)
def test_a_frame_past_its_deadline_times_out(tmp_path: Path, seed: Seed, lane: Lane) -> None:
    """The process ends itself; where it can't, it is ended from outside."""
    with running(make_local(tmp_path, workers=1)) as engine:
        with pytest.raises(FrameTimedOut) as late:
            engine.submit(task(seed=seed, limit=1.0), lane).result(30)

        assert 1.0 <= late.value.seconds < (1.0 + 2.0 if lane is Lane.INTERACTIVE else 6.0)
        assert engine.submit(task(1.0), lane).result(30).size > 0


def test_a_batch_frame_that_others_keep_from_the_cpu_is_given_time(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=1, interactive=False)) as engine:
        slow = engine.submit(task(seed=Seed.WAIT, limit=0.8), Lane.BATCH)
        time.sleep(2.0)
        open_gate(tmp_path)

        assert slow.result(30).size > 0


def test_an_idle_worker_that_dies_is_replaced_and_costs_no_frame(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=1, interactive=False)) as engine:
        for round_ in range(2):
            pid = _pid(engine)
            assert pid is not None
            os.kill(pid, signal.SIGKILL)
            # Some of these meet the engine before it knows of the death: they must go round again, unharmed.
            frames = [engine.submit(task(10.0 * round_ + i), Lane.BATCH) for i in range(3)]

            assert all(frame.result(30).size > 0 for frame in frames)


def test_a_frame_that_no_process_begins_does_not_go_round_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def finished(slot: Slot, entry: Entry, future: Future[FrameReport]) -> NeverBegun:
        slot.entry, slot.state = None, "idle"
        return NeverBegun()

    monkeypatch.setattr(Slot, "finished", finished)
    with running(make_local(tmp_path, workers=1, interactive=False)) as engine:
        with pytest.raises(EngineUnavailable, match="before they begin"):
            engine.submit(task(), Lane.BATCH).result(30)

        assert len(begun(tmp_path)) == 1 + local.MOST_RETURNS


def test_a_worker_that_never_comes_up_says_why(tmp_path: Path) -> None:
    engine = LocalEngine(tmp_path / "artifacts", workers=1, make=no_device)
    engine.start()
    try:
        with pytest.raises(NoDevice, match=r"libEGL\.so\.1"):
            engine.wait_ready(30)
        with pytest.raises(NoDevice, match="Looked for"):
            _ = engine.fingerprint
        assert engine.driver == ""
        assert "libEGL" in engine.readiness().detail
    finally:
        engine.close()


def test_an_engine_that_is_not_ready_in_time_says_so(tmp_path: Path) -> None:
    engine = make_local(tmp_path, workers=1)
    engine.start()
    try:
        with pytest.raises(EngineUnavailable, match="starting"):
            engine.wait_ready(0.0)
    finally:
        engine.close()


def test_a_worker_is_replaced_after_its_share_of_frames(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=1, interactive=False, max_frames_per_worker=3)) as engine:
        before = _pid(engine)
        frames = [engine.submit(task(float(i)), Lane.BATCH) for i in range(3)]
        wait(frames, 30)
        eventually(lambda: _pid(engine) not in {before, None})

        assert engine.submit(task(9.0), Lane.BATCH).result(30).size > 0


def test_a_worker_that_has_grown_is_replaced(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=1, interactive=False, max_rss=0)) as engine:
        before = _pid(engine)
        engine.submit(task(), Lane.BATCH).result(30)

        eventually(lambda: _pid(engine) not in {before, None})


def test_no_batch_frame_starts_while_an_interactive_one_runs(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=2)) as engine:
        screen = engine.submit(task(seed=Seed.WAIT), Lane.INTERACTIVE)
        eventually(lambda: begun(tmp_path))
        batch = [engine.submit(task(1.0 + i), Lane.BATCH) for i in range(2)]
        time.sleep(0.6)
        held = len(begun(tmp_path))
        open_gate(tmp_path)
        wait([screen, *batch], 30)

        assert held == 1
        assert len(begun(tmp_path)) == 3


def test_interactive_frames_never_starve_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "PATIENCE", 0.5)
    with running(make_local(tmp_path, workers=1)) as engine:
        engine.submit(task(seed=Seed.WAIT), Lane.INTERACTIVE)
        eventually(lambda: begun(tmp_path))
        batch = engine.submit(task(1.0), Lane.BATCH)

        assert batch.result(10).size > 0
        open_gate(tmp_path)


def test_interactive_frames_overflow_to_the_batch_workers(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=2)) as engine:
        frames = [engine.submit(task(float(i), Seed.WAIT), Lane.INTERACTIVE) for i in range(3)]
        eventually(lambda: len(begun(tmp_path)) == 3)
        open_gate(tmp_path)

        assert len({frame.result(30).pid for frame in frames}) == 3


def test_batch_workers_are_niced_and_the_interactive_one_is_not(tmp_path: Path) -> None:
    own = psutil.Process().nice()
    with running(make_local(tmp_path, workers=1)) as engine:
        pids = {worker.name: worker.pid for worker in engine.status()}

        assert psutil.Process(pids["batch-0"]).nice() == min(19, own + NICENESS)
        assert psutil.Process(pids["interactive"]).nice() == own


def test_two_workers_draw_at_the_same_time(tmp_path: Path) -> None:
    with running(make_local(tmp_path, workers=2, interactive=False)) as engine:
        frames = [engine.submit(task(float(i), Seed.WAIT), Lane.BATCH) for i in range(2)]
        eventually(lambda: len(begun(tmp_path)) == 2)
        open_gate(tmp_path)

        assert len({frame.result(30).pid for frame in frames}) == 2


def test_nothing_is_left_running_after_the_close(tmp_path: Path) -> None:
    before = _processes()
    engine = make_local(tmp_path, workers=2)
    with running(engine):
        frames = [engine.submit(task(float(i), Seed.SPIN), Lane.BATCH) for i in range(2)]
        eventually(lambda: len(begun(tmp_path)) == 2)
        during = _processes() - before

    assert len(during) >= 3
    eventually(lambda: not (_processes() & during), 5)
    for frame in frames:
        with pytest.raises(EngineUnavailable):
            frame.result(0)


def test_frames_flow_while_callers_submit_promote_and_cancel_at_once(tmp_path: Path) -> None:
    """No deadlock, nothing lost: every future ends."""
    with running(make_local(tmp_path, workers=2)) as engine:
        futures = []

        def harass(start: int) -> None:
            mine = [engine.submit(task(float(start + i)), Lane.BATCH) for i in range(20)]
            for left, right in pairwise(mine):
                engine.promote(left)
                engine.cancel(right)
            futures.extend(mine)

        threads = [threading.Thread(target=harass, args=(100 * n,)) for n in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

        assert len(futures) == 80
        assert wait(futures, 60).not_done == set()
        assert engine.readiness().is_ready
