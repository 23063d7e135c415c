"""Drawing without a server: an engine for the length of one command."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from service.artifacts import LocalArtifacts
from service.commands.options import Usage
from service.engines.inline import InlineEngine
from service.engines.local import LocalEngine
from service.frames import FrameCache
from service.settings import cores
from service.worker import WorkerConfig

Demand = Literal["any", "gpu", "cpu"]
START_SECONDS = 180.0
"""A first start on a machine bakes the scene's data."""


@contextmanager
def frames_of_this_process(require: Demand) -> Iterator[FrameCache]:
    """Frames drawn by this process on every core."""
    with tempfile.TemporaryDirectory(prefix="millpond-") as folder:
        engine = InlineEngine(WorkerConfig(Path(folder), threads=cores(), require=require))
        engine.start()
        try:
            engine.wait_ready(START_SECONDS)
            yield FrameCache(engine, LocalArtifacts(Path(folder)))
        finally:
            engine.close(grace=1.0)


@contextmanager
def frames_of_workers(workers: int, require: Demand) -> Iterator[FrameCache]:
    """Frames drawn by so many worker processes, one core each."""
    with tempfile.TemporaryDirectory(prefix="millpond-") as folder:
        engine = LocalEngine(Path(folder), workers=workers, interactive=False, require=require)
        engine.start()
        try:
            engine.wait_ready(START_SECONDS)
            yield FrameCache(engine, LocalArtifacts(Path(folder)))
        finally:
            engine.close(grace=0.0)


def write_whole(path: Path, data: bytes) -> None:
    """Write a file so that its name never stands for half of it."""
    part = part_of(path)
    try:
        part.write_bytes(data)
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise Usage(f"{path} can't be written: {error.strerror}") from error


def part_of(path: Path) -> Path:
    """The name under which a file is written before it is whole."""
    return path.with_name(f".{path.name}.{os.getpid()}.part")


def refuse_unwritable(path: Path) -> None:
    """Refuse a path whose folder does not exist, before anything is drawn for it."""
    if not path.parent.is_dir():
        raise Usage(f"{path} can't be written: there is no folder {path.parent}")
