"""``millpond turntable``: a camera carried round a scene, drawn by worker processes, without a server."""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from renderer.encode.image import FORMATS
from renderer.encode.movie import MOVIES
from renderer.errors import InvalidRequest
from renderer.query import parse_query
from renderer.trajectory import Turntable
from service.commands.drawing import Demand, frames_of_workers, part_of, refuse_unwritable, write_whole
from service.commands.options import Arguments, Option, Usage, help_text, take_apart
from service.frames import FrameCache, StoredFrame
from service.jobs.assembly import write_movie, zip_stream
from service.settings import cores
from service.turntables import TurntablePlan, plan_turntable

USAGE = "millpond turntable OUT [options] [--FIELD VALUE …]"
SUMMARY = (
    "Carries a frame's camera once round, or part of the way, while time runs, and writes a movie (.mp4, .webm), an "
    "archive of images (.zip) or a folder of them."
)
TURNS = tuple(
    Option(name.replace("_", "-"), "VALUE", " ".join((field.description or "").split()))
    for name, field in Turntable.model_fields.items()
)
OPTIONS = (
    *TURNS,
    Option("workers", "N", "worker processes, one core each; as many as there are cores by default"),
    Option("require", "KIND", "the device to draw on: any, gpu or cpu"),
    Option("help", "", "this text"),
)


def help_page() -> str:
    """The answer to ``--help``."""
    return help_text(USAGE, SUMMARY, OPTIONS, has_fields=True)


def run(arguments: Sequence[str]) -> int:
    """Draw, write, say how fast it went."""
    given = take_apart(arguments, OPTIONS)
    if len(given.positional) != 1:
        raise Usage(f"one OUT is needed, not {len(given.positional)}: {USAGE}")
    out = Path(given.positional[0])
    write = _writer(out)
    plan = _plan(given)
    refuse_unwritable(out)
    console = Console(stderr=True)
    workers = given.number("workers", cores())
    with frames_of_workers(workers, cast("Demand", given.choice("require", ("any", "gpu", "cpu")))) as cache:
        began = time.perf_counter()
        with _progress(console) as progress:
            drawn = asyncio.run(_draw(cache, plan, out, write, progress))
        seconds = time.perf_counter() - began
    console.print(
        f"{out}  {len(plan.requests)} frames of {plan.frame.width}×{plan.frame.height}, drawn in {drawn:.2f} s by "
        f"{workers} workers: {len(plan.requests) / drawn:.1f} frames per second; written after {seconds:.2f} s",
        highlight=False,
        soft_wrap=True,
    )
    return 0


def _plan(given: Arguments) -> TurntablePlan:
    frame = given.frame_fields()
    turning = [(option.name.replace("-", "_"), given.own[option.name]) for option in TURNS if option.name in given.own]
    try:
        return plan_turntable(frame, parse_query(turning), None, None)
    except InvalidRequest as error:
        raise InvalidRequest(tuple(_as_typed(problem) for problem in error.problems)) from None


def _as_typed(problem: Any) -> Any:
    """The problem with its path as the command line has it."""
    path = problem.path.removeprefix("frame.").removeprefix("turntable.")
    return type(problem)(path, problem.message, problem.value, problem.bound)


async def _draw(cache: FrameCache, plan: TurntablePlan, out: Path, write: Any, progress: Progress) -> float:
    """Draw and write; the seconds until the last frame was there."""
    began = last = time.perf_counter()
    task = progress.add_task("frames", total=len(plan.requests))

    async def counted() -> AsyncIterator[StoredFrame]:
        nonlocal last
        async for stored in cache.sequence(plan.requests):
            progress.advance(task)
            last = time.perf_counter()
            yield stored

    await write(out, counted(), plan)
    return last - began


# ------------------------------------------------------------------------------------------------------------ writers


def _writer(out: Path) -> Any:
    suffix = out.suffix.lower().removeprefix(".")
    if any(suffix in movie.suffixes for movie in MOVIES.values()):
        return _write_movie
    if suffix == "zip":
        return _write_archive
    if not suffix:
        return _write_folder
    raise Usage(f"{out}: write .mp4, .webm, .zip, or a folder's name without a dot")


async def _write_movie(out: Path, frames: AsyncIterator[StoredFrame], plan: TurntablePlan) -> None:
    part = part_of(out).with_suffix(out.suffix)
    size = {"width": plan.frame.width, "height": plan.frame.height}
    with tempfile.TemporaryDirectory(prefix="millpond-") as folder:
        images: list[Path] = []
        async for stored in frames:
            images.append(Path(folder, str(len(images))))
            images[-1].write_bytes(stored.data)
        data = (image.read_bytes() for image in images)
        try:
            write_movie(part, data, **size, fps=plan.turntable.fps, count=len(plan.requests))
            part.replace(out)
        finally:
            part.unlink(missing_ok=True)


async def _write_archive(out: Path, frames: AsyncIterator[StoredFrame], plan: TurntablePlan) -> None:
    part = part_of(out)
    try:
        with part.open("wb") as file:
            async for chunk in zip_stream(frames, FORMATS[plan.frame.format].suffixes[0]):
                file.write(chunk)
        part.replace(out)
    finally:
        part.unlink(missing_ok=True)


async def _write_folder(out: Path, frames: AsyncIterator[StoredFrame], plan: TurntablePlan) -> None:
    _make_folder(out)
    suffix = FORMATS[plan.frame.format].suffixes[0]
    index = 0
    async for stored in frames:
        write_whole(out / f"frame_{index:08d}.{suffix}", stored.data)
        index += 1


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        raise Usage(f"{path} is no folder: {error.strerror}") from error


# ----------------------------------------------------------------------------------------------------------- progress


class _Speed(ProgressColumn):
    """Frames per second."""

    def render(self, task: Task) -> Text:
        """The figure, once there is one."""
        return Text(f"{task.speed:.1f} frames/s" if task.speed else "")


@contextmanager
def _progress(console: Console) -> Iterator[Progress]:
    """A bar on a terminal; nothing in a log, where it would be no help."""
    columns = (TextColumn("drawing"), BarColumn(), MofNCompleteColumn(), _Speed(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, speed_estimate_period=5.0) as progress:
        yield progress
