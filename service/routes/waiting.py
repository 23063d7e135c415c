"""Waiting on behalf of a client, and no longer than the client waits itself."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Coroutine
from typing import TypeVar

from starlette.requests import Request
from starlette.types import Receive

from service.errors import EngineUnavailable
from service.routes.boundary import ClientLeft
from service.routes.parts import Parts

Result = TypeVar("Result")
POLL_SECONDS = 0.05


async def while_connected(request: Request, work: Coroutine[None, None, Result]) -> Result:
    """The work's result; if the client leaves first, the work is cancelled and ``ClientLeft`` raised.

    The request's body must have been read.
    """
    task = asyncio.ensure_future(work)
    leaving = asyncio.ensure_future(_disconnect(request.receive))
    try:
        await asyncio.wait({task, leaving}, return_when=asyncio.FIRST_COMPLETED)
        if task.done():
            return task.result()
        raise ClientLeft
    finally:
        leaving.cancel()
        if not task.done():
            task.cancel()
            await asyncio.wait({task})


async def _disconnect(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass


async def fingerprint(parts: Parts) -> str:
    """The workers' fingerprint; waits for the first worker while the workers start.

    Raises ``EngineUnavailable`` when none comes up within the settings' ``ready_seconds``.
    """
    deadline = time.monotonic() + parts.settings.ready_seconds
    while True:
        try:
            return parts.frames.fingerprint
        except EngineUnavailable:
            is_starting = any(worker.state == "starting" for worker in parts.engine.status())
            if not is_starting or time.monotonic() > deadline:
                raise
        await asyncio.sleep(POLL_SECONDS)
