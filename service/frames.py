"""Frames by their request: stored ones are read, others drawn."""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from threading import Lock
from time import monotonic

from renderer.encode.image import FORMATS
from renderer.request import FrameRequest
from service.artifacts import LocalArtifacts, artifact_name
from service.cost import CostModel
from service.engines.base import Engine, Lane
from service.errors import ArtifactMissing, EngineUnavailable
from service.flights import Deadlines, Flights, Ticket
from service.worker import FrameReport

__all__ = ["Deadlines", "FrameCache", "StoredFrame"]

_POLL = 0.05
"""Seconds between two looks whether the first worker has come up."""


@dataclass(frozen=True)
class StoredFrame:
    """A frame's bytes and what is known of them."""

    key: str
    fingerprint: str
    digest: str
    """SHA-256 of ``data``, hex."""
    data: bytes = field(repr=False)
    media_type: str
    driver: str
    hit: bool = True
    """Whether nothing was drawn for this answer."""
    timings: Mapping[str, float] = field(default_factory=dict)
    """Seconds: ``queue``, ``render``, ``encode``; empty on a hit."""


class FrameCache:
    """Frames by their request. ``frame`` and ``sequence`` are for an event loop, the rest for any thread.

    ``queue_seconds`` bounds the predicted work of interactive frames that may wait; ``memory`` is how many bytes of
    frames are kept at hand; ``ready_seconds`` is how long a frame waits for the first worker.
    """

    def __init__(
        self,
        engine: Engine,
        artifacts: LocalArtifacts,
        *,
        queue_seconds: float = 30.0,
        deadlines: Deadlines | None = None,
        memory: int = 256 << 20,
        ready_seconds: float = 30.0,
    ) -> None:
        self.engine = engine
        self.artifacts = artifacts
        self.cost = CostModel()
        self.flights = Flights(engine, self.cost, deadlines or Deadlines(), queue_seconds, self._drawn)
        self.hits = 0
        """Frames answered without drawing."""
        self._ready_seconds = ready_seconds
        self._shelf = _Shelf(memory)

    @property
    def fingerprint(self) -> str:
        """What besides a key decides a frame's bytes. Raises ``EngineUnavailable`` until a worker is up."""
        return self.engine.fingerprint

    def etag(self, request: FrameRequest) -> str:
        """The frame's strong entity tag, in its quotes; nothing is drawn for it."""
        return f'"{self._name(request.key())}"'

    def find(self, request: FrameRequest) -> bool:
        """Whether the frame is stored; its bytes are not looked at."""
        return self.artifacts.find(self._name(request.key())) is not None

    async def frame(self, request: FrameRequest, lane: Lane = Lane.INTERACTIVE) -> StoredFrame:
        """The frame, read or drawn. Cancel the task to wait no more.

        Raises ``FrameError``, ``Overloaded``, or what the renderer raised.
        """
        await self.until_up()
        key = request.key()
        name = self._name(key)
        for _ in range(2):  # a frame may be evicted between its report and its reading
            with suppress(ArtifactMissing):
                stored = self._shelf.take(name)
                if stored is None and self.artifacts.find(name) is not None:
                    stored = await asyncio.to_thread(self.read, request, key)
                if stored is not None:
                    self.hits += 1
                    return stored
            ticket = self.flights.join(request, key, lane)
            try:
                report = await asyncio.wrap_future(ticket.future)
            finally:
                ticket.leave()
            with suppress(ArtifactMissing):
                return self._fresh(request, report)
        raise ArtifactMissing(key)

    async def sequence(
        self, requests: Sequence[FrameRequest], lane: Lane = Lane.BATCH
    ) -> AsyncGenerator[StoredFrame, None]:
        """The frames in their order, drawn a few ahead. Closing the iterator cancels what is ahead."""
        ahead: deque[asyncio.Task[StoredFrame]] = deque()
        try:
            for request in requests:
                ahead.append(asyncio.create_task(self.frame(request, lane)))
                if len(ahead) > self.engine.capacity:
                    yield await ahead[0]
                    del ahead[0]
            while ahead:
                yield await ahead[0]
                del ahead[0]
        finally:
            for task in ahead:
                task.cancel()
            await asyncio.gather(*ahead, return_exceptions=True)

    async def until_up(self) -> None:
        """Return when some worker is up; after ``ready_seconds`` raises what keeps them from coming up."""
        deadline = monotonic() + self._ready_seconds
        while True:
            try:
                _ = self.engine.fingerprint
            except EngineUnavailable:
                if monotonic() > deadline:
                    raise
                await asyncio.sleep(_POLL)
            else:
                return

    def draw(self, request: FrameRequest, lane: Lane = Lane.BATCH) -> Ticket | FrameReport:
        """The report of a frame that is stored and sound, or a ticket for one that is drawn.

        Raises ``FramePoisoned``, ``Overloaded``.
        """
        key, fingerprint = request.key(), self.fingerprint
        artifact = self.artifacts.verified(artifact_name(key, fingerprint))
        if artifact is None:
            return self.flights.join(request, key, lane)
        self.hits += 1
        return FrameReport(key, fingerprint, artifact.digest, artifact.size, self.engine.driver)

    def read(self, request: FrameRequest, key: str, fingerprint: str | None = None) -> StoredFrame:
        """A stored frame, verified; ``fingerprint`` None is the present one. Raises ``ArtifactMissing``."""
        of = fingerprint or self.fingerprint
        artifact, data = self.artifacts.read(artifact_name(key, of))
        media_type = FORMATS[request.format].media_type
        stored = StoredFrame(key, of, artifact.digest, data, media_type, self.engine.driver)
        self._shelf.put(artifact.name, stored)
        return stored

    def _fresh(self, request: FrameRequest, report: FrameReport) -> StoredFrame:
        """The frame of a report: its file was written just now, so that reading it waits for no disk."""
        name = artifact_name(report.key, report.fingerprint)
        stored = StoredFrame(
            report.key,
            report.fingerprint,
            report.digest,
            self.artifacts.read_fresh(name, report.digest),
            FORMATS[request.format].media_type,
            report.driver,
        )
        self._shelf.put(name, stored)
        return replace(stored, hit=not report.timings, timings=report.timings)

    def _drawn(self, request: FrameRequest, report: FrameReport) -> None:
        self.cost.learn(request, report.timings["render"] + report.timings["encode"])
        self.artifacts.grew(report.size)

    def _name(self, key: str) -> str:
        return artifact_name(key, self.fingerprint)


class _Shelf:
    """The latest frames, in memory, up to a number of bytes."""

    def __init__(self, budget: int) -> None:
        self._budget = budget
        self._used = 0
        self._frames: OrderedDict[str, StoredFrame] = OrderedDict()
        self._lock = Lock()

    def take(self, name: str) -> StoredFrame | None:
        with self._lock:
            frame = self._frames.get(name)
            if frame is not None:
                self._frames.move_to_end(name)
            return frame

    def put(self, name: str, frame: StoredFrame) -> None:
        with self._lock:
            if name in self._frames:
                return
            self._frames[name] = frame
            self._used += len(frame.data)
            while self._used > self._budget:
                _, oldest = self._frames.popitem(last=False)
                self._used -= len(oldest.data)
