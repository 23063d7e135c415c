"""Leases: which frames a dispatcher may work on, and what it reports of them. All of it in few transactions."""

from __future__ import annotations

import logging
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from time import time
from typing import Any

from sqlalchemy import Connection, and_, bindparam, select, update

from service.jobs.job import Done, Failed, FrameState, JobState, Lease, Released, Report
from service.jobs.schema import FRAMES, JOBS
from service.jobs.store import JobStore, settle, start

log = logging.getLogger(__name__)

LEASE_SECONDS = 60.0
"""How long a lease holds unless it is renewed."""

_HELD = and_(
    FRAMES.c.job_id == bindparam("of_job"),
    FRAMES.c.number == bindparam("of_index"),
    FRAMES.c.state == FrameState.LEASED,
    FRAMES.c.fence == bindparam("of_fence"),
)
"""A frame that is still under the lease; a report with any other fence changes nothing."""


@dataclass(frozen=True)
class Exchange:
    """What a dispatcher got for its reports."""

    claimed: tuple[Lease, ...]
    unwanted: frozenset[str]
    """Ids of its jobs for which nothing should be drawn any more."""
    ended: frozenset[str]
    """Ids of the jobs that the reports ended."""


class Leases:
    """One dispatcher's side of the store; ``owner`` names it."""

    def __init__(self, store: JobStore, owner: str, seconds: float = LEASE_SECONDS) -> None:
        self._store = store
        self._owner = owner
        self._seconds = seconds

    def exchange(
        self, reports: Sequence[Report], want: int, held: Collection[Lease] = (), *, renews: bool = False
    ) -> Exchange:
        """Hand in reports, claim up to ``want`` frames, ask about the leases held: one transaction.

        Reports without a lease are recorded in the log and change nothing. Frames come from the jobs of highest
        priority, the oldest first. The caller names in ``held`` only what it knows to be under way; ``renews``
        has these leases hold longer.
        """
        with self._store.writing() as connection:
            ended = _apply(connection, reports)
            if renews:
                self._renew(connection, held)
            claimed = self._claim(connection, want) if want > 0 else ()
            return Exchange(claimed, _unwanted(connection, held), ended)

    def reclaim(self, *, everything: bool = False) -> int:
        """Take back leases that have ended, or all of them, where no other dispatcher can be alive."""
        leased = FRAMES.c.state == FrameState.LEASED
        ended = leased if everything else and_(leased, FRAMES.c.lease_ends < time())
        with self._store.writing() as connection:
            taken = connection.execute(update(FRAMES).where(ended).values(state=FrameState.PENDING))
            return int(taken.rowcount)

    def _renew(self, connection: Connection, held: Collection[Lease]) -> None:
        if held:
            renewed = update(FRAMES).where(_HELD).values(lease_ends=time() + self._seconds)
            connection.execute(renewed, [_place(lease) for lease in held])

    def _claim(self, connection: Connection, want: int) -> tuple[Lease, ...]:
        active = (
            select(JOBS.c.id)
            .where(JOBS.c.state.in_([JobState.QUEUED, JobState.RUNNING]))
            .order_by(JOBS.c.priority.desc(), JOBS.c.created, JOBS.c.id)
        )
        claimed: list[Lease] = []
        for job_id in list(connection.scalars(active)):
            if len(claimed) == want:
                break
            found = self._claim_of(connection, job_id, want - len(claimed))
            if found:
                start(connection, job_id)
            claimed += found
        if claimed:
            leased = (
                update(FRAMES)
                .where(FRAMES.c.job_id == bindparam("of_job"), FRAMES.c.number == bindparam("of_index"))
                .values(
                    state=FrameState.LEASED,
                    fence=bindparam("of_fence"),
                    lease_owner=self._owner,
                    lease_ends=time() + self._seconds,
                )
            )
            connection.execute(leased, [_place(lease) for lease in claimed])
        return tuple(claimed)

    @staticmethod
    def _claim_of(connection: Connection, job_id: str, want: int) -> list[Lease]:
        columns = (FRAMES.c.number, FRAMES.c.fence, FRAMES.c.key, FRAMES.c.request, FRAMES.c.attempts)
        pending = (
            select(*columns)
            .where(FRAMES.c.job_id == job_id, FRAMES.c.state == FrameState.PENDING)
            .order_by(FRAMES.c.rank)
            .limit(want)
            .with_for_update(skip_locked=True)  # PostgreSQL; SQLite has one writer anyway
        )
        return [
            Lease(job_id, row.number, row.fence + 1, row.key, row.request, row.attempts)
            for row in connection.execute(pending)
        ]


def _apply(connection: Connection, reports: Sequence[Report]) -> frozenset[str]:
    done = [_done(report) for report in reports if isinstance(report, Done)]
    failed = [_failed(report) for report in reports if isinstance(report, Failed)]
    released = [_place(report.lease) for report in reports if isinstance(report, Released)]
    applied = 0
    if done:
        names = ("key", "digest", "size", "fingerprint", "finished")
        values: dict[str, Any] = {name: bindparam(f"new_{name}") for name in names}
        written = update(FRAMES).where(_HELD).values(state=FrameState.DONE, error=None, **values)
        applied += connection.execute(written, done).rowcount
    if failed:
        values = {name: bindparam(f"new_{name}") for name in ("state", "error", "attempts")}
        applied += connection.execute(update(FRAMES).where(_HELD).values(values), failed).rowcount
    if released:
        back = update(FRAMES).where(_HELD).values(state=FrameState.PENDING)
        applied += connection.execute(back, released).rowcount
    if applied != len(reports):
        log.info("%d of %d reports came without their lease and changed nothing", len(reports) - applied, len(reports))
    jobs = {report.lease.job_id for report in reports}
    return frozenset(job_id for job_id in jobs if settle(connection, job_id))


def _unwanted(connection: Connection, held: Collection[Lease]) -> frozenset[str]:
    ids = {lease.job_id for lease in held}
    if not ids:
        return frozenset()
    wanted = select(JOBS.c.id).where(
        JOBS.c.id.in_(ids), JOBS.c.state.in_([JobState.RUNNING, JobState.PAUSED, JobState.QUEUED])
    )
    return frozenset(ids - set(connection.scalars(wanted)))


def _place(lease: Lease) -> dict[str, object]:
    return {"of_job": lease.job_id, "of_index": lease.index, "of_fence": lease.fence}


def _done(report: Done) -> dict[str, object]:
    return {
        **_place(report.lease),
        "new_key": report.key,
        "new_digest": report.digest,
        "new_size": report.size,
        "new_fingerprint": report.fingerprint,
        "new_finished": time(),
    }


def _failed(report: Failed) -> dict[str, object]:
    return {
        **_place(report.lease),
        "new_state": FrameState.PENDING if report.may_retry else FrameState.FAILED,
        "new_error": {"kind": report.kind, "detail": report.detail},
        "new_attempts": report.lease.attempts + 1,
    }
