"""The service is killed at every step of a job, and started again: each frame is done exactly once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from service.artifacts import artifact_name
from service.jobs.store import JobStore
from tests.service.core import eventually
from tests.service.crashing import FRAMES, MOMENTS
from tests.service.scripted import FINGERPRINT, begun, picture

ROOT = Path(__file__).parents[2]


def _serve(room: Path, moment: str, nth: int = 1, engine: str = "inline") -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "tests.service.crashing", str(room), moment, str(nth), engine]
    return subprocess.Popen(command, cwd=ROOT, start_new_session=True)


def _artifacts(room: Path) -> list[str]:
    return sorted(path.name for path in (room / "artifacts").glob("*/*") if path.parent.name != "tmp")


def _assert_whole(room: Path) -> None:
    store = JobStore(f"sqlite:///{room / 'jobs.sqlite3'}")
    (entry,) = store.jobs()
    frames = store.frames(entry[0].id)
    store.close()

    assert entry[0].state == "succeeded"
    assert entry[1].done == FRAMES
    expected = sorted(f"{artifact_name(frame.key, FINGERPRINT)}.{frame.digest}" for frame in frames)
    assert _artifacts(room) == expected
    for index, frame in enumerate(frames):
        path = next((room / "artifacts").glob(f"*/{artifact_name(frame.key, FINGERPRINT)}.*"))
        assert path.read_bytes() == picture(64, 36, index / 12.0)


@pytest.mark.parametrize("nth", [1, 3])
def test_a_job_survives_kill_9_at_every_step(tmp_path: Path, nth: int) -> None:
    """One job, one crash after another, each at another step; then an undisturbed run."""
    for moment in MOMENTS:
        often = 1 if moment == "submitted" else nth
        stored = {name.split(".")[0] for name in _artifacts(tmp_path)} if (tmp_path / "artifacts").exists() else set()
        before = len(begun(tmp_path))
        code = _serve(tmp_path, moment, often).wait(60)
        drawn_again = stored & {artifact_name(key, FINGERPRINT) for key in begun(tmp_path)[before:]}

        assert code == -signal.SIGKILL or (nth > 1 and code == 0), moment
        assert drawn_again == set(), moment
    assert _serve(tmp_path, "never").wait(60) == 0

    _assert_whole(tmp_path)
    assert len(begun(tmp_path)) <= FRAMES + 2 * len(MOMENTS)


def test_workers_do_not_outlive_a_killed_service_and_the_next_one_goes_on(tmp_path: Path) -> None:
    service = _serve(tmp_path, "never", engine="local")
    try:
        eventually(lambda: len(begun(tmp_path)) >= 3, 60)
        workers = psutil.Process(service.pid).children(recursive=True)
        os.kill(service.pid, signal.SIGKILL)
        service.wait(10)

        assert len(workers) >= 3
        eventually(lambda: not any(worker.is_running() for worker in workers), 20)
        assert _serve(tmp_path, "never", engine="local").wait(60) == 0
        _assert_whole(tmp_path)
    finally:
        service.kill()
