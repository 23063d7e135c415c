"""A progress bar for jobs."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskProgressColumn, TextColumn

from .shapes import JobFacts


class JobProgress:
    """Shows a job's frames, speed and remaining time; silent where nobody could see it move.

    Call it with the job's facts each time they are known anew.
    """

    def __init__(self, *, is_wanted: bool = True, console: Console | None = None) -> None:
        console = console or Console(stderr=True)
        self._progress = Progress(
            TextColumn("[bold]{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[speed]}"),
            TextColumn("{task.fields[left]}"),
            console=console,
            disable=not is_wanted or not (console.is_terminal or console.is_jupyter),
        )
        self._task = self._progress.add_task("job", total=None, speed="", left="")

    def __call__(self, facts: JobFacts) -> None:
        """Show these facts."""
        speed, eta, counts = facts["frames_per_second"], facts["eta_seconds"], facts["counts"]
        state = facts["state"]
        self._progress.update(
            self._task,
            description=f"{facts['kind'] or 'job'} {state}",
            completed=counts["done"] + counts["failed"],
            total=counts["total"],
            speed="" if speed is None else f"{speed:.1f} frames/s",
            left="" if eta is None or state not in {"queued", "running"} else f"{duration(eta)} left",
        )

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()


def duration(seconds: float) -> str:
    """Seconds as a person says them: ``8 s``, ``3:05``, ``1:02:09``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
