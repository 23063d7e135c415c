"""The truth about jobs: what was submitted, where each stands, what of it is done. Durable before it is answered."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import time
from typing import Any

from sqlalchemy import Connection, and_, delete, func, insert, or_, select, update
from sqlalchemy.exc import IntegrityError

from service.artifacts import artifact_name
from service.errors import IdempotencyConflict, JobExpired, UnknownFrame, UnknownJob
from service.jobs.job import ENDED, Action, Counts, FrameRecord, FrameState, Job, JobState, after
from service.jobs.schema import FRAMES, JOBS, open_database

_PACE_FRAMES = 32
"""The latest frames by which a job's speed is told."""


@dataclass(frozen=True)
class Submission:
    """A job to be written down, checked and complete."""

    kind: str
    spec: Mapping[str, Any]
    frames: Sequence[tuple[str, bytes]]
    """Key and canonical request of each, by index."""
    body_digest: str
    """SHA-256 of what the caller sent."""
    priority: int = 0
    order: Sequence[int] | None = None
    """Indices in the order of drawing; None is their own."""
    idempotency_key: str | None = None


@dataclass(frozen=True)
class Pace:
    """How fast a job's frames came of late."""

    frames: int
    seconds: float


class JobStore:
    """Jobs and frames in a SQL database; thread-safe. ``url`` is SQLAlchemy's."""

    def __init__(self, url: str) -> None:
        self._engine = open_database(url)

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that writes: all of it, or nothing."""
        with self._engine.connect().execution_options(writes=True) as connection, connection.begin():
            yield connection

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that reads: one moment of the store."""
        with self._engine.connect() as connection, connection.begin():
            yield connection

    # ------------------------------------------------------------------------------------------------ writing

    def submit(self, submission: Submission) -> Job:
        """Write a job down with all its frames; the same idempotency key and body give the same job again.

        Raises ``IdempotencyConflict``.
        """
        try:
            with self.writing() as connection:
                earlier = _earlier(connection, submission)
                return earlier or _insert(connection, submission)
        except IntegrityError:  # somebody else wrote the same idempotency key just now
            with self.reading() as connection:
                earlier = _earlier(connection, submission)
            if earlier is None:
                raise
            return earlier

    def act(self, job_id: str, action: Action) -> Job:
        """Let something happen to a job. Raises ``UnknownJob``, ``JobExpired``, ``TransitionRefused``."""
        with self.writing() as connection:
            job = _job(connection, job_id)
            state = after(job.state, action, job_id)
            if state is job.state:
                return job
            _move(connection, job, state)
            of_job = FRAMES.c.job_id == job_id
            if action is Action.CANCEL:  # leases end here, and late reports find nothing leased
                leased = and_(of_job, FRAMES.c.state == FrameState.LEASED)
                connection.execute(update(FRAMES).where(leased).values(state=FrameState.PENDING))
            elif action is Action.RETRY:
                failed = and_(of_job, FRAMES.c.state == FrameState.FAILED)
                again = {"state": FrameState.PENDING, "attempts": 0, "error": None}
                connection.execute(update(FRAMES).where(failed).values(again))
            return _job(connection, job_id)

    def expire(self, before: float) -> int:
        """Forget the frames of jobs that ended before a time, seconds since 1970; returns how many jobs."""
        with self.writing() as connection:
            ended = select(JOBS.c.id).where(JOBS.c.state.in_(ENDED - {JobState.EXPIRED}), JOBS.c.finished < before)
            ids = list(connection.scalars(ended))
            for job_id in ids:
                job = _job(connection, job_id)
                _move(connection, job, after(job.state, Action.EXPIRE))
                connection.execute(delete(FRAMES).where(FRAMES.c.job_id == job_id))
            return len(ids)

    # ------------------------------------------------------------------------------------------------ reading

    def job(self, job_id: str) -> tuple[Job, Counts, Pace]:
        """A job with its counts and pace. Raises ``UnknownJob``, ``JobExpired``."""
        with self.reading() as connection:
            job = _job(connection, job_id)
            return job, counts(connection, job), _pace(connection, job_id)

    def jobs(
        self, *, state: JobState | None = None, before: tuple[float, str] | None = None, limit: int = 50
    ) -> list[tuple[Job, Counts, Pace]]:
        """Jobs, the newest first; ``before`` is the creation time and id of the last one seen."""
        query = select(JOBS).order_by(JOBS.c.created.desc(), JOBS.c.id.desc()).limit(limit)
        if state is not None:
            query = query.where(JOBS.c.state == state)
        if before is not None:
            created, job_id = before
            query = query.where(or_(JOBS.c.created < created, and_(JOBS.c.created == created, JOBS.c.id < job_id)))
        with self.reading() as connection:
            found = [_as_job(row) for row in connection.execute(query).mappings()]
            return [(job, counts(connection, job), _pace(connection, job.id)) for job in found]

    def frames(self, job_id: str, *, start: int = 0, limit: int | None = None) -> list[FrameRecord]:
        """A job's frames from an index on. Raises ``UnknownJob``, ``JobExpired``."""
        query = (
            select(FRAMES)
            .where(FRAMES.c.job_id == job_id, FRAMES.c.number >= start)
            .order_by(FRAMES.c.number)
            .limit(limit)
        )
        with self.reading() as connection:
            _job(connection, job_id)
            return [_as_frame(row) for row in connection.execute(query).mappings()]

    def frame(self, job_id: str, index: int) -> FrameRecord:
        """One frame of a job. Raises ``UnknownFrame`` too."""
        with self.reading() as connection:
            job = _job(connection, job_id)
            query = select(FRAMES).where(FRAMES.c.job_id == job_id, FRAMES.c.number == index)
            row = connection.execute(query).mappings().first()
        if row is None:
            raise UnknownFrame(job_id, index, job.total)
        return _as_frame(row)

    def pinned(self) -> frozenset[str]:
        """Names of the artifacts that jobs hold."""
        query = select(FRAMES.c.key, FRAMES.c.fingerprint).where(FRAMES.c.state == FrameState.DONE).distinct()
        with self.reading() as connection:
            return frozenset(artifact_name(key, fingerprint) for key, fingerprint in connection.execute(query))


# ------------------------------------------------------------------------------------------------ inside a transaction


def counts(connection: Connection, job: Job) -> Counts:
    """How many of a job's frames are in which state."""
    query = select(FRAMES.c.state, func.count()).where(FRAMES.c.job_id == job.id).group_by(FRAMES.c.state)
    return Counts(job.total, **{str(state): number for state, number in connection.execute(query)})


def settle(connection: Connection, job_id: str) -> bool:
    """End a job of which nothing is left to draw; returns whether it ended now."""
    job = _as_job(connection.execute(select(JOBS).where(JOBS.c.id == job_id)).mappings().one())
    now = counts(connection, job)
    if job.state in ENDED or now.pending or now.leased:
        return False
    if job.state is JobState.QUEUED:
        _move(connection, job, after(job.state, Action.START))
        job = _job(connection, job_id)
    if now.failed == 0:
        _move(connection, job, after(job.state, Action.SUCCEED))
        return True
    failed = select(FRAMES.c.number, FRAMES.c.error).where(
        FRAMES.c.job_id == job_id, FRAMES.c.state == FrameState.FAILED
    )
    rows = connection.execute(failed.order_by(FRAMES.c.number)).all()
    error = {**(rows[0].error or {}), "frames": [row.number for row in rows]}
    _move(connection, job, after(job.state, Action.FAIL), error)
    return True


def start(connection: Connection, job_id: str) -> None:
    """Note that a queued job's first frame is begun."""
    job = _job(connection, job_id)
    if job.state is JobState.QUEUED:
        _move(connection, job, after(job.state, Action.START))


def _move(connection: Connection, job: Job, state: JobState, error: Mapping[str, Any] | None = None) -> None:
    values: dict[str, Any] = {"state": state, "error": error}
    if state is JobState.EXPIRED:
        values.pop("error")
    elif state in ENDED:
        values["finished"] = time()
    else:
        values["finished"] = None
    if state is JobState.RUNNING and job.started is None:
        values["started"] = time()
    connection.execute(update(JOBS).where(JOBS.c.id == job.id).values(values))


def _insert(connection: Connection, submission: Submission) -> Job:
    job_id, total = secrets.token_hex(8), len(submission.frames)
    rank = {index: place for place, index in enumerate(submission.order or range(total))}
    connection.execute(
        insert(JOBS).values(
            id=job_id,
            kind=submission.kind,
            state=JobState.QUEUED,
            spec=dict(submission.spec),
            total=total,
            priority=submission.priority,
            created=time(),
            idempotency_key=submission.idempotency_key,
            body_digest=submission.body_digest,
        )
    )
    rows = [
        {
            "job_id": job_id,
            "number": index,
            "rank": rank[index],
            "state": FrameState.PENDING,
            "key": key,
            "request": request,
        }
        for index, (key, request) in enumerate(submission.frames)
    ]
    connection.execute(insert(FRAMES), rows)
    return _job(connection, job_id)


def _earlier(connection: Connection, submission: Submission) -> Job | None:
    if submission.idempotency_key is None:
        return None
    query = select(JOBS).where(JOBS.c.idempotency_key == submission.idempotency_key)
    row = connection.execute(query).mappings().first()
    if row is None:
        return None
    if row["body_digest"] != submission.body_digest:
        raise IdempotencyConflict(submission.idempotency_key, row["id"])
    return _as_job(row)


def _job(connection: Connection, job_id: str) -> Job:
    row = connection.execute(select(JOBS).where(JOBS.c.id == job_id)).mappings().first()
    if row is None:
        raise UnknownJob(job_id)
    job = _as_job(row)
    if job.state is JobState.EXPIRED:
        raise JobExpired(job_id)
    return job


def _pace(connection: Connection, job_id: str) -> Pace:
    latest = (
        select(FRAMES.c.finished)
        .where(FRAMES.c.job_id == job_id, FRAMES.c.state == FrameState.DONE)
        .order_by(FRAMES.c.finished.desc())
        .limit(_PACE_FRAMES)
    )
    times = list(connection.scalars(latest))
    return Pace(max(0, len(times) - 1), times[0] - times[-1] if times else 0.0)


def _as_job(row: Mapping[Any, Any]) -> Job:
    names = ("id", "kind", "spec", "total", "priority", "created", "started", "finished", "error")
    return Job(state=JobState(row["state"]), **{name: row[name] for name in names})


def _as_frame(row: Mapping[Any, Any]) -> FrameRecord:
    names = ("job_id", "key", "request", "attempts", "digest", "size", "fingerprint", "error")
    known = {name: row[name] for name in names}
    return FrameRecord(index=row["number"], state=FrameState(row["state"]), **known)
