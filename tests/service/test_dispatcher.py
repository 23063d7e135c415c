from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from renderer.errors import EncodeError
from service.artifacts import artifact_name
from service.errors import (
    EngineUnavailable,
    FrameTimedOut,
    JobExpired,
    StoreBusy,
    StoreUnavailable,
    TransitionRefused,
    WorkerDied,
)
from service.frames import FrameCache
from service.jobs import Jobs, JobView, dispatcher, office
from tests.service.core import cache_on, eventually, jobs_on, make_inline, make_local, turntable
from tests.service.puppet import Puppet
from tests.service.scripted import FINGERPRINT, Seed, begun


@pytest.fixture
def puppet(tmp_path: Path) -> Puppet:
    return Puppet(tmp_path, capacity=2)


@pytest.fixture
def jobs(puppet: Puppet, tmp_path: Path) -> Iterator[Jobs]:
    with jobs_on(FrameCache(puppet, puppet.artifacts), tmp_path) as ready:
        yield ready


def _wait(jobs: Jobs, job_id: str, *states: str) -> JobView:
    eventually(lambda: jobs.job(job_id).job.state in (states or ("succeeded",)))
    return jobs.job(job_id)


def _until_sent(puppet: Puppet, number: int) -> None:
    eventually(lambda: len(puppet.submitted) >= number)


def _finish_all(jobs: Jobs, puppet: Puppet, job_id: str) -> None:
    number = 0
    while jobs.job(job_id).job.state in {"queued", "running"}:
        if number < len(puppet.submitted):
            if not puppet.is_over(number):
                puppet.finish(number)
            number += 1
        time.sleep(0.005)


def test_a_job_is_drawn_to_its_end(tmp_path: Path) -> None:
    with cache_on(make_inline(tmp_path), tmp_path) as cache, jobs_on(cache, tmp_path) as jobs:
        submitted = jobs.submit(turntable(6))
        done = _wait(jobs, submitted.job.id)

        assert submitted.job.state in {"queued", "running"}
        assert done.counts.as_dict() == {"total": 6, "done": 6, "failed": 0, "pending": 0, "leased": 0}
        assert len(set(begun(tmp_path))) == len(begun(tmp_path)) == 6
        assert done.frames_per_second is not None
        assert done.eta_seconds is None
        assert done.job.finished is not None


def test_only_slots_and_one_are_on_their_way(jobs: Jobs, puppet: Puppet) -> None:
    job_id = jobs.submit(turntable(10)).job.id
    eventually(lambda: len(puppet.submitted) == 3)
    time.sleep(0.2)

    assert len(puppet.submitted) == 3
    assert 3 <= jobs.job(job_id).counts.leased < 10
    puppet.finish(0)
    eventually(lambda: len(puppet.submitted) == 4)
    eventually(lambda: jobs.job(job_id).counts.done == 1)


def test_the_job_of_higher_priority_comes_first(jobs: Jobs, puppet: Puppet) -> None:
    jobs.submit(turntable(6))
    eventually(lambda: len(puppet.submitted) == 3)
    urgent = jobs.submit(turntable(2, priority=10, frame={"width": 32, "height": 32}))
    puppet.finish(0)
    puppet.finish(1)
    eventually(lambda: len(puppet.submitted) == 5)

    assert {task.key for task, _ in puppet.submitted[3:]} == {f.key for f in jobs.frames(urgent.job.id).frames}


def test_coarse_to_fine_shows_the_whole_early(jobs: Jobs, puppet: Puppet) -> None:
    job_id = jobs.submit(turntable(8, order="coarse_to_fine")).job.id
    eventually(lambda: len(puppet.submitted) == 3)
    by_key = {frame.key: frame.index for frame in jobs.frames(job_id).frames}

    assert [by_key[task.key] for task, _ in puppet.submitted] == [0, 4, 2]


def test_an_outage_of_the_engine_is_no_try_of_the_frame(
    jobs: Jobs, puppet: Puppet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatcher, "LONGEST_HOLD", 0.05)
    puppet.refusal = EngineUnavailable("down")
    job_id = jobs.submit(turntable(3)).job.id
    time.sleep(0.5)
    puppet.refusal = None
    for number in range(3):
        _until_sent(puppet, number + 1)
        puppet.fail((EngineUnavailable("gone"), StoreUnavailable("full"), EngineUnavailable("gone"))[number], number)
    puppet.submitted.clear()
    puppet._futures.clear()
    jobs._dispatcher.wake()
    _finish_all(jobs, puppet, job_id)

    assert jobs.job(job_id).job.state == "succeeded"
    assert {frame.attempts for frame in jobs.store.frames(job_id)} == {0}


def test_a_frame_that_fails_is_tried_twice_and_the_job_goes_on(jobs: Jobs, puppet: Puppet) -> None:
    job_id = jobs.submit(turntable(2)).job.id
    eventually(lambda: len(puppet.submitted) == 2)
    puppet.fail(EncodeError("broken"), 0)
    puppet.finish(1)
    eventually(lambda: len(puppet.submitted) == 3)
    puppet.fail(EncodeError("broken again"), 2)
    failed = _wait(jobs, job_id, "failed")

    assert failed.job.error == {"kind": "render-failed", "detail": "broken again", "frames": [0]}
    assert failed.counts.done == 1
    shown = failed.as_json()["error"]
    assert shown["type"] == "/problems/render-failed"
    assert shown["frames"] == [0]


def test_a_frame_that_times_out_twice_is_named(jobs: Jobs, puppet: Puppet) -> None:
    job_id = jobs.submit(turntable(1)).job.id
    for number in range(2):
        _until_sent(puppet, number + 1)
        puppet.fail(FrameTimedOut(10.0), number)
    error = _wait(jobs, job_id, "failed").job.error

    assert error is not None
    assert error["kind"] == "deadline"


def test_a_poisonous_frame_is_set_aside_and_the_job_goes_on(jobs: Jobs, puppet: Puppet) -> None:
    job_id = jobs.submit(turntable(2)).job.id
    eventually(lambda: len(puppet.submitted) == 2)
    puppet.fail(WorkerDied(exit_code=-11), 0)
    puppet.fail(WorkerDied(exit_code=-11), 2)
    puppet.finish(1)
    error = _wait(jobs, job_id, "failed").job.error

    assert error is not None
    assert (error["kind"], error["frames"]) == ("frame-set-aside", [0])
    assert "SIGSEGV" in error["detail"]
    assert len(puppet.submitted) == 3


def test_a_retry_draws_what_failed(jobs: Jobs, puppet: Puppet) -> None:
    job_id = jobs.submit(turntable(2)).job.id
    for number in (0, 1, 2):
        _until_sent(puppet, number + 1)
        if number == 1:
            puppet.finish(1)
        else:
            puppet.fail(EncodeError("broken"), number)
    _wait(jobs, job_id, "failed")
    jobs.retry(job_id)
    eventually(lambda: len(puppet.submitted) == 4)
    puppet.finish(3)

    assert _wait(jobs, job_id).counts.done == 2


def test_frames_that_are_stored_are_done_without_drawing(jobs: Jobs, puppet: Puppet) -> None:
    first = jobs.submit(turntable(4)).job.id
    _finish_all(jobs, puppet, first)
    damaged = puppet.artifacts.find(artifact_name(jobs.frames(first).frames[2].key, "puppet"))
    assert damaged is not None
    damaged.path.write_bytes(b"rubbish")
    second = jobs.submit(turntable(4)).job.id
    eventually(lambda: len(puppet.submitted) == 5)
    puppet.finish(4)
    _wait(jobs, second)

    assert puppet.submitted[4][0].key == jobs.frames(second).frames[2].key
    assert [f.digest for f in jobs.frames(first).frames] == [f.digest for f in jobs.frames(second).frames]


def test_a_cancelled_job_leaves_the_queue_and_stops_what_runs(tmp_path: Path) -> None:
    with cache_on(make_inline(tmp_path), tmp_path) as cache, jobs_on(cache, tmp_path) as jobs:
        job_id = jobs.submit(turntable(4, Seed.WAIT)).job.id
        eventually(lambda: begun(tmp_path))
        cancelled = jobs.cancel(job_id)
        other = jobs.submit(turntable(2)).job.id

        _wait(jobs, other)
        assert cancelled.job.state == "cancelled"
        assert len(begun(tmp_path)) == 3
        assert jobs.cancel(job_id).job.state == "cancelled"
        assert jobs.job(job_id).counts.as_dict()["pending"] == 4
        with pytest.raises(TransitionRefused):
            jobs.cancel(other)


def test_a_paused_job_waits_and_resumes(jobs: Jobs, puppet: Puppet) -> None:
    job_id = jobs.submit(turntable(5)).job.id
    eventually(lambda: len(puppet.submitted) == 3)
    jobs.pause(job_id)
    for number in range(3):
        puppet.finish(number)
    eventually(lambda: jobs.job(job_id).counts.done == 3)
    time.sleep(0.2)

    assert len(puppet.submitted) == 3
    jobs.resume(job_id)
    eventually(lambda: len(puppet.submitted) == 5)


def test_a_frame_that_never_comes_back_is_drawn_again(
    jobs: Jobs, puppet: Puppet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatcher, "LOST_SECONDS", 0.2)
    monkeypatch.setattr(dispatcher, "TICK", 0.05)
    jobs.submit(turntable(1))
    eventually(lambda: len(puppet.submitted) >= 2)

    assert len(puppet.cancelled) >= 1


def test_a_stop_gives_back_what_is_on_its_way(puppet: Puppet, tmp_path: Path) -> None:
    cache = FrameCache(puppet, puppet.artifacts)
    with jobs_on(cache, tmp_path) as jobs:
        job_id = jobs.submit(turntable(4)).job.id
        eventually(lambda: len(puppet.submitted) == 3)
        puppet.finish(0)
        eventually(lambda: jobs.job(job_id).counts.done == 1)
    with jobs_on(cache, tmp_path) as jobs:
        _finish_all(jobs, puppet, job_id)

        assert {frame.attempts for frame in jobs.store.frames(job_id)} == {0}


def test_two_services_never_dispatch_one_store(
    jobs: Jobs, puppet: Puppet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(office, "_TAKEOVER_SECONDS", 0.2)
    with pytest.raises(StoreBusy), jobs_on(FrameCache(puppet, puppet.artifacts), tmp_path):
        pass


def test_a_job_expires_and_lets_go_of_its_frames(
    puppet: Puppet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatcher, "HOUSEKEEPING", 0.05)
    with jobs_on(FrameCache(puppet, puppet.artifacts), tmp_path, expiry_seconds=0.3) as jobs:
        job_id = jobs.submit(turntable(1)).job.id
        eventually(lambda: puppet.submitted)
        puppet.finish(0)

        def is_expired() -> bool:
            jobs._dispatcher.wake()
            try:
                jobs.job(job_id)
            except JobExpired:
                return True
            return False

        eventually(is_expired)
        assert jobs.store.pinned() == frozenset()


def test_the_budget_spares_what_jobs_hold(tmp_path: Path) -> None:
    with cache_on(make_inline(tmp_path), tmp_path) as cache, jobs_on(cache, tmp_path) as jobs:
        cache.artifacts.trim()
        loose = cache.artifacts.put("a-loose-artifact", bytes(1000))
        job_id = jobs.submit(turntable(3)).job.id
        _wait(jobs, job_id)
        cache.artifacts._budget = 500
        jobs._dispatcher.wake()

        eventually(lambda: not loose.path.exists())
        held = [artifact_name(frame.key, FINGERPRINT) for frame in jobs.frames(job_id).frames]
        assert all(cache.artifacts.verified(name) for name in held)


def test_a_worker_killed_in_the_middle_costs_one_retry(tmp_path: Path) -> None:
    with cache_on(make_local(tmp_path, interactive=False), tmp_path) as cache, jobs_on(cache, tmp_path) as jobs:
        job_id = jobs.submit(turntable(6, Seed.DIE_ONCE)).job.id
        done = _wait(jobs, job_id)

        assert done.counts.done == 6
        assert len(begun(tmp_path)) == 12
        assert {frame.attempts for frame in jobs.store.frames(job_id)} == {0}
