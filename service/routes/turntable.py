"""A turntable as an answer: the archive while its frames are drawn, or the movie when they all are."""

from __future__ import annotations

import tempfile
from collections.abc import AsyncGenerator, AsyncIterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from threading import Event
from typing import Any

import anyio
import anyio.to_thread
from fastapi import APIRouter, Request, Response
from fastapi.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from renderer.encode.image import FORMATS
from renderer.errors import Cancelled, FieldProblem, InvalidRequest
from service.frames import StoredFrame
from service.jobs.assembly import write_movie, zip_stream
from service.routes import schema
from service.routes.frames import log_frame, refuse_query
from service.routes.parts import Parts, parts_of
from service.routes.reading import read_json, sole_type
from service.routes.waiting import fingerprint, while_connected
from service.turntables import TurntablePlan, plan_turntable

MEDIA_TYPES = {"zip": "application/zip", "mp4": "video/mp4"}
FIELDS = frozenset({"kind", "frame", "turntable", "outputs", "format"})
router = APIRouter(tags=["frames"])


@router.post(
    "/v1/turntable",
    operation_id="turntable",
    response_class=Response,
    responses={200: schema.binary(*MEDIA_TYPES.values()), **schema.problems(400, 403, 413, 415, 422, 503, 504)},
    openapi_extra=schema.body("TurntableRequest", {"frame": schema.EXAMPLE, "turntable": {"frames": 24, "fps": 12}}),
)
async def turntable(request: Request) -> Response:
    """A turntable's frames as ``zip``, sent while they are drawn, or as ``mp4``.

    Which of them: the one entry of ``outputs``, else ``format``, else the one that ``Accept`` names, else ``zip``. A
    client that leaves stops the work.
    """
    parts = parts_of(request)
    refuse_query(request)
    limits = parts.settings.limits
    body = await read_json(request, limits)
    output, plan = _asked(body, parts, sole_type(request.headers))
    await fingerprint(parts)
    with ExitStack() as held:
        held.enter_context(parts.sequences.place())
        return await _answer(request, parts, plan, output, held)


async def _answer(request: Request, parts: Parts, plan: TurntablePlan, output: str, held: ExitStack) -> Response:
    """The answer; what is held is let go when its last byte is out."""
    headers = {"Cache-Control": "no-store", "Vary": "Accept", "X-Frame-Count": str(len(plan.requests))}
    if output == "mp4":
        movie = await while_connected(request, _movie(request, parts, plan))
        return Response(movie, headers=headers, media_type=MEDIA_TYPES[output])
    chunks = zip_stream(_logged(request, parts, plan), FORMATS[plan.frame.format].suffixes[0])
    try:  # what goes wrong before the first frame is there can still be told properly
        first = await while_connected(request, anext_of(chunks))
    except BaseException:
        await chunks.aclose()
        raise
    return _Held(chunks, first, held.pop_all(), headers=headers, media_type=MEDIA_TYPES[output])


def _asked(body: Mapping[str, Any], parts: Parts, accepted: str | None) -> tuple[str, TurntablePlan]:
    """What the answer is to be, and its frames; every mistake of the body at once."""
    problems = [FieldProblem(name, "unknown field", body[name]) for name in body if name not in FIELDS]
    if body.get("kind", "turntable") != "turntable":
        problems.append(FieldProblem("kind", "this path draws turntables", body["kind"], "turntable"))
    output = next((name for name, kind in MEDIA_TYPES.items() if kind == accepted), "zip")
    bound = "one of " + ", ".join(MEDIA_TYPES)
    products = list(MEDIA_TYPES)
    if "outputs" in body:
        named = body["outputs"]
        if not isinstance(named, list) or len(named) != 1 or named[0] not in products:
            problems.append(FieldProblem("outputs", "one answer holds one product", named, f"[{bound}]"))
        elif body.get("format", named[0]) != named[0]:
            problems.append(FieldProblem("format", "contradicts outputs", body["format"], named[0]))
        else:
            output = named[0]
    elif "format" in body:
        if body["format"] not in products:
            problems.append(FieldProblem("format", "there is no such product", body["format"], bound))
        else:
            output = body["format"]
    limits = parts.settings.limits
    try:
        plan = plan_turntable(body.get("frame", {}), body.get("turntable", {}), limits, limits.sequence_frames)
    except InvalidRequest as error:
        raise InvalidRequest((*problems, *error.problems)) from None
    if problems:
        raise InvalidRequest(tuple(problems))
    return output, plan


async def _logged(request: Request, parts: Parts, plan: TurntablePlan) -> AsyncIterator[StoredFrame]:
    frames = parts.frames.sequence(plan.requests)
    try:
        async for stored in frames:
            log_frame(request, stored)
            yield stored
    finally:
        with anyio.CancelScope(shield=True):
            await frames.aclose()


class _Held(StreamingResponse):
    """A streamed answer that gives back what it holds when it ends, also when it never began."""

    def __init__(self, chunks: AsyncGenerator[bytes, None], first: bytes, held: ExitStack, **facts: Any) -> None:
        super().__init__(_from(first, chunks), **facts)
        self._chunks = chunks
        self._held = held

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            with self._held, anyio.CancelScope(shield=True):
                await self._chunks.aclose()


async def _from(first: bytes, rest: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
    yield first
    async for chunk in rest:
        yield chunk


async def anext_of(chunks: AsyncIterator[bytes]) -> bytes:
    """The next chunk, as a coroutine."""
    return await anext(chunks)


async def _movie(request: Request, parts: Parts, plan: TurntablePlan) -> bytes:
    """The movie's bytes. Frames go through the disk, so that memory does not grow with their number."""
    with tempfile.TemporaryDirectory(prefix="turntable-", dir=parts.settings.data_dir) as folder:
        images: list[Path] = []
        async for stored in _logged(request, parts, plan):
            images.append(Path(folder, str(len(images))))
            images[-1].write_bytes(stored.data)
        return await _assembled(Path(folder, "movie.mp4"), images, plan)


async def _assembled(path: Path, images: list[Path], plan: TurntablePlan) -> bytes:
    is_unwanted = Event()

    def each() -> Any:
        for image in images:
            if is_unwanted.is_set():
                raise Cancelled
            yield image.read_bytes()

    def write() -> bytes:
        size = {"width": plan.frame.width, "height": plan.frame.height}
        write_movie(path, each(), **size, fps=plan.turntable.fps, count=len(images))
        return path.read_bytes()

    try:
        return await anyio.to_thread.run_sync(write)  # not abandoned when cancelled: the folder must outlive it
    finally:
        is_unwanted.set()
