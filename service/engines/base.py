"""The seam between who wants frames and where they are drawn."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass
from enum import Enum
from typing import Literal, Protocol

from service.worker import FrameReport, FrameTask

WorkerState = Literal["starting", "idle", "busy", "failed", "closed"]


class Lane(Enum):
    """In which of two queues a frame waits."""

    INTERACTIVE = "interactive"
    """Somebody looks at a screen: drawn first, with every core."""
    BATCH = "batch"
    """Frames of jobs and sequences: one core each, and no new one starts while an interactive one runs."""


@dataclass(frozen=True)
class WorkerStatus:
    """What is known of one worker process."""

    name: str
    lane: Lane
    state: WorkerState
    pid: int | None = None
    busy_seconds: float = 0.0
    """How long it has been drawing its present frame."""
    canary: str | None = None
    """SHA-256 of its canary frame's pixels; None until it has drawn it."""
    canary_error: float | None = None
    """Largest difference of the canary from the reference, in steps of 1/255; None where there is no reference."""
    driver: str = ""
    software: bool | None = None
    """Whether the driver draws on the CPU."""
    fingerprint: str = ""
    rss: int = 0
    """Resident bytes after its latest frame."""
    live_objects: int = 0
    """OpenGL objects alive after its latest frame."""
    frames: int = 0
    """Frames that this process has drawn."""
    restarts: int = 0
    """Processes that this one follows."""
    last_frame_age: float | None = None
    """Seconds since its latest frame."""
    error: str | None = None
    """Why it can't draw, where it can't."""


@dataclass(frozen=True)
class Readiness:
    """Whether every worker can draw, and what is missing."""

    is_ready: bool
    detail: str


class Engine(Protocol):
    """Draws frames somewhere else; thread-safe."""

    @property
    def capacity(self) -> int:
        """How many batch frames it draws at a time."""

    @property
    def fingerprint(self) -> str:
        """What besides a frame's key decides its bytes.

        Raises ``EngineUnavailable`` until a worker is up, or the ``DeviceError`` that keeps all from coming up.
        """

    @property
    def driver(self) -> str:
        """The OpenGL driver's name; empty until a worker is up."""

    def start(self) -> None:
        """Bring the workers up, in the background."""

    def wait_ready(self, timeout: float) -> None:
        """Return when every worker can draw.

        Raises the worker's own ``DeviceError`` where it says that it never will, ``EngineUnavailable`` after
        ``timeout`` seconds.
        """

    def submit(self, task: FrameTask, lane: Lane) -> Future[FrameReport]:
        """Queue a frame.

        The future fails with ``WorkerDied``, ``FrameTimedOut``, ``Cancelled``, ``EngineUnavailable``, or what the
        renderer raised.
        """

    def promote(self, future: Future[FrameReport]) -> None:
        """Move a frame that still waits in the batch lane to the interactive one."""

    def cancel(self, future: Future[FrameReport]) -> None:
        """Drop a frame that waits; tell one that is being drawn to stop at its next sample."""

    def status(self) -> tuple[WorkerStatus, ...]:
        """What is known of each worker."""

    def readiness(self) -> Readiness:
        """Whether every worker has drawn its canary, and all alike."""

    def close(self, grace: float = 5.0) -> None:
        """Take nothing more, give running frames ``grace`` seconds, end the workers."""


def judge(status: tuple[WorkerStatus, ...], tolerance: float = 3.0) -> Readiness:
    """Readiness from the workers' status: all up, canaries equal within a fingerprint and near the reference."""
    complaints = [
        f"{worker.name}: {worker.error or worker.state}"
        for worker in status
        if worker.state not in {"idle", "busy"} or worker.canary is None
    ]
    canaries: dict[str, set[str]] = {}
    for worker in status:
        if worker.canary is not None:
            canaries.setdefault(worker.fingerprint, set()).add(worker.canary)
        if worker.canary_error is not None and worker.canary_error > tolerance:
            complaints.append(f"{worker.name}: its canary frame differs by {worker.canary_error:.0f}/255")
    if any(len(seen) > 1 for seen in canaries.values()):
        complaints.append("workers of one fingerprint draw different canary frames")
    if not status:
        complaints.append("there are no workers")
    return Readiness(not complaints, "; ".join(complaints) or f"{len(status)} workers draw")
