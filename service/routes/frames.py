"""One frame: by GET with a dotted query, or by POST with a JSON body."""

from __future__ import annotations

import asyncio
import logging

from fastapi import APIRouter, Request, Response

from renderer.encode.image import FORMATS
from renderer.errors import FieldProblem
from renderer.query import RESERVED
from renderer.request import FrameRequest
from service.artifacts import artifact_name
from service.asking import frame_request
from service.frames import StoredFrame
from service.problems import invalid
from service.routes import schema
from service.routes.answering import caching, header_text, identity, is_known_to, provenance
from service.routes.parts import Parts, is_head, parts_of, request_id
from service.routes.reading import (
    accepted_format,
    known_suffix,
    read_json,
    read_query,
)
from service.routes.waiting import fingerprint, while_connected

LOG = logging.getLogger("millpond.frame")
HEAD_START = 0.005
"""Seconds in which a frame goes off to its worker, before this process writes the headers beside the drawing."""
router = APIRouter(tags=["frames"])


@router.get("/v1/frame", operation_id="frame", **schema.frame_by_query)
async def show_frame(request: Request) -> Response:
    """A frame, described by a dotted query; its format by ``format``, or by an ``Accept`` that names exactly one.

    The ETag is known before anything is drawn: a matching ``If-None-Match`` is answered with 304, and HEAD
    is answered, without rendering.
    """
    return await _shown(request, None)


@router.get("/v1/frame.{suffix}", operation_id="frame_as", **schema.frame_by_query_and_suffix)
async def show_frame_as(request: Request, suffix: str) -> Response:
    """A frame, described by a dotted query; its format by the suffix."""
    return await _shown(request, known_suffix(suffix))


async def _shown(request: Request, suffix: str | None) -> Response:
    parts = parts_of(request)
    data, version = read_query(request.scope["query_string"])
    frame = frame_request(data, parts.settings.limits, suffix=suffix, preferred=accepted_format(request.headers))
    marks = await fingerprint(parts)
    key = frame.key()
    etag = f'"{artifact_name(key, marks)}"'
    headers = {**identity(frame, key, etag, marks), **caching(parts.settings, version)}
    if is_known_to(request.headers.get("if-none-match", ""), etag):
        return Response(status_code=304, headers=headers)
    if is_head(request) and not parts.frames.find(frame):
        return _described(frame, headers, parts)
    return _answer(await _stored(request, frame), headers)


@router.post("/v1/frame", operation_id="post_frame", **schema.frame_by_body)
async def post_frame(request: Request) -> Response:
    """A frame, described by a JSON body. ``Content-Location`` is the URL that shows the same frame by GET."""
    parts = parts_of(request)
    refuse_query(request)
    data = await read_json(request, parts.settings.limits)
    frame = frame_request(data, parts.settings.limits, preferred=accepted_format(request.headers))
    marks = await fingerprint(parts)
    drawing = asyncio.ensure_future(_stored(request, frame))
    try:
        await asyncio.wait({drawing}, timeout=HEAD_START)
        key = frame.key()
        headers = {**identity(frame, key, f'"{artifact_name(key, marks)}"', marks), **caching(parts.settings)}
        return _answer(await drawing, headers)
    finally:
        drawing.cancel()


def refuse_query(request: Request) -> None:
    """Refuse fields in the query of a request that carries them in its body."""
    extra = [name for name in request.query_params if name not in RESERVED]
    if extra:
        message = "POST takes its fields in the body, not in the query"
        raise invalid(*(FieldProblem(name, message, request.query_params[name]) for name in extra))


async def _stored(request: Request, frame: FrameRequest) -> StoredFrame:
    stored = await while_connected(request, parts_of(request).frames.frame(frame))
    log_frame(request, stored)
    return stored


def _answer(stored: StoredFrame, headers: dict[str, str]) -> Response:
    return Response(stored.data, headers={**headers, **provenance(stored)}, media_type=stored.media_type)


def _described(frame: FrameRequest, headers: dict[str, str], parts: Parts) -> Response:
    """The answer to HEAD for a frame that nobody has asked for yet: its length is not known."""
    driver = parts.engine.driver
    response = Response(
        headers={**headers, "X-Renderer": header_text(driver)}, media_type=FORMATS[frame.format].media_type
    )
    del response.headers["content-length"]
    return response


def log_frame(request: Request, stored: StoredFrame) -> None:
    """One line for a frame that went out."""
    LOG.info(
        "frame",
        extra={
            "key": stored.key,
            "request_id": request_id(request),
            "is_hit": stored.hit,
            "bytes": len(stored.data),
            **{f"{stage}_ms": round(seconds * 1e3, 2) for stage, seconds in stored.timings.items()},
        },
    )
