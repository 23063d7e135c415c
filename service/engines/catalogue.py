"""Every engine by its name in the settings."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from service.engines.base import Engine
from service.engines.inline import InlineEngine
from service.engines.local import LocalEngine
from service.worker import WorkerConfig


def _inline(artifacts: Path, *, require: Literal["any", "gpu", "cpu"] = "any", **_: object) -> Engine:
    """One thread: what is said of processes has no meaning for it."""
    return InlineEngine(WorkerConfig(artifacts, threads=len(os.sched_getaffinity(0)), require=require))


ENGINES: dict[str, Callable[..., Engine]] = {"local": LocalEngine, "inline": _inline}
"""Each takes the artifacts' folder and ``LocalEngine``'s options, and is not yet started."""
