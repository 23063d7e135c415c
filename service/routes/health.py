"""Whether the service lives, whether it can draw, and what it is made of."""

from __future__ import annotations

import platform
import time
from dataclasses import asdict
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse, PlainTextResponse

from renderer.encode.image import encoder_versions
from renderer.errors import DeviceError
from renderer.source_digest import source_digest
from service.engines.base import WorkerStatus
from service.errors import EngineUnavailable
from service.problems import Problem
from service.routes import schema
from service.routes.answering import release, running_version
from service.routes.parts import parts_of

NEVER = {"Cache-Control": "no-store"}
RETRY = {"Retry-After": "2"}
router = APIRouter(tags=["health"])


@router.get("/livez", operation_id="live", response_class=PlainTextResponse)
async def live() -> Response:
    """Whether the event loop turns; it says nothing of the renderer."""
    return PlainTextResponse("alive\n", headers=NEVER)


@router.get("/readyz", operation_id="ready", responses=schema.problems(503))
async def ready(request: Request) -> Response:
    """Whether every worker has drawn its canary frame, right and alike."""
    engine = parts_of(request).engine
    readiness = engine.readiness()
    if not readiness.is_ready:
        try:
            engine.wait_ready(0.0)
        except DeviceError as error:  # it will never be: the doctor's text says why
            raise Problem("no-device", str(error), headers=RETRY) from error
        except EngineUnavailable:
            pass
        workers = [_worker(worker) for worker in engine.status()]
        raise Problem("not-ready", readiness.detail, headers=RETRY, facts={"workers": workers})
    return JSONResponse({"status": "ready", "detail": readiness.detail}, headers=NEVER)


@router.get("/v1/info", operation_id="info", responses=schema.problems())
async def info(request: Request) -> Response:
    """Versions, driver, whether it draws in software, fingerprint, workers and caps."""
    parts = parts_of(request)
    status = parts.engine.status()
    known = next((worker for worker in status if worker.fingerprint), None)
    return JSONResponse(
        {
            "name": "millpond",
            "version": release(),
            "v": running_version(),
            "source_digest": source_digest(),
            "python": platform.python_version(),
            "renderer": known.driver if known else None,
            "software": known.software if known else None,
            "fingerprint": known.fingerprint if known else None,
            "encoders": encoder_versions(),
            "require": parts.settings.require,
            "ready": parts.engine.readiness().is_ready,
            "uptime_seconds": round(time.monotonic() - parts.started, 1),
            "workers": [_worker(worker) for worker in status],
            "limits": parts.settings.limits.model_dump(),
        },
        headers=NEVER,
    )


def _worker(worker: WorkerStatus) -> dict[str, Any]:
    facts = asdict(worker)
    for name in ("busy_seconds", "last_frame_age"):
        facts[name] = None if facts[name] is None else round(facts[name], 3)
    return {**facts, "lane": worker.lane.value}
