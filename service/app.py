"""The application: the one place where the parts are put together."""

from __future__ import annotations

import logging
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import anyio.to_thread
from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from service.artifacts import LocalArtifacts
from service.engines.catalogue import ENGINES
from service.frames import Deadlines, FrameCache
from service.jobs import Jobs
from service.places import Places
from service.problems import problem_of
from service.routes import catalogue, frames, health, images, jobs, page, schema, turntable
from service.routes.answering import release
from service.routes.boundary import Boundary
from service.routes.parts import Parts
from service.settings import Settings

LOG = logging.getLogger("millpond.service")
DESCRIPTION = (
    "Frames of reflective and refractive water, rendered without a display. A frame is a pure function of its request: "
    "the same request has the same key, the same ETag and the same bytes."
)
CLOSING_SECONDS = 2.0
"""Time that running batch frames have once every answer is out; what they don't finish is drawn after the restart."""


def create_app(parts: Parts) -> FastAPI:
    """The service as an ASGI application; the parts are closed when it shuts down."""

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        try:
            yield
        finally:
            LOG.info("stopping")
            await anyio.to_thread.run_sync(close, parts)

    app = FastAPI(
        title="Millpond",
        version=release(),
        description=DESCRIPTION,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
        redirect_slashes=False,
        lifespan=lifespan,
        exception_handlers={HTTPException: _as_problem, RequestValidationError: _as_problem},
    )
    app.state.parts = parts
    app.add_middleware(Boundary, settings=parts.settings)
    for room in (frames, turntable, jobs, images, catalogue, health, page):
        app.include_router(room.router)
    schema.install(app, release())
    return app


def put_together(settings: Settings) -> Parts:
    """The parts of the service, started: the workers come up in the background."""
    store = settings.data_dir / "artifacts"
    artifacts = LocalArtifacts(store, budget=settings.artifact_bytes)
    engine = ENGINES["local"](
        store,
        workers=settings.workers,
        interactive=settings.interactive,
        require=settings.require,
        max_frames_per_worker=settings.worker_frames,
        max_rss=settings.worker_bytes,
    )
    cache = FrameCache(
        engine,
        artifacts,
        queue_seconds=settings.limits.queue_seconds,
        deadlines=Deadlines(settings.deadline_seconds, settings.deadline_factor),
        memory=settings.memory_bytes,
        ready_seconds=settings.ready_seconds,
    )
    work = Jobs(
        settings.database_url,
        cache,
        artifacts,
        data_dir=settings.data_dir,
        expiry_seconds=settings.job_days * 86_400,
        max_frames=settings.limits.job_frames,
        limits=settings.limits,
    )
    work.start()  # first, since it refuses a folder that another server works in
    engine.start()
    return Parts(settings, engine, cache, work, Places(settings.limits.sequences), time.monotonic())


def close(parts: Parts) -> None:
    """End the work and the workers; what a job had under way is drawn after the next start."""
    parts.jobs.close()
    parts.engine.close(CLOSING_SECONDS)


async def _as_problem(request: Request, error: Exception) -> Response:
    """What the router itself refuses: unknown paths, methods, parameters that do not parse."""
    return problem_of(error).response(request.url.path, request.scope["state"]["request_id"])
