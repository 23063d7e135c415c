"""Jobs as routes use them: what is taken, what is refused, what is shown."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from renderer.errors import InvalidRequest
from service.errors import BadCursor, IdempotencyConflict, UnknownJob
from service.frames import FrameCache
from service.jobs import Jobs
from tests.service.core import eventually, jobs_on, turntable
from tests.service.puppet import Puppet


@pytest.fixture
def puppet(tmp_path: Path) -> Puppet:
    return Puppet(tmp_path, capacity=2)


@pytest.fixture
def jobs(puppet: Puppet, tmp_path: Path) -> Iterator[Jobs]:
    with jobs_on(FrameCache(puppet, puppet.artifacts), tmp_path) as ready:
        yield ready


@pytest.mark.parametrize(
    ("body", "paths"),
    [
        ({}, {"kind"}),
        ({"kind": "film"}, {"kind"}),
        ({"kind": "turntable", "colour": 1}, {"colour"}),
        ({"kind": "turntable", "frame": {"wdth": 1, "width": 0}}, {"frame.wdth", "frame.width"}),
        ({"kind": "turntable", "frame": 5, "priority": 1000}, {"frame", "priority"}),
        ({"kind": "turntable", "turntable": {"frames": 0, "sweep": 90.0}}, {"turntable.frames", "turntable.loop"}),
        ({"kind": "turntable", "turntable": {"frames": 201}}, {"turntable.frames"}),
        ({"kind": "turntable", "outputs": ["tar"]}, {"outputs.0"}),
    ],
)
def test_every_mistake_of_a_job_is_named_before_it_is_taken(
    puppet: Puppet, tmp_path: Path, body: dict[str, object], paths: set[str]
) -> None:
    with jobs_on(FrameCache(puppet, puppet.artifacts), tmp_path, max_frames=200) as jobs:
        with pytest.raises(InvalidRequest) as refusal:
            jobs.submit(body)

        assert {problem.path for problem in refusal.value.problems} == paths
        assert jobs.page().jobs == ()


def test_an_idempotency_key_is_one_job(jobs: Jobs) -> None:
    first = jobs.submit(turntable(2), "k")
    again = jobs.submit(turntable(2), "k")

    assert first.job.id == again.job.id
    with pytest.raises(IdempotencyConflict):
        jobs.submit(turntable(3), "k")


def test_pages_of_jobs_and_frames_join_up(jobs: Jobs) -> None:
    ids = [jobs.submit(turntable(5)).job.id for _ in range(5)]
    first = jobs.page(limit=3)
    second = jobs.page(limit=3, cursor=first.next)
    frames = jobs.frames(ids[0], limit=3)
    rest = jobs.frames(ids[0], limit=3, cursor=frames.next)

    assert [view.job.id for view in first.jobs + second.jobs] == ids[::-1]
    assert second.next is None
    assert [frame.index for frame in frames.frames + rest.frames] == [0, 1, 2, 3, 4]
    assert rest.next is None
    assert [view.job.id for view in jobs.page(state="cancelled").jobs] == []


@pytest.mark.parametrize("cursor", ["", "x", "bnVsbA", "WzFd", "!!!!"])
def test_cursors_of_others_are_refused(jobs: Jobs, cursor: str) -> None:
    with pytest.raises(BadCursor):
        jobs.page(cursor=cursor)


def test_unknown_names_are_refused(jobs: Jobs) -> None:
    with pytest.raises(UnknownJob):
        jobs.job("nope")
    with pytest.raises(InvalidRequest, match="no such state"):
        jobs.page(state="sleeping")


def test_a_job_is_shown_as_the_api_promises(jobs: Jobs, puppet: Puppet) -> None:
    job_id = jobs.submit(turntable(2)).job.id
    shown = jobs.job(job_id).as_json()
    for number in range(2):
        eventually(lambda: len(puppet.submitted) == 2)
        puppet.finish(number)
    eventually(lambda: jobs.job(job_id).job.state == "succeeded")
    (first, _) = jobs.frames(job_id).as_json()["frames"]

    assert set(shown) == {
        *("id", "kind", "state", "counts", "frames_per_second", "eta_seconds"),
        *("created", "started", "finished", "links", "error"),
    }
    assert shown["links"]["result.mp4"] == f"/v1/jobs/{job_id}/result.mp4"
    assert shown["created"].endswith("Z")
    assert first["url"] == f"/v1/jobs/{job_id}/frames/0.png"
    assert set(first) == {"index", "state", "key", "digest", "url"}
