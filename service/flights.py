"""Frames on their way: each key is drawn once, however many wait for it, in whichever lane.

A frame whose worker died is sent off once more, by itself (a process has one task, so nothing else can be to blame);
a second death sets its key aside. When the last waiter leaves, the frame is cancelled.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field

from renderer.errors import Cancelled
from renderer.request import FrameRequest
from renderer.source_digest import source_digest
from service.cost import CostModel
from service.engines.base import Engine, Lane
from service.errors import FramePoisoned, FrameTimedOut, Overloaded, QueueFull, WorkerDied
from service.poison import SET_ASIDE, PoisonCabinet
from service.worker import FrameReport, FrameTask


@dataclass(frozen=True)
class Deadlines:
    """How long a frame may take before its process is ended."""

    least: float = 10.0
    """Seconds."""
    factor: float = 8.0
    """Times the estimate."""

    def limit(self, estimate: float) -> float:
        """Seconds for a frame that is estimated at ``estimate`` seconds."""
        return max(self.least, self.factor * estimate)


@dataclass
class FlightCounts:
    """What became of frames since the start."""

    drawn: int = 0
    joined: int = 0
    """Waiters that found their frame already on its way."""
    cancelled: int = 0
    deaths: int = 0
    timeouts: int = 0
    refused: int = 0
    """Frames refused because too much waits."""


@dataclass(eq=False)
class Flight:
    """One key on its way through the engine, and all who wait for it."""

    request: FrameRequest
    task: FrameTask
    lane: Lane
    estimate: float
    future: Future[FrameReport]
    tickets: list[Ticket] = field(default_factory=list)


class Ticket:
    """One waiter's hold on a frame; ``future`` is its own."""

    def __init__(self, flights: Flights, flight: Flight) -> None:
        self._flights = flights
        self._flight = flight
        self.future: Future[FrameReport] = Future()

    def leave(self) -> None:
        """Wait no more. When the last waiter leaves, the frame is cancelled."""
        self._flights.leave(self, self._flight)


class Flights:
    """All frames on their way; thread-safe.

    ``queue_seconds`` bounds the predicted interactive work; ``on_drawn`` is told of each frame that was drawn.
    """

    def __init__(
        self,
        engine: Engine,
        cost: CostModel,
        deadlines: Deadlines,
        queue_seconds: float,
        on_drawn: Callable[[FrameRequest, FrameReport], None],
    ) -> None:
        self.counts = FlightCounts()
        self._engine = engine
        self._cost = cost
        self._deadlines = deadlines
        self._queue_seconds = queue_seconds
        self._on_drawn = on_drawn
        self._lock = threading.RLock()
        self._flights: dict[str, Flight] = {}
        self._poison = PoisonCabinet()

    @property
    def waiting_seconds(self) -> float:
        """Predicted seconds of interactive work under way."""
        with self._lock:
            return sum(f.estimate for f in self._flights.values() if f.lane is Lane.INTERACTIVE)

    def join(self, request: FrameRequest, key: str, lane: Lane) -> Ticket:
        """Wait for a frame, sending it off if nobody has. Raises ``FramePoisoned``, ``Overloaded``."""
        with self._lock:
            self._poison.check(key)
            flight = self._flights.get(key)
            if flight is not None:
                self.counts.joined += 1
                self._promote(flight, lane)
                return _board(self, flight)
            flight = self._send_off(request, key, lane)
            ticket = _board(self, flight)
        self._watch(flight)
        return ticket

    def leave(self, ticket: Ticket, flight: Flight) -> None:
        """Take a waiter off a frame."""
        with self._lock:
            if ticket in flight.tickets:
                flight.tickets.remove(ticket)
            if flight.tickets or self._flights.get(flight.task.key) is not flight:
                return
            del self._flights[flight.task.key]
            self.counts.cancelled += 1
        self._engine.cancel(flight.future)

    # ------------------------------------------------------------------------------------------------ hidden

    def _send_off(self, request: FrameRequest, key: str, lane: Lane) -> Flight:
        estimate = self._cost.estimate(request)
        waiting = self.waiting_seconds
        if lane is Lane.INTERACTIVE and waiting > 0 and waiting + estimate > self._queue_seconds:
            self.counts.refused += 1
            raise QueueFull(waiting + estimate, self._queue_seconds)
        task = FrameTask(key, request.canonical(), source_digest(), self._deadlines.limit(estimate))
        flight = Flight(request, task, lane, estimate, self._engine.submit(task, lane))
        self._flights[key] = flight
        return flight

    def _promote(self, flight: Flight, lane: Lane) -> None:
        if flight.lane is Lane.BATCH and lane is Lane.INTERACTIVE:
            flight.lane = lane
            self._engine.promote(flight.future)

    def _watch(self, flight: Flight) -> None:
        """Be told of the end; never under the lock, since it may be here already and waiters are told at once."""
        flight.future.add_done_callback(lambda done: self._landed(flight, done))

    def _landed(self, flight: Flight, done: Future[FrameReport]) -> None:
        key = flight.task.key
        with self._lock:
            if self._flights.get(key) is not flight:
                return  # everybody left
            outcome = self._outcome(flight, done)
            if outcome is not None:
                del self._flights[key]
            tickets, flight.tickets = flight.tickets, ([] if outcome is not None else flight.tickets)
        if outcome is None:
            self._watch(flight)
            return
        for ticket in tickets:
            _tell(ticket.future, outcome)

    def _outcome(self, flight: Flight, done: Future[FrameReport]) -> FrameReport | BaseException | None:
        """What to tell the waiters; None where the frame was sent off again."""
        key = flight.task.key
        error = Cancelled() if done.cancelled() else done.exception()
        if error is None:
            return self._drawn(flight, done.result())
        if isinstance(error, FrameTimedOut):
            self.counts.timeouts += 1
            self._poison.strike(key, str(error))
        if not isinstance(error, WorkerDied):
            return error
        self.counts.deaths += 1
        if self._poison.strike(key, error.reason):
            return FramePoisoned(error.reason, key=key, retry_after=SET_ASIDE)
        try:
            flight.future = self._engine.submit(flight.task, flight.lane)
        except Overloaded as refusal:
            return refusal
        return None

    def _drawn(self, flight: Flight, report: FrameReport) -> FrameReport:
        self._poison.clear(flight.task.key)
        if report.timings:
            self.counts.drawn += 1
            self._on_drawn(flight.request, report)
        return report


def _board(flights: Flights, flight: Flight) -> Ticket:
    ticket = Ticket(flights, flight)
    flight.tickets.append(ticket)
    return ticket


def _tell(future: Future[FrameReport], outcome: FrameReport | BaseException) -> None:
    if not future.set_running_or_notify_cancel():
        return
    if isinstance(outcome, BaseException):
        future.set_exception(outcome)
    else:
        future.set_result(outcome)
