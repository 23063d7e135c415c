from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import create_engine, inspect, text

from service.artifacts import artifact_name
from service.errors import IdempotencyConflict, UnknownFrame, UnknownJob
from service.jobs.job import Action, Counts, Done, Failed, FrameState, JobState, Lease
from service.jobs.leases import Leases
from service.jobs.schema import METADATA
from service.jobs.store import JobStore, Submission


def url(room: Path) -> str:
    return f"sqlite:///{room / 'jobs.sqlite3'}"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[JobStore]:
    opened = JobStore(url(tmp_path))
    yield opened
    opened.close()


def wanted(
    frames: int = 3, *, key: str | None = None, digest: str = "body", priority: int = 0, order: list[int] | None = None
) -> Submission:
    described = [(f"{index:064x}", f'{{"number":{index}}}'.encode()) for index in range(frames)]
    return Submission("turntable", {"fps": 12}, described, digest, priority, order, key)


def done(lease: Lease, digest: str = "d" * 64) -> Done:
    return Done(lease, lease.key, digest, 10, "f")


# ----------------------------------------------------------------------------------------------------------- the schema


def test_migrations_make_exactly_the_schema_that_the_code_uses(tmp_path: Path) -> None:
    JobStore(url(tmp_path)).close()
    engine = create_engine(url(tmp_path))
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})

        assert compare_metadata(context, METADATA) == []
    engine.dispose()


def test_a_store_that_is_opened_again_keeps_everything(tmp_path: Path) -> None:
    first = JobStore(url(tmp_path))
    job = first.submit(wanted())
    first.close()
    second = JobStore(url(tmp_path))

    assert second.job(job.id)[0] == job
    second.close()


def test_what_is_acknowledged_is_safe_from_a_power_cut(store: JobStore) -> None:
    with store.reading() as connection:
        assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
        assert connection.exec_driver_sql("PRAGMA synchronous").scalar() == 2  # FULL
        assert connection.exec_driver_sql("PRAGMA foreign_keys").scalar() == 1


def test_every_query_of_the_hot_path_has_its_index(store: JobStore) -> None:
    claim = (
        "EXPLAIN QUERY PLAN SELECT number FROM frames WHERE job_id='a' AND state='pending' ORDER BY rank LIMIT 3",
        "EXPLAIN QUERY PLAN SELECT state, count(*) FROM frames WHERE job_id='a' GROUP BY state",
    )
    with store.reading() as connection:
        for query in claim:
            plan = " ".join(str(row) for row in connection.execute(text(query)))

            assert "ix_frames_job_id_state_rank" in plan
            assert "TEMP B-TREE" not in plan
        assert {"frames", "jobs"} <= set(inspect(connection).get_table_names())


# --------------------------------------------------------------------------------------------------------- submitting


def test_a_job_is_written_down_with_all_its_frames(store: JobStore) -> None:
    job = store.submit(wanted(3))
    found, counts, pace = store.job(job.id)
    frames = store.frames(job.id)

    assert found == job
    assert (job.kind, job.state, job.spec, job.total) == ("turntable", JobState.QUEUED, {"fps": 12}, 3)
    assert counts == Counts(total=3, pending=3)
    assert pace.frames == 0
    assert [(frame.index, frame.state) for frame in frames] == [(i, FrameState.PENDING) for i in range(3)]
    assert frames[2].request == b'{"number":2}'
    assert store.frame(job.id, 1) == frames[1]
    assert store.frames(job.id, start=1, limit=1) == [frames[1]]


def test_unknown_jobs_and_frames_are_named(store: JobStore) -> None:
    job = store.submit(wanted(3))
    with pytest.raises(UnknownJob, match="nope"):
        store.job("nope")
    with pytest.raises(UnknownJob):
        store.act("nope", Action.CANCEL)
    with pytest.raises(UnknownFrame, match="0 to 2"):
        store.frame(job.id, 3)


def test_the_same_idempotency_key_is_the_same_job(store: JobStore) -> None:
    first, again, other = (store.submit(wanted(key=key)) for key in ("k", "k", "l"))

    assert first == again
    assert other.id != first.id
    assert len(store.jobs()) == 2
    with pytest.raises(IdempotencyConflict) as conflict:
        store.submit(wanted(key="k", digest="another body"))
    assert conflict.value.job_id == first.id


def test_an_idempotency_key_makes_one_job_however_many_send_it_at_once(store: JobStore) -> None:
    ids: list[str] = []
    threads = [threading.Thread(target=lambda: ids.append(store.submit(wanted(key="k")).id)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert len(ids) == 8
    assert len(set(ids)) == 1


def test_jobs_come_newest_first_by_state_and_by_page(store: JobStore) -> None:
    jobs = [store.submit(wanted()) for _ in range(5)]
    store.act(jobs[2].id, Action.CANCEL)
    first = [job for job, _, _ in store.jobs(limit=2)]
    rest = [job for job, _, _ in store.jobs(before=(first[-1].created, first[-1].id))]

    assert [job.id for job in first + rest] == [job.id for job in reversed(jobs)]
    assert [job.id for job, _, _ in store.jobs(state=JobState.CANCELLED)] == [jobs[2].id]


# -------------------------------------------------------------------------------------------------------------- leases


def test_frames_are_claimed_by_priority_then_age_then_order(store: JobStore) -> None:
    old, urgent = store.submit(wanted(2)), store.submit(wanted(2, priority=5, order=[1, 0]))
    claimed = Leases(store, "a").exchange([], 10).claimed

    assert [(lease.job_id, lease.index) for lease in claimed] == [
        (urgent.id, 1),
        (urgent.id, 0),
        (old.id, 0),
        (old.id, 1),
    ]
    assert store.job(old.id)[0].state is JobState.RUNNING
    assert store.job(old.id)[0].started is not None


def test_no_frame_is_leased_twice_at_a_time(store: JobStore) -> None:
    store.submit(wanted(40))
    claimed: list[Lease] = []

    def claim(owner: str) -> None:
        leases = Leases(store, owner)
        while got := leases.exchange([], 3).claimed:
            claimed.extend(got)

    threads = [threading.Thread(target=claim, args=(name,)) for name in "abcd"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert sorted(lease.index for lease in claimed) == list(range(40))


def test_a_lease_that_ends_is_taken_back_and_its_late_report_changes_nothing(store: JobStore) -> None:
    job = store.submit(wanted(1))
    dead, alive = Leases(store, "dead", seconds=-1.0), Leases(store, "alive")
    old = dead.exchange([], 1).claimed[0]

    assert alive.reclaim() == 1
    dead.exchange([done(old, "a" * 64)], 0)
    assert store.frame(job.id, 0).state is FrameState.PENDING
    new = alive.exchange([], 1).claimed[0]
    dead.exchange([done(old, "a" * 64)], 0)
    assert new.fence == old.fence + 1
    assert store.frame(job.id, 0).state is FrameState.LEASED
    alive.exchange([done(new, "b" * 64)], 0)
    dead.exchange([done(old, "a" * 64)], 0)
    assert store.frame(job.id, 0).digest == "b" * 64


def test_a_lease_that_is_held_is_renewed_and_no_other(store: JobStore) -> None:
    store.submit(wanted(2))
    leases = Leases(store, "a", seconds=-1.0)
    held, lost = leases.exchange([], 2).claimed
    Leases(store, "a").exchange([], 0, held=[held], renews=True)

    assert leases.reclaim() == 1
    assert store.frame(lost.job_id, lost.index).state is FrameState.PENDING
    assert store.frame(held.job_id, held.index).state is FrameState.LEASED


def test_reporting_twice_is_reporting_once(store: JobStore) -> None:
    job = store.submit(wanted(1))
    leases = Leases(store, "a")
    lease = leases.exchange([], 1).claimed[0]

    assert leases.exchange([done(lease)], 0).ended == {job.id}
    before = store.job(job.id)
    assert leases.exchange([done(lease, "e" * 64)], 0).ended == frozenset()
    assert store.job(job.id) == before
    assert before[0].state is JobState.SUCCEEDED


def test_a_job_that_fails_goes_on_and_names_its_frames(store: JobStore) -> None:
    job = store.submit(wanted(3))
    leases = Leases(store, "a")
    first, second, third = leases.exchange([], 3).claimed
    leases.exchange([Failed(first, "deadline", "too slow", may_retry=False), done(second)], 0)
    going_on = store.job(job.id)[0].state
    leases.exchange([done(third)], 0)
    failed, counts, _ = store.job(job.id)

    assert going_on is JobState.RUNNING
    assert failed.state is JobState.FAILED
    assert failed.error == {"kind": "deadline", "detail": "too slow", "frames": [0]}
    assert counts == Counts(total=3, done=2, failed=1)
    assert store.frame(job.id, 0).error == {"kind": "deadline", "detail": "too slow"}


def test_a_retry_draws_only_what_failed(store: JobStore) -> None:
    job = store.submit(wanted(2))
    leases = Leases(store, "a")
    first, second = leases.exchange([], 2).claimed
    leases.exchange([Failed(first, "deadline", "too slow", may_retry=False), done(second)], 0)
    again = store.act(job.id, Action.RETRY)
    (lease,) = leases.exchange([], 5).claimed
    leases.exchange([done(lease)], 0)

    assert (again.state, again.error, again.finished) == (JobState.QUEUED, None, None)
    assert (lease.index, lease.attempts) == (0, 0)
    assert store.job(job.id)[0].state is JobState.SUCCEEDED


def test_a_paused_job_gives_out_no_frames(store: JobStore) -> None:
    job = store.submit(wanted(2))
    leases = Leases(store, "a")
    (lease,) = leases.exchange([], 1).claimed
    store.act(job.id, Action.PAUSE)

    assert leases.exchange([], 5, held=[lease]).claimed == ()
    assert leases.exchange([], 0, held=[lease]).unwanted == frozenset()
    store.act(job.id, Action.RESUME)
    assert len(leases.exchange([], 5).claimed) == 1


def test_a_cancelled_job_is_unwanted_and_keeps_what_is_done(store: JobStore) -> None:
    job = store.submit(wanted(3))
    leases = Leases(store, "a")
    first, second = leases.exchange([], 2).claimed
    leases.exchange([done(first)], 0)
    store.act(job.id, Action.CANCEL)
    got = leases.exchange([done(second)], 5, held=[second])

    assert got.unwanted == {job.id}
    assert got.claimed == ()
    assert store.job(job.id)[1] == Counts(total=3, done=1, pending=2)


def test_what_jobs_hold_is_pinned(store: JobStore) -> None:
    store.submit(wanted(2))
    leases = Leases(store, "a")
    first, _ = leases.exchange([], 2).claimed
    leases.exchange([done(first)], 0)

    assert store.pinned() == {artifact_name(first.key, "f")}


def test_the_pace_is_that_of_the_latest_frames(store: JobStore) -> None:
    job = store.submit(wanted(3))
    leases = Leases(store, "a")
    for lease in leases.exchange([], 3).claimed:
        leases.exchange([done(lease)], 0)
    pace = store.job(job.id)[2]

    assert pace.frames == 2
    assert 0 < pace.seconds < 5
