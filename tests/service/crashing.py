"""A service that is killed at chosen moments: ``python -m tests.service.crashing ROOM ENGINE``.

Each line of its input, ``MOMENT NTH``, is a run: a child of this process submits the job of the room once, dispatches
it, and ends by SIGKILL when the moment comes for the n-th time, or when the job has ended. Its exit code is answered.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from renderer import request
from service.artifacts import LocalArtifacts
from service.frames import FrameCache
from service.jobs import Jobs, leases
from service.jobs.leases import Leases
from service.jobs.store import JobStore
from tests.service import scripted
from tests.service.core import jobs_on, make_inline, make_local, running, turntable

KEY = "the job of the room"
FRAMES = 8


def _never(*_: Any) -> bool:
    return False


def _always(*_: Any) -> bool:
    return True


def _claimed(result: Any, *_: Any) -> bool:
    return bool(result.claimed)


def _reported(_: Any, __: Any, reports: Any, *___: Any) -> bool:
    return bool(reports)


Watch = Callable[..., bool]
MOMENTS: dict[str, tuple[Any, str, Watch, Watch]] = {
    "submitted": (JobStore, "submit", _never, _always),
    "claimed": (Leases, "exchange", _never, _claimed),
    "drawing": (scripted, "picture", _always, _never),
    "named": (LocalArtifacts, "_commit", _always, _never),
    "stored": (LocalArtifacts, "put", _never, _always),
    "applied": (leases, "_apply", _never, lambda _, __, reports: bool(reports)),
    "committed": (Leases, "exchange", _never, _reported),
}
"""What is called at the moment, and whether it comes before (of the arguments) or after (of result and arguments)."""


def arm(moment: str, nth: int) -> None:
    """Have this process killed at the n-th moment."""
    owner, name, before, after = MOMENTS[moment]
    original = getattr(owner, name)
    count = iter(range(nth - 1, -1, -1))

    def strike() -> None:
        if next(count) == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    def wrapped(*args: Any, **named: Any) -> Any:
        if before(*args):
            strike()
        result = original(*args, **named)
        if after(result, *args):
            strike()
        return result

    setattr(owner, name, wrapped)


def unfinished(jobs: Jobs) -> bool:
    return any(view.job.state in {"queued", "running"} for view in jobs.page().jobs)


def serve(room: Path, kind: str) -> None:
    make = make_inline if kind == "inline" else make_local
    with running(make(room)) as engine:
        cache = FrameCache(engine, LocalArtifacts(room / "artifacts", budget=1 << 30))
        with jobs_on(cache, room) as jobs:
            seed = scripted.Seed.DRAW_SLOWLY if kind == "local" else scripted.Seed.DRAW
            jobs.submit(turntable(FRAMES, seed), KEY)
            while unfinished(jobs):
                time.sleep(0.02)


def run(room: Path, kind: str, moment: str, nth: int) -> int:
    """Serve in a child, which is forked before any thread is; returns its exit code."""
    child = os.fork()
    if child == 0:
        if moment != "never":
            arm(moment, nth)
        serve(room, kind)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def main() -> None:
    request.source_digest = lambda: "edited sources would be other frames"  # type: ignore[assignment,attr-defined]
    for line in sys.stdin:
        moment, nth = line.split()
        sys.stdout.write(f"{run(Path(sys.argv[1]), sys.argv[2], moment, int(nth))}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
