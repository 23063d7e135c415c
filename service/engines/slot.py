"""One worker process: the pebble pool of one that keeps it alive, and the watch over it.

Each process has a pool of its own because pebble's workers share one pipe and its locks: a process that is killed or
stopped while it holds them takes its neighbours along, and a kill meant for one task can hit the next (pebble issue
153). With one process and one task a pool, a death belongs to exactly one frame, and cancelling never kills.

Nothing here locks: the engine calls it under its own lock.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from ctypes import c_long
from dataclasses import dataclass, replace
from math import inf
from multiprocessing import get_context
from time import monotonic
from typing import Any

import psutil
from pebble import ProcessExpired, ProcessPool

from service.engines.base import Lane, WorkerState, WorkerStatus
from service.engines.queue import Entry
from service.engines.watch import Watch
from service.errors import EngineUnavailable, FrameTimedOut, WorkerDied
from service.worker import START_LIMIT, FrameReport, WorkerConfig, WorkerFacts, introduce, render_frame, start

log = logging.getLogger(__name__)

_SPAWN = get_context("spawn")
BATCH_PATIENCE = 6.0
"""Times its limit that a batch frame may take on the clock; its limit itself is one of CPU time.

Batch processes are niced: where others use the machine, a frame that is quite well may stand still for long.
"""
_LONGEST_WAIT = 30.0
"""Seconds between attempts to bring up a worker that does not come up."""


class NeverBegun(Exception):
    """The process was gone before it took the frame."""


@dataclass(frozen=True)
class Recycling:
    """When a process is replaced by a fresh one, between frames."""

    frames: int
    """After so many frames."""
    rss: int
    """Or past so many resident bytes."""


class Slot:
    """A place for one worker process, filled again whenever it ends."""

    def __init__(
        self,
        name: str,
        lane: Lane,
        config: WorkerConfig,
        recycling: Recycling,
        on_done: Callable[[Slot, int, Entry | None, Future[Any]], None],
    ) -> None:
        self.name = name
        self.lane = lane
        self.state: WorkerState = "starting"
        self.entry: Entry | None = None
        self.facts: WorkerFacts | None = None
        self.error: Exception | None = None
        self.generation = 0
        self._config = config
        self._recycling = recycling
        self._on_done = on_done
        self._flag = _SPAWN.RawValue(c_long, 0)
        self._pool: ProcessPool | None = None
        self._endings: list[threading.Thread] = []
        self._watch: Watch | None = None
        self._ticket = self._failures = self._launches = self._frames = self._rss = self._live = 0
        self._since, self._retry_at = monotonic(), 0.0
        self._last_frame: float | None = None

    # ------------------------------------------------------------------------------------------------ life

    def launch(self) -> None:
        """Fill the slot with a fresh process, which draws its canary first."""
        if self._pool is None or not self._pool.active:
            self._dispose()
            self._pool = ProcessPool(
                max_workers=1, initializer=start, initargs=(self._config, self._flag), context=_SPAWN
            )
        self.generation += 1
        self._launches += 1
        self.state, self.facts, self.entry, self._watch = "starting", None, None, None
        self._frames, self._since = 0, monotonic()
        self._schedule(None, introduce)

    def replace_process(self) -> None:
        """End the process and fill the slot again."""
        self._dispose()
        self.launch()

    def introduced(self, future: Future[WorkerFacts]) -> None:
        """Take note of a process that came up, or did not."""
        error = future.exception()
        if error is None:
            try:
                facts = future.result()
                self._watch = Watch(psutil.Process(facts.pid), watches_cpu=facts.software)
            except psutil.NoSuchProcess:
                error = EngineUnavailable("The worker process ended right after its start.")
        if error is not None:
            self._fail(error)
            return
        self.facts, self.error, self.state = facts, None, "idle"
        self._failures, self._rss, self._live = 0, facts.rss, facts.live_objects

    def close(self) -> None:
        """End the process for good."""
        self.generation += 1
        self.state, self.entry = "closed", None
        if self._watch is not None:
            self._watch.kill()
        self._dispose()

    def join(self, timeout: float) -> None:
        """Wait until the ended processes are gone."""
        for ending in self._endings:
            ending.join(timeout)

    # ------------------------------------------------------------------------------------------------ frames

    def run(self, entry: Entry) -> None:
        """Draw a frame. The slot must be idle."""
        self._ticket += 1
        self.entry, self.state, self._since = entry, "busy", monotonic()
        limit = wall = entry.task.limit
        if self.lane is Lane.BATCH and self.facts is not None and self.facts.software:
            wall = limit * BATCH_PATIENCE
        if self._watch is not None:
            # An interactive process draws with many threads, and somebody waits: there the clock on the wall counts.
            self._watch.begin(limit if self.lane is Lane.BATCH else inf, wall)
        self._schedule(entry, render_frame, replace(entry.task, ticket=self._ticket, limit=wall))

    def cancel(self) -> None:
        """Ask for the running frame to stop at its next sample."""
        self._flag.value = self._ticket

    def finished(self, entry: Entry, future: Future[FrameReport]) -> FrameReport | BaseException:
        """What became of the frame. ``NeverBegun`` means that it may be queued again."""
        elapsed, self.entry = monotonic() - self._since, None
        error = future.exception()
        if error is None:
            return self._reported(entry, future.result())
        if isinstance(error, BrokenProcessPool):
            self.launch()
            return NeverBegun()
        if isinstance(error, ProcessExpired):
            death = self._death(entry, error.exitcode, elapsed)
            self.launch()
            return death
        self.state = "idle"
        return error

    def watch(self, now: float) -> BaseException | None:
        """Look after the process once; returns why its frame is lost where no report of it will come."""
        if self.state == "failed" and now >= self._retry_at:
            self.launch()
        elif self.state == "starting" and now - self._since > START_LIMIT + 5:
            self._fail(EngineUnavailable(f"The worker did not come up in {START_LIMIT:.0f} s."))
        elif self.state in {"idle", "busy"} and self._watch is not None:
            verdict = self._watch.look(is_busy=self.state == "busy", now=now)
            if verdict == "lost":
                death = None if self.entry is None else self._death(self.entry, None, now - self._since)
                self.replace_process()
                return death
        return None

    @property
    def wants_replacing(self) -> bool:
        """Whether the idle process has drawn its share or grown past its bound."""
        grown = self._frames >= self._recycling.frames or self._rss > self._recycling.rss
        return self.state == "idle" and self._frames > 0 and grown

    def status(self) -> WorkerStatus:
        """What is known of the process."""
        now, facts = monotonic(), self.facts
        status = WorkerStatus(
            name=self.name,
            lane=self.lane,
            state=self.state,
            busy_seconds=now - self._since if self.state == "busy" else 0.0,
            rss=self._rss,
            live_objects=self._live,
            frames=self._frames,
            restarts=max(0, self._launches - 1),
            last_frame_age=None if self._last_frame is None else now - self._last_frame,
            error=None if self.error is None else str(self.error),
        )
        if facts is None:
            return status
        return replace(
            status,
            pid=facts.pid,
            canary=facts.canary,
            canary_error=facts.canary_error,
            driver=facts.driver,
            software=facts.software,
            fingerprint=facts.fingerprint,
            error=self._watch.complaint if self._watch is not None else status.error,
        )

    # ------------------------------------------------------------------------------------------------ hidden

    def _schedule(self, entry: Entry | None, function: Callable[..., Any], *args: Any) -> None:
        generation = self.generation
        future: Future[Any]
        try:
            if self._pool is None:
                raise BrokenProcessPool
            future = self._pool.schedule(function, args=args)
        except (RuntimeError, OSError) as error:  # the pool broke since we looked, or no process can be started
            future = Future()
            future.set_exception(error if isinstance(error, BrokenProcessPool) else BrokenProcessPool(str(error)))
        future.add_done_callback(lambda done: self._on_done(self, generation, entry, done))

    def _reported(self, entry: Entry, report: FrameReport) -> FrameReport:
        self.state, self._last_frame = "idle", monotonic()
        self._frames += 1
        self._rss, self._live = report.rss, report.live_objects
        if not report.timings:
            return report
        return replace(report, timings={"queue": max(0.0, self._since - entry.queued), **report.timings})

    def _death(self, entry: Entry, exit_code: int | None, elapsed: float) -> BaseException:
        watch, pid, task = self._watch, self.facts.pid if self.facts else None, entry.task
        reason = watch.sentence if watch is not None else ""
        log.error("worker %s (pid %s) ended on frame %s: %s, exit code %s", self.name, pid, task.key, reason, exit_code)
        # The deadline held inside the process ends it with exit code 1.
        if (watch is not None and watch.is_overdue) or (exit_code == 1 and elapsed >= task.limit):
            return FrameTimedOut(elapsed, key=task.key)
        return WorkerDied(reason, key=task.key, exit_code=exit_code, pid=pid)

    def _fail(self, error: BaseException) -> None:
        if isinstance(error, BrokenProcessPool | ProcessExpired):
            error = EngineUnavailable("The worker process ended while it started.")
        log.error("worker %s does not come up: %s", self.name, error)
        self.error = error if isinstance(error, Exception) else EngineUnavailable(str(error))
        self.generation += 1
        self.state = "failed"
        self._retry_at = monotonic() + min(_LONGEST_WAIT, 0.5 * 2**self._failures)
        self._failures += 1
        self._dispose()

    def _dispose(self) -> None:
        """End the pool and its process without waiting for it."""
        pool, self._pool = self._pool, None
        self._endings = [ending for ending in self._endings if ending.is_alive()]
        if pool is not None:
            ending = threading.Thread(target=_end, args=(pool,), name=f"end-{self.name}", daemon=True)
            ending.start()
            self._endings.append(ending)


def _end(pool: ProcessPool) -> None:
    pool.stop()  # type: ignore[no-untyped-call]  # pebble leaves it unannotated
    try:
        pool.join()
    except (RuntimeError, OSError) as error:  # it has ended by itself meanwhile
        log.warning("a worker's pool did not end cleanly: %s", error)
