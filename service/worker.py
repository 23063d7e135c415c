"""A worker: one renderer in one process, for life. Renders a frame, encodes it, stores it, reports.

Pixels never travel through a pipe: a report names the artifact. The module's functions are what an engine runs in
the process (``start`` once, then ``introduce`` and ``render_frame``); ``Worker`` is the same without a process.
"""

from __future__ import annotations

import faulthandler
import hashlib
import json
import os
import pickle
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
import psutil
from PIL import Image

from renderer.encode.image import FORMATS
from renderer.errors import MillpondError
from renderer.request import FrameRequest
from renderer.source_digest import source_digest
from service.artifacts import LocalArtifacts, artifact_name
from service.errors import EngineUnavailable, FrameError

if TYPE_CHECKING:
    from numpy.typing import NDArray

CANARY_SIDE = 16
"""Pixels: the canary frame is the default scene this small."""
CANARY_REFERENCE = Path(__file__).with_name("canary.png")
"""The canary as the pinned software driver draws it."""
STDERR = 2
"""Where the traceback of a process that is ended goes: the real standard error, whatever stands in for it."""
START_LIMIT = 120.0
"""Seconds in which a worker must have drawn its canary: a cold start bakes the scene's data."""


@dataclass(frozen=True)
class FrameTask:
    """One frame to draw."""

    key: str
    request: bytes
    """The canonical request."""
    sources: str
    """The digest of the sources by which the key was made."""
    limit: float
    """Seconds after which the process is ended: of the clock, or of its CPU time where it is a niced one."""
    ticket: int = 0
    """Which number in the shared flag cancels it; the engine sets it."""


@dataclass(frozen=True)
class FrameReport:
    """What became of a frame: where its bytes are, and what they cost."""

    key: str
    fingerprint: str
    digest: str
    """SHA-256 of the artifact, hex."""
    size: int
    """Bytes."""
    driver: str
    timings: Mapping[str, float] = field(default_factory=dict)
    """Seconds: ``queue``, ``render``, ``encode``; empty where the artifact was there already."""
    rss: int = 0
    """Resident bytes of the process."""
    live_objects: int = 0
    """OpenGL objects alive in the process."""
    pid: int = 0


@dataclass(frozen=True)
class WorkerConfig:
    """How a worker process is set up."""

    artifacts: Path
    threads: int = 0
    """``LP_NUM_THREADS`` of the software driver: 0 draws on the calling thread."""
    nice: int = 0
    """Added to the process's niceness."""
    require: Literal["any", "gpu", "cpu"] = "any"
    make: Callable[[WorkerConfig], Drawer] | None = None
    """What draws in the process, if not a ``Worker``: a function at the top of a module."""


@dataclass(frozen=True)
class WorkerFacts:
    """How a worker introduces itself, once it has drawn its canary."""

    pid: int
    driver: str
    software: bool
    fingerprint: str
    canary: str
    """SHA-256 of the canary's pixels, hex."""
    canary_error: float | None
    """Largest difference from the reference, in steps of 1/255; None where there is no reference."""
    rss: int = 0
    live_objects: int = 0


class Flag(Protocol):
    """A number that two processes share."""

    value: int


class Drawer(Protocol):
    """What a worker process runs its tasks on."""

    @property
    def facts(self) -> WorkerFacts:
        """What it is."""

    def render(self, task: FrameTask, is_cancelled: Callable[[], bool]) -> FrameReport:
        """Run a task."""

    def close(self) -> None:
        """Give everything back."""


class Worker:
    """One renderer, and the way from a task to a stored frame. To be used by the thread that made it."""

    def __init__(self, config: WorkerConfig) -> None:
        # Mesa reads it when the first context is made; the import stands here because the service's own process
        # imports this module too, and must never load OpenGL.
        os.environ["LP_NUM_THREADS"] = str(config.threads)
        from renderer.pipeline import Renderer  # noqa: PLC0415 -- see above

        self._artifacts = LocalArtifacts(config.artifacts)
        self._renderer = Renderer(require=config.require)
        self.facts = self._draw_canary()

    def render(self, task: FrameTask, is_cancelled: Callable[[], bool] = lambda: False) -> FrameReport:
        """Render, encode, store. Raises what the renderer raises, and ``StoreUnavailable``."""
        if task.sources != source_digest():
            raise EngineUnavailable("The renderer's sources changed while the service ran: restart it.", retry_after=60)
        request = FrameRequest.parse(json.loads(task.request))
        name = artifact_name(task.key, self.facts.fingerprint)
        artifact = self._artifacts.verified(name)
        timings: dict[str, float] = {}
        if artifact is None:
            started = perf_counter()
            frame = self._renderer.render(request, is_cancelled=is_cancelled)
            rendered = perf_counter()
            data = FORMATS[request.format].encode(frame, task.request)
            artifact = self._artifacts.put(name, data)
            timings = {"render": rendered - started, "encode": perf_counter() - rendered}
        return FrameReport(
            key=task.key,
            fingerprint=self.facts.fingerprint,
            digest=artifact.digest,
            size=artifact.size,
            driver=self.facts.driver,
            timings=timings,
            rss=_resident(),
            live_objects=self._renderer.live_objects(),
            pid=os.getpid(),
        )

    def close(self) -> None:
        """Give the context back."""
        self._renderer.close()

    def _draw_canary(self) -> WorkerFacts:
        pixels = self._renderer.render(canary_request()).color
        return WorkerFacts(
            pid=os.getpid(),
            driver=self._renderer.driver,
            software=self._renderer.is_software,
            fingerprint=self._renderer.fingerprint,
            canary=hashlib.sha256(np.ascontiguousarray(pixels).tobytes()).hexdigest(),
            canary_error=_difference(pixels, CANARY_REFERENCE),
            rss=_resident(),
            live_objects=self._renderer.live_objects(),
        )


def canary_request() -> FrameRequest:
    """The frame by which a worker shows that it can draw: every pass, but a soft picture.

    It looks down on open water. Leaves and edges would turn a processor's last bit into whole steps of a pixel this
    large, and a sound machine would look broken. Sun and sky are the scene's own: who has sung has baked
    the sky of the commonest frames.
    """
    camera = {"eye": [0.0, 3.0, 1.0], "target": [0.0, 0.0, -0.5], "fov_y": 24}
    return FrameRequest.parse(
        {"width": CANARY_SIDE, "height": CANARY_SIDE, "camera": camera, "samples": 4},
    )


# ------------------------------------------------------------------------------------------- what the process runs


@dataclass
class _Process:
    """The one worker of this process, or why there is none."""

    worker: Drawer | None = None
    failure: Exception | None = None
    cancelled: Flag | None = None


_here = _Process()


def start(config: WorkerConfig, cancelled: Flag) -> None:
    """Make this process's worker; ``cancelled`` will hold the ticket of a frame that nobody wants any more.

    A failure is kept for ``introduce`` to raise: an initializer's own exception would reach nobody.
    """
    os.nice(config.nice)
    faulthandler.dump_traceback_later(START_LIMIT, exit=True, file=STDERR)
    _here.cancelled = cancelled
    try:
        _here.worker = (config.make or Worker)(config)
    except Exception as error:  # noqa: BLE001 -- whatever it is, the engine tells it
        _here.failure = error
    finally:
        faulthandler.cancel_dump_traceback_later()


def introduce() -> WorkerFacts:
    """The facts of this process's worker. Raises what kept it from coming up."""
    if _here.worker is None:
        raise portable(_here.failure or EngineUnavailable())
    return _here.worker.facts


def render_frame(task: FrameTask) -> FrameReport:
    """Run a task on this process's worker; past ``task.limit`` seconds the process ends, whatever holds it."""
    worker, flag = _here.worker, _here.cancelled
    if worker is None or flag is None:
        raise portable(_here.failure or EngineUnavailable())
    faulthandler.dump_traceback_later(task.limit, exit=True, file=STDERR)
    try:
        return worker.render(task, lambda: flag.value == task.ticket)
    except Exception as error:
        raise portable(error, task.key) from error
    finally:
        faulthandler.cancel_dump_traceback_later()


def portable(error: Exception, key: str = "") -> Exception:
    """The error, or one of the same words that survives the way through a pipe."""
    if isinstance(error, MillpondError):
        try:
            if str(pickle.loads(pickle.dumps(error))) == str(error):  # noqa: S301 -- our own bytes, made just now
                return error
        except Exception:  # noqa: BLE001, S110 -- then it is not portable
            pass
    return FrameError(f"{type(error).__name__}: {error}", key=key)


@cache
def _process(pid: int) -> psutil.Process:
    return psutil.Process(pid)


def _resident() -> int:
    return int(_process(os.getpid()).memory_info().rss)


def _difference(pixels: NDArray[np.uint8], reference: Path) -> float | None:
    if not reference.is_file():
        return None
    with Image.open(reference) as image:
        expected = np.asarray(image.convert("RGB"), dtype=np.int16)
    if expected.shape != pixels.shape:
        return 255.0
    return float(np.abs(pixels.astype(np.int16) - expected).max())
