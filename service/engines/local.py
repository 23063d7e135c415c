"""The embedded engine: worker processes on this machine.

Two lanes of slots. Batch: one process a core, each drawing on one thread, niced. Interactive: one process that draws
with every core. An interactive frame that finds its process busy goes to a batch process; while any interactive
frame runs, no new batch frame starts, but for one whenever batch has been held back for ``PATIENCE``.
"""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import wait as wait_for
from pathlib import Path
from time import monotonic
from typing import Any, Literal

from renderer.errors import DeviceError
from service.engines.base import Lane, Readiness, WorkerStatus, judge
from service.engines.queue import Entry, Lanes
from service.engines.slot import NeverBegun, Recycling, Slot
from service.engines.watch import TICK
from service.errors import EngineUnavailable
from service.worker import Drawer, FrameReport, FrameTask, WorkerConfig, WorkerFacts

log = logging.getLogger(__name__)

PATIENCE = 2.0
"""Seconds for which interactive frames may hold batch frames back before one of these starts all the same."""
NICENESS = 10
"""Of batch processes: an interactive one beside them gets nine tenths of a core."""

MOST_RETURNS = 3
"""How often a frame goes round again because its process was gone before it began."""

Delivery = tuple[Entry, FrameReport | BaseException]


class LocalEngine:
    """Worker processes on this machine, see the module's text.

    ``workers`` None is one a core. ``make`` draws instead of a ``Worker``, in tests.
    """

    def __init__(
        self,
        artifacts: Path,
        *,
        workers: int | None = None,
        interactive: bool = True,
        require: Literal["any", "gpu", "cpu"] = "any",
        max_frames_per_worker: int = 10_000,
        max_rss: int = 2 << 30,
        make: Callable[[WorkerConfig], Drawer] | None = None,
    ) -> None:
        cores = len(os.sched_getaffinity(0))
        recycling = Recycling(max_frames_per_worker, max_rss)
        batch = WorkerConfig(artifacts, threads=0, nice=NICENESS, require=require, make=make)
        whole = WorkerConfig(artifacts, threads=cores, require=require, make=make)
        self._batch = [Slot(f"batch-{i}", Lane.BATCH, batch, recycling, self._done) for i in range(workers or cores)]
        self._interactive = [Slot("interactive", Lane.INTERACTIVE, whole, recycling, self._done)] if interactive else []
        self._slots = [*self._interactive, *self._batch]
        self._lanes = Lanes()
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)
        self._held_since: float | None = None
        self._is_closed = False
        self._supervisor = threading.Thread(target=self._supervise, name="engine-supervisor", daemon=True)

    # ------------------------------------------------------------------------------------------------ the seam

    @property
    def capacity(self) -> int:
        """How many batch frames it draws at a time."""
        return len(self._batch)

    @property
    def fingerprint(self) -> str:
        """What besides a frame's key decides its bytes.

        Raises ``EngineUnavailable`` until a worker is up, or the ``DeviceError`` that keeps all from coming up.
        """
        return self._facts().fingerprint

    @property
    def driver(self) -> str:
        """The OpenGL driver's name; empty until a worker is up."""
        try:
            return self._facts().driver
        except (EngineUnavailable, DeviceError):
            return ""

    def start(self) -> None:
        """Bring the workers up, in the background: one first, since a cold start bakes the scene's data."""
        with self._lock:
            self._slots[0].launch()
        self._supervisor.start()

    def wait_ready(self, timeout: float) -> None:
        """Return when every worker can draw.

        Raises the worker's own ``DeviceError`` where it says that it never will, ``EngineUnavailable`` after
        ``timeout`` seconds.
        """
        deadline = monotonic() + timeout
        with self._changed:
            while not self.readiness().is_ready:
                for slot in self._slots:
                    if isinstance(slot.error, DeviceError):
                        raise slot.error
                left = deadline - monotonic()
                if left <= 0 or self._is_closed:
                    raise EngineUnavailable(f"The workers are not ready: {self.readiness().detail}.")
                self._changed.wait(left)

    def submit(self, task: FrameTask, lane: Lane) -> Future[FrameReport]:
        """Queue a frame; see ``Engine``."""
        with self._lock:
            if self._is_closed:
                raise EngineUnavailable("The engine is closed.", retry_after=5)
            entry = self._lanes.add(task, lane)
            self._pump()
        return entry.future

    def promote(self, future: Future[FrameReport]) -> None:
        """Move a frame that still waits in the batch lane to the interactive one."""
        with self._lock:
            if self._lanes.promote(future):
                self._pump()

    def cancel(self, future: Future[FrameReport]) -> None:
        """Drop a frame that waits; tell one that is being drawn to stop at its next sample."""
        future.cancel()
        with self._lock:
            self._lanes.drop(future)
            for slot in self._slots:
                if slot.entry is not None and slot.entry.future is future:
                    slot.cancel()

    def status(self) -> tuple[WorkerStatus, ...]:
        """What is known of each worker."""
        with self._lock:
            return tuple(slot.status() for slot in self._slots)

    def readiness(self) -> Readiness:
        """Whether every worker has drawn its canary, and all alike."""
        return judge(self.status())

    def close(self, grace: float = 5.0) -> None:
        """Take nothing more, give running frames ``grace`` seconds, end the workers."""
        with self._lock:
            self._is_closed = True
            waiting = self._lanes.drain()
            running = [slot.entry.future for slot in self._slots if slot.entry is not None]
            self._changed.notify_all()
        closed = EngineUnavailable("The engine is closed.", retry_after=5)
        self._deliver([(entry, closed) for entry in waiting])
        wait_for(running, grace)
        with self._lock:
            late = [slot.entry for slot in self._slots if slot.entry is not None]
            for slot in self._slots:
                slot.close()
        self._deliver([(entry, closed) for entry in late])
        if self._supervisor.is_alive():
            self._supervisor.join()
        for slot in self._slots:
            slot.join(5.0)

    # ------------------------------------------------------------------------------------------------ hidden

    def _facts(self) -> WorkerFacts:
        with self._lock:
            for slot in self._slots:
                if slot.facts is not None:
                    return slot.facts
            error = next((slot.error for slot in self._slots if slot.error is not None), None)
        if isinstance(error, DeviceError):
            raise error
        raise EngineUnavailable(None if error is None else str(error), retry_after=2)

    def _done(self, slot: Slot, generation: int, entry: Entry | None, future: Future[Any]) -> None:
        """A process reported, or ended; called by pebble's threads."""
        delivery: list[Delivery] = []
        with self._lock:
            if generation != slot.generation or (self._is_closed and entry is None):
                return
            if entry is None:
                slot.introduced(future)
                self._launch_next()
            else:
                outcome = slot.finished(entry, future)
                if isinstance(outcome, NeverBegun) and entry.returns < MOST_RETURNS and not self._is_closed:
                    self._lanes.put_back(entry)
                elif isinstance(outcome, NeverBegun):
                    delivery.append((entry, EngineUnavailable("The worker processes end before they begin.")))
                else:
                    delivery.append((entry, outcome))
            self._pump()
            self._changed.notify_all()
        self._deliver(delivery)

    def _launch_next(self) -> None:
        """Bring up the slots that waited for the first one."""
        for slot in self._slots:
            if slot.generation == 0:
                slot.launch()

    def _pump(self) -> None:
        """Give every free process the frame that it should draw next."""
        if self._is_closed:
            return
        for slot in self._slots:
            while slot.state == "idle" and (entry := self._next_for(slot)) is not None:
                slot.run(entry)

    def _next_for(self, slot: Slot) -> Entry | None:
        if (entry := self._lanes.take(Lane.INTERACTIVE)) is not None:
            return entry
        if slot.lane is Lane.INTERACTIVE:
            return None
        if self._lanes.waiting(Lane.BATCH) == 0:
            self._held_since = None
            return None
        now = monotonic()
        if any(s.entry is not None and s.entry.lane is Lane.INTERACTIVE for s in self._slots):
            self._held_since = self._held_since or now
            if now - self._held_since < PATIENCE:
                return None
        self._held_since = None
        return self._lanes.take(Lane.BATCH)

    def _supervise(self) -> None:
        """Look after the processes until the engine closes."""
        while True:
            delivery: list[Delivery] = []
            with self._changed:
                if self._changed.wait_for(lambda: self._is_closed, TICK):
                    return
                now = monotonic()
                for slot in self._slots:
                    entry, was = slot.entry, slot.state
                    lost = slot.watch(now)
                    if lost is not None and entry is not None:
                        delivery.append((entry, lost))
                    if slot.state != was:
                        self._changed.notify_all()
                self._recycle()
                self._pump()
            self._deliver(delivery)

    def _recycle(self) -> None:
        """Replace one process that has drawn its share, if none is missing already."""
        if all(slot.state in {"idle", "busy"} for slot in self._slots):
            worn = next((slot for slot in self._slots if slot.wants_replacing), None)
            if worn is not None:
                log.info("worker %s is replaced after its share of frames or bytes", worn.name)
                worn.replace_process()

    @staticmethod
    def _deliver(delivery: list[Delivery]) -> None:
        """Tell who waits; never under the lock, since they may come straight back in."""
        for entry, outcome in delivery:
            if not entry.is_taken and not entry.future.set_running_or_notify_cancel():
                continue
            if isinstance(outcome, BaseException):
                entry.future.set_exception(outcome)
            else:
                entry.future.set_result(outcome)
