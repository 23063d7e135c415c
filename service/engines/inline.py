"""An engine without processes: one thread of this process draws. For tests, and for a single frame in a command."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from time import monotonic

from service.engines.base import Lane, Readiness, WorkerState, WorkerStatus, judge
from service.engines.queue import Entry, Lanes
from service.errors import EngineUnavailable
from service.worker import Drawer, FrameReport, FrameTask, Worker, WorkerConfig, WorkerFacts


class InlineEngine:
    """One thread that owns one drawer. It holds no deadlines: a frame that hangs hangs the engine."""

    def __init__(self, config: WorkerConfig) -> None:
        self._config = config
        self._make: Callable[[WorkerConfig], Drawer] = config.make or Worker
        self._lanes = Lanes()
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="inline-engine", daemon=True)
        self._facts: WorkerFacts | None = None
        self._error: Exception | None = None
        self._current: Entry | None = None
        self._is_unwanted = self._is_closed = False
        self._frames = 0
        self._since = 0.0
        self._last_frame: float | None = None

    @property
    def capacity(self) -> int:
        """How many batch frames it draws at a time."""
        return 1

    @property
    def fingerprint(self) -> str:
        """What besides a frame's key decides its bytes; see ``Engine``."""
        if self._facts is None:
            raise self._error or EngineUnavailable()
        return self._facts.fingerprint

    @property
    def driver(self) -> str:
        """The OpenGL driver's name; empty until the drawer is up."""
        return "" if self._facts is None else self._facts.driver

    def start(self) -> None:
        """Make the drawer, in its own thread."""
        self._thread.start()

    def wait_ready(self, timeout: float) -> None:
        """Return when the drawer is up; raises what kept it, or ``EngineUnavailable`` after ``timeout`` seconds."""
        with self._changed:
            self._changed.wait_for(lambda: self._facts is not None or self._error is not None, timeout)
        if self._error is not None:
            raise self._error
        if self._facts is None:
            raise EngineUnavailable("The renderer is not ready.")

    def submit(self, task: FrameTask, lane: Lane) -> Future[FrameReport]:
        """Queue a frame; see ``Engine``."""
        with self._changed:
            if self._is_closed:
                raise EngineUnavailable("The engine is closed.", retry_after=5)
            entry = self._lanes.add(task, lane)
            self._changed.notify_all()
        return entry.future

    def promote(self, future: Future[FrameReport]) -> None:
        """Move a frame that still waits in the batch lane to the interactive one."""
        with self._changed:
            self._lanes.promote(future)

    def cancel(self, future: Future[FrameReport]) -> None:
        """Drop a frame that waits; tell one that is being drawn to stop at its next sample."""
        future.cancel()
        with self._changed:
            self._lanes.drop(future)
            if self._current is not None and self._current.future is future:
                self._is_unwanted = True

    def status(self) -> tuple[WorkerStatus, ...]:
        """What is known of the thread."""
        with self._changed:
            now, entry, facts = monotonic(), self._current, self._facts
            status = WorkerStatus(
                "inline",
                Lane.BATCH if entry is None else entry.lane,
                self._state(),
                busy_seconds=0.0 if entry is None else now - self._since,
                frames=self._frames,
                last_frame_age=None if self._last_frame is None else now - self._last_frame,
                error=None if self._error is None else str(self._error),
            )
        if facts is None:
            return (status,)
        return (
            replace(
                status,
                pid=facts.pid,
                canary=facts.canary,
                canary_error=facts.canary_error,
                driver=facts.driver,
                software=facts.software,
                fingerprint=facts.fingerprint,
                rss=facts.rss,
                live_objects=facts.live_objects,
            ),
        )

    def readiness(self) -> Readiness:
        """Whether the canary has been drawn."""
        return judge(self.status())

    def close(self, grace: float = 5.0) -> None:
        """Take nothing more, wait ``grace`` seconds for the running frame."""
        with self._changed:
            self._is_closed = True
            waiting = self._lanes.drain()
            self._changed.notify_all()
        for entry in waiting:
            if entry.future.set_running_or_notify_cancel():
                entry.future.set_exception(EngineUnavailable("The engine is closed.", retry_after=5))
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join(grace)

    # ------------------------------------------------------------------------------------------------ hidden

    def _state(self) -> WorkerState:
        if self._is_closed:
            return "closed"
        if self._error is not None:
            return "failed"
        if self._facts is None:
            return "starting"
        return "idle" if self._current is None else "busy"

    def _run(self) -> None:
        try:
            drawer = self._make(self._config)
        except Exception as error:  # noqa: BLE001 -- told to whoever waits
            with self._changed:
                self._error = error
                self._changed.notify_all()
            return
        with self._changed:
            self._facts = drawer.facts
            self._changed.notify_all()
        try:
            while (entry := self._next()) is not None:
                self._draw(drawer, entry)
        finally:
            drawer.close()

    def _next(self) -> Entry | None:
        with self._changed:
            while not self._is_closed:
                entry = self._lanes.take(Lane.INTERACTIVE) or self._lanes.take(Lane.BATCH)
                if entry is not None:
                    self._current, self._is_unwanted, self._since = entry, False, monotonic()
                    return entry
                self._changed.wait()
        return None

    def _draw(self, drawer: Drawer, entry: Entry) -> None:
        outcome: FrameReport | Exception
        try:
            outcome = drawer.render(entry.task, lambda: self._is_unwanted)
        except Exception as error:  # noqa: BLE001 -- told to whoever waits
            outcome = error
        with self._changed:
            self._current, self._last_frame = None, monotonic()
            self._frames += 1
        if isinstance(outcome, Exception):
            entry.future.set_exception(outcome)
        else:
            queued = {"queue": max(0.0, self._since - entry.queued)} if outcome.timings else {}
            entry.future.set_result(replace(outcome, timings={**queued, **outcome.timings}))
