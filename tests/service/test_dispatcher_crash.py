"""The service is killed at every step of a job, and started again: each frame is done exactly once."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from service.artifacts import artifact_name
from service.jobs.store import JobStore
from tests.service.core import eventually
from tests.service.crashing import FRAMES, MOMENTS
from tests.service.scripted import FINGERPRINT, begun, picture

ROOT = Path(__file__).parents[2]


@pytest.fixture
def service(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "tests.service.crashing", str(tmp_path), getattr(request, "param", "inline")]
    with subprocess.Popen(
        command, cwd=ROOT, start_new_session=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield process
        process.kill()


def _start(service: subprocess.Popen[str], moment: str, nth: int = 1) -> None:
    assert service.stdin is not None
    service.stdin.write(f"{moment} {nth}\n")
    service.stdin.flush()


def _exit_code(service: subprocess.Popen[str]) -> int:
    assert service.stdout is not None
    return int(service.stdout.readline())


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
def test_a_job_survives_kill_9_at_every_step(service: subprocess.Popen[str], tmp_path: Path, nth: int) -> None:
    """One job, one crash after another, each at another step; then an undisturbed run."""
    (tmp_path / "artifacts").mkdir()
    for moment in MOMENTS:
        stored = {name.split(".")[0] for name in _artifacts(tmp_path)}
        before = len(begun(tmp_path))
        _start(service, moment, 1 if moment == "submitted" else nth)
        code = _exit_code(service)
        drawn_again = stored & {artifact_name(key, FINGERPRINT) for key in begun(tmp_path)[before:]}

        assert code == -signal.SIGKILL or (nth > 1 and code == 0), moment
        assert drawn_again == set(), moment
    _start(service, "never")
    assert _exit_code(service) == 0

    _assert_whole(tmp_path)
    assert len(begun(tmp_path)) <= FRAMES + 2 * len(MOMENTS)


@pytest.mark.parametrize("service", ["local"], indirect=True)
def test_workers_do_not_outlive_a_killed_service_and_the_next_one_goes_on(
    service: subprocess.Popen[str], tmp_path: Path
) -> None:
    _start(service, "never")
    eventually(lambda: len(begun(tmp_path)) >= 3, 60)
    (child,) = psutil.Process(service.pid).children()
    workers = child.children(recursive=True)
    child.kill()

    assert _exit_code(service) == -signal.SIGKILL
    assert len(workers) >= 3
    eventually(lambda: not any(worker.is_running() for worker in workers), 20)
    _start(service, "never")
    assert _exit_code(service) == 0
    _assert_whole(tmp_path)
