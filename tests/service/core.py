"""What tests of the service's core share: frames, engines that draw by script, and patience."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from renderer.request import FrameRequest
from renderer.source_digest import source_digest
from service.artifacts import LocalArtifacts
from service.engines.base import Engine
from service.engines.inline import InlineEngine
from service.engines.local import LocalEngine
from service.frames import FrameCache
from service.jobs import Jobs
from service.worker import FrameTask, WorkerConfig
from tests.service.scripted import Seed, scripted

SMALL = {"width": 64, "height": 36}


def frame(moment: float = 0.0, seed: int = Seed.DRAW, **fields: Any) -> FrameRequest:
    return FrameRequest.parse({**SMALL, "time": moment, "seed": int(seed), **fields})


def task(moment: float = 0.0, seed: int = Seed.DRAW, limit: float = 30.0) -> FrameTask:
    request = frame(moment, seed)
    return FrameTask(request.key(), request.canonical(), source_digest(), limit)


def turntable(frames: int = 6, seed: int = Seed.DRAW, **fields: Any) -> dict[str, Any]:
    """The body of a job."""
    return {
        "kind": "turntable",
        "frame": {**SMALL, "seed": int(seed)},
        "turntable": {"frames": frames, "fps": 12.0},
        **fields,
    }


def eventually(holds: Callable[[], object], seconds: float = 20.0) -> None:
    """Wait until something holds; fail where it never does."""
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it never came to hold"
        time.sleep(0.02)


def make_inline(room: Path) -> Engine:
    return InlineEngine(WorkerConfig(room / "artifacts", make=scripted))


def make_local(room: Path, *, workers: int = 2, interactive: bool = True, **options: Any) -> LocalEngine:
    return LocalEngine(room / "artifacts", workers=workers, interactive=interactive, make=scripted, **options)


AnyEngine = TypeVar("AnyEngine", bound=Engine)


@contextmanager
def running(engine: AnyEngine) -> Iterator[AnyEngine]:
    """An engine that is up, and ends with the block."""
    engine.start()
    try:
        engine.wait_ready(60)
        yield engine
    finally:
        engine.close(grace=0.2)


@contextmanager
def cache_on(engine: Engine, room: Path, **options: Any) -> Iterator[FrameCache]:
    """A frame cache on an engine that is up."""
    with running(engine):
        yield FrameCache(engine, LocalArtifacts(room / "artifacts", budget=1 << 30), **options)


@contextmanager
def jobs_on(cache: FrameCache, room: Path, **options: Any) -> Iterator[Jobs]:
    """Jobs that are dispatched, and end with the block."""
    jobs = Jobs(f"sqlite:///{room / 'jobs.sqlite3'}", cache, cache.artifacts, data_dir=room, **options)
    jobs.start()
    try:
        yield jobs
    finally:
        jobs.close()
