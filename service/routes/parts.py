"""What the routes work with: the parts that app.py put together, and the request's own facts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from starlette.requests import Request

from service.engines.base import Engine
from service.frames import FrameCache
from service.jobs import Jobs
from service.places import Places
from service.settings import Settings


@dataclass(frozen=True)
class Parts:
    """The service's parts, alive from start-up to shutdown."""

    settings: Settings
    engine: Engine
    frames: FrameCache
    jobs: Jobs
    sequences: Places
    """Of the answers that are drawn while they are sent."""
    started: float
    """Monotonic seconds at which the service started."""


def parts_of(request: Request) -> Parts:
    """The parts that answer this request."""
    return cast("Parts", request.app.state.parts)


def is_head(request: Request) -> bool:
    """Whether only the headers will be sent: HEAD reaches the routes as GET, and most need not care."""
    return bool(request.scope["state"]["is_head"])


def request_id(request: Request) -> str:
    """The id under which the log and a problem's body speak of this request."""
    return cast("str", request.scope["state"]["request_id"])
