"""An engine of which the test pulls the strings: it draws nothing until it is told to."""

from __future__ import annotations

from concurrent.futures import Future
from pathlib import Path

from service.artifacts import LocalArtifacts, artifact_name
from service.engines.base import Engine, Lane, Readiness, WorkerStatus
from service.worker import FrameReport, FrameTask

FINGERPRINT = "puppet"


class Puppet:
    """Keeps what it is given; ``finish`` and ``fail`` end it."""

    def __init__(self, room: Path, capacity: int = 1) -> None:
        self.capacity = capacity
        self.artifacts = LocalArtifacts(room / "artifacts", budget=1 << 30)
        self.submitted: list[tuple[FrameTask, Lane]] = []
        self.promoted: list[Future[FrameReport]] = []
        self.cancelled: list[Future[FrameReport]] = []
        self.refusal: Exception | None = None
        self._futures: list[Future[FrameReport]] = []

    @property
    def fingerprint(self) -> str:
        return FINGERPRINT

    @property
    def driver(self) -> str:
        return "strings"

    def start(self) -> None:
        """It is always up."""

    def wait_ready(self, timeout: float) -> None:
        """It is always up."""

    def submit(self, task: FrameTask, lane: Lane) -> Future[FrameReport]:
        if self.refusal is not None:
            raise self.refusal
        future: Future[FrameReport] = Future()
        self.submitted.append((task, lane))
        self._futures.append(future)
        return future

    def promote(self, future: Future[FrameReport]) -> None:
        self.promoted.append(future)

    def cancel(self, future: Future[FrameReport]) -> None:
        self.cancelled.append(future)
        future.cancel()

    def status(self) -> tuple[WorkerStatus, ...]:
        return ()

    def readiness(self) -> Readiness:
        return Readiness(is_ready=True, detail="strings attached")

    def close(self, grace: float = 5.0) -> None:
        """Nothing to end."""

    def is_over(self, number: int) -> bool:
        return self._futures[number].done()

    def finish(self, number: int = -1, data: bytes | None = None) -> FrameReport:
        """Draw a frame that was submitted."""
        task = self.submitted[number][0]
        artifact = self.artifacts.put(artifact_name(task.key, FINGERPRINT), data or task.key.encode())
        timings = {"queue": 0.0, "render": 0.1, "encode": 0.01}
        report = FrameReport(task.key, FINGERPRINT, artifact.digest, artifact.size, "strings", timings)
        self._end(number).set_result(report)
        return report

    def fail(self, error: Exception, number: int = -1) -> None:
        """End a frame that was submitted by an error."""
        self._end(number).set_exception(error)

    def _end(self, number: int) -> Future[FrameReport]:
        future = self._futures[number]
        future.set_running_or_notify_cancel()
        return future


_: type[Engine] = Puppet
