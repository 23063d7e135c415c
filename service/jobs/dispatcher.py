"""The dispatcher: one thread that leases frames, has them drawn, and reports.

It keeps ``slots + 1`` frames on their way, so that no core waits for the next and little has to be taken back.
Leases are fetched a few ahead and reports handed in together, since a transaction costs as much for one as for ten.
A frame that is stored already, by key and checksum, is done without drawing. What an engine or a disk can't do at
present is no frame's fault: the frame is released and the dispatcher holds its breath.
"""

from __future__ import annotations

import json
import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue
from time import monotonic, time

from sqlalchemy.exc import OperationalError

from renderer.errors import Cancelled, InvalidRequest, MillpondError
from renderer.request import FrameRequest
from service.engines.base import Lane
from service.errors import FramePoisoned, FrameTimedOut, Overloaded, WorkerDied
from service.flights import Ticket
from service.frames import FrameCache
from service.jobs.job import Done, Failed, Lease, Released, Report
from service.jobs.leases import LEASE_SECONDS, Leases
from service.jobs.store import JobStore
from service.worker import FrameReport

log = logging.getLogger(__name__)

TICK = 1.0
"""Seconds after which it looks again even if nothing happened."""
INTERVAL = 0.25
"""Seconds for which reports are gathered before they are handed in together."""
MOST_AHEAD = 64
"""Leases that it may hold beside those on their way."""
TRIES = 2
"""How often a frame may be begun."""
LONGEST_HOLD = 5.0
"""Seconds for which it waits at most after it met an outage."""
LOST_SECONDS = 600.0
"""Age at which a frame on its way counts as lost: the engine's own deadlines end frames long before."""
HOUSEKEEPING = 30.0
"""Seconds between two looks at what has expired."""


@dataclass(frozen=True)
class _Out:
    lease: Lease
    ticket: Ticket
    since: float


class Dispatcher:
    """See the module's text. ``on_ended`` is told the id of each job that ended."""

    def __init__(
        self,
        store: JobStore,
        cache: FrameCache,
        *,
        owner: str,
        expiry_seconds: float,
        on_ended: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._store = store
        self._cache = cache
        self._leases = Leases(store, owner)
        self._expiry_seconds = expiry_seconds
        self._on_ended = on_ended
        self._ready: deque[Lease] = deque()
        self._out: dict[Lease, _Out] = {}
        self._landed: SimpleQueue[tuple[Lease, Future[FrameReport]]] = SimpleQueue()
        self._reports: list[Report] = []
        self._wakes = threading.Event()
        self._is_asked = self._is_closed = False
        self._ahead = 2
        self._may_claim = True
        """Whether the last exchange gave all that was wanted, so that the next may too."""
        self._last = self._hold_until = self._renew_at = self._clean_at = 0.0
        self._thread = threading.Thread(target=self._run, name="dispatcher", daemon=True)

    def start(self, *, is_alone: bool) -> None:
        """Take back what earlier dispatchers held, and begin.

        ``is_alone`` says that none of them can be alive.
        """
        taken = self._leases.reclaim(everything=is_alone)
        if taken:
            log.info("%d frames that were under way are drawn again unless they are stored", taken)
        self._thread.start()

    def wake(self) -> None:
        """Something was submitted or decided: look at once."""
        self._is_asked = True
        self._wakes.set()

    def close(self, timeout: float = 10.0) -> None:
        """Stop claiming; what is on its way is released and drawn after the next start."""
        self._is_closed = True
        self.wake()
        if self._thread.is_alive():
            self._thread.join(timeout)

    # ------------------------------------------------------------------------------------------------ the thread

    def _run(self) -> None:
        while not self._is_closed:
            self._wakes.wait(INTERVAL if self._reports else TICK)
            self._wakes.clear()
            try:
                self._round()
                self._clean()
            except OperationalError:  # locked or full: what is to be reported is kept
                log.exception("the job store can't be written")
                self._hold(LONGEST_HOLD)
        self._withdraw()

    def _round(self) -> None:
        """Report, claim, begin, until there is nothing more to do at once."""
        self._collect()
        self._fill()
        while self._is_due() and not self._is_closed:
            self._exchange()
            self._fill()

    @property
    def _room(self) -> int:
        """How many more frames may be on their way."""
        return 0 if monotonic() < self._hold_until else self._cache.engine.capacity + 1 - len(self._out)

    def _is_due(self) -> bool:
        """Whether it is time for a transaction."""
        if self._is_asked or monotonic() > self._last + TICK:
            return True
        if self._reports and (monotonic() > self._last + INTERVAL or not (self._out or self._ready)):
            return True
        return self._room > 0 and not self._ready and self._may_claim

    def _exchange(self) -> None:
        """Hand in the reports, fetch leases."""
        if self._is_asked:  # something more urgent may be there now: choose anew
            self._is_asked = False
            self._reports += map(Released, self._ready)
            self._ready.clear()
        reported = tuple(self._reports)
        self._ahead = min(MOST_AHEAD, max(2, 2 * len(reported)))
        room = self._room
        want = room + self._ahead - len(self._ready) if room > 0 else 0
        renews = monotonic() > self._renew_at
        got = self._leases.exchange(reported, want, [*self._out, *self._ready], renews=renews)
        self._last = monotonic()
        del self._reports[: len(reported)]
        if renews:
            self._renew_at = self._last + LEASE_SECONDS / 3
        self._may_claim = want > 0 and len(got.claimed) == want
        for job_id in got.ended:
            self._on_ended(job_id)
        self._drop(got.unwanted)
        self._ready += got.claimed

    def _drop(self, job_ids: frozenset[str]) -> None:
        """Draw nothing more for these jobs."""
        for out in [out for out in self._out.values() if out.lease.job_id in job_ids]:
            del self._out[out.lease]
            out.ticket.leave()
        if job_ids:
            self._ready = deque(lease for lease in self._ready if lease.job_id not in job_ids)

    def _fill(self) -> None:
        """Send off what is ready, as far as there is room."""
        while self._ready and self._room > 0 and not self._is_closed:
            self._begin(self._ready.popleft())

    def _begin(self, lease: Lease) -> None:
        try:
            request = FrameRequest.parse(json.loads(lease.request))
            drawn = self._cache.draw(request, Lane.BATCH)
        except InvalidRequest as error:  # accepted by an earlier version
            self._reports.append(Failed(lease, "invalid-request", str(error), may_retry=False))
        except MillpondError as error:
            self._reports.append(self._judge(lease, error))
        else:
            if isinstance(drawn, FrameReport):
                self._reports.append(_done(lease, drawn))
                return
            self._out[lease] = _Out(lease, drawn, monotonic())
            drawn.future.add_done_callback(partial(self._land, lease))

    def _land(self, lease: Lease, future: Future[FrameReport]) -> None:
        """Called by whichever thread ends the frame."""
        self._landed.put((lease, future))
        self._wakes.set()

    def _collect(self) -> None:
        """Turn what has landed, and what is lost, into reports."""
        while not self._landed.empty():
            lease, future = self._landed.get()
            if self._out.pop(lease, None) is None or future.cancelled():
                continue
            error = future.exception()
            self._reports.append(_done(lease, future.result()) if error is None else self._judge(lease, error))
        for out in [out for out in self._out.values() if monotonic() - out.since > LOST_SECONDS]:
            log.error("frame %d of job %s never came back: it is drawn again", out.lease.index, out.lease.job_id)
            del self._out[out.lease]
            out.ticket.leave()
            self._reports.append(Released(out.lease))

    def _judge(self, lease: Lease, error: BaseException) -> Report:
        """The report of a frame that was not drawn."""
        if isinstance(error, Overloaded):
            self._hold(error.retry_after)
            return Released(lease)
        if isinstance(error, Cancelled):
            return Released(lease)
        may_retry = lease.attempts + 1 < TRIES and not isinstance(error, FramePoisoned)
        return Failed(lease, _kind(error), str(error), may_retry)

    def _hold(self, seconds: float) -> None:
        self._hold_until = monotonic() + min(seconds, LONGEST_HOLD)

    def _withdraw(self) -> None:
        """Give back what is on its way, so that the next dispatcher begins at once."""
        self._collect()
        for out in self._out.values():
            out.ticket.leave()
        self._reports += map(Released, [*self._out, *self._ready])
        self._out.clear()
        self._ready.clear()
        try:
            self._leases.exchange(self._reports, 0)
        except OperationalError:
            log.exception("the job store can't be written; the next start takes the frames back")

    def _clean(self) -> None:
        """Forget what has expired, and keep the artifacts' budget."""
        if self._cache.artifacts.is_over_budget:
            self._cache.artifacts.trim(self._store.pinned().__contains__)
        if monotonic() < self._clean_at:
            return
        self._clean_at = monotonic() + HOUSEKEEPING
        self._leases.reclaim()
        expired = self._store.expire(time() - self._expiry_seconds)
        if expired:
            log.info("%d jobs expired", expired)


def _done(lease: Lease, report: FrameReport) -> Done:
    return Done(lease, report.key, report.digest, report.size, report.fingerprint)


def _kind(error: BaseException) -> str:
    """The kind of problem that the API shows."""
    kinds = {FramePoisoned: "frame-set-aside", FrameTimedOut: "deadline", WorkerDied: "renderer-crashed"}
    return kinds.get(type(error), "render-failed") if isinstance(error, MillpondError) else "internal-error"
