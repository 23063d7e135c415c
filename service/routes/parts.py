"""What the routes work with: the parts that app.py put together, and the request's own facts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from starlette.requests import Request

from service.engines.base import Engine
from service.frames import FrameCache
from service.jobs import Jobs
from service.settings import Settings


@dataclass(frozen=True)
class Parts:
    """The service's parts, alive from start-up to shutdown."""

    settings: Settings
    engine: Engine
    frames: FrameCache
    jobs: Jobs
    started: float
    """Monotonic seconds at which the service started."""


def parts_of(request: Request) -> Parts:
    """The parts that answer this request."""
    return cast("Parts", request.app.state.parts)


def request_id(request: Request) -> str:
    """The id under which the log and a problem's body speak of this request."""
    return cast("str", request.scope["state"]["request_id"])
