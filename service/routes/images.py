"""Users' own images: uploaded once, then named by their id in any request."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from dataclasses import asdict
from functools import cache

import anyio
import anyio.to_thread
from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse
from starlette.datastructures import FormData, UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser
from starlette.requests import ClientDisconnect

from renderer.errors import FieldProblem
from renderer.scene.image_files import KINDS, ImageCaps
from renderer.scene.images import ImageLibrary, image_library, known_kind
from service.problems import Problem, invalid
from service.routes import schema
from service.routes.boundary import ClientLeft
from service.routes.frames import refuse_query
from service.routes.parts import parts_of
from service.settings import Limits

ENVELOPE = 8192
"""Bytes that a multipart body may have besides the file: boundaries, the parts' heads, the other fields."""
FIELD_BYTES = 256
"""Bytes of a field that is no file."""
PARTS = ("file", "kind")
router = APIRouter(tags=["images"])


@router.post(
    "/v1/images",
    operation_id="upload_image",
    status_code=201,
    responses={201: schema.image_answer, **schema.problems(400, 403, 413, 415, 422, 503)},
    openapi_extra=schema.image_upload,
)
async def upload(request: Request) -> JSONResponse:
    """Keep an image (PNG of 8 or 16 bits, JPEG or WebP) under an id that frames may name.

    The id is the SHA-256 of kind and bytes: the same upload is the same image, and is answered with 201 as before.
    """
    limits = parts_of(request).settings.limits
    refuse_query(request)
    form = await _form(request, limits.image_bytes)
    try:
        data, kind = await _fields(form)
    finally:
        await form.close()
    library = library_of(limits)
    # one image is decoded at a time: the largest takes some hundred megabytes while it is looked at
    card = await anyio.to_thread.run_sync(library.put, data, kind, limiter=_one_at_a_time())
    return JSONResponse(asdict(card), 201, headers={"Cache-Control": "no-store"})


def library_of(limits: Limits) -> ImageLibrary:
    """The library, within this server's caps."""
    caps = ImageCaps(limits.image_bytes, limits.image_side, limits.image_pixels)
    return image_library(caps, limits.image_library_bytes)


@cache
def _one_at_a_time() -> anyio.CapacityLimiter:
    return anyio.CapacityLimiter(1)


async def _form(request: Request, limit: int) -> FormData:
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "multipart/form-data":
        given = f"not {kind!r}" if kind else "and no Content-Type was given"
        raise Problem("unsupported-media-type", f"The body must be multipart/form-data, {given}.")
    too_large = Problem(
        "too-large",
        f"The file has more than {limit} bytes.",
        headers={"Connection": "close"},
        facts={"bound": limit},
    )
    length = request.headers.get("content-length", "")
    if length.isdecimal() and int(length) > limit + ENVELOPE:
        raise too_large
    body = _bounded(request, limit + ENVELOPE, too_large)
    parser = MultiPartParser(request.headers, body, max_files=1, max_fields=len(PARTS), max_part_size=FIELD_BYTES)
    try:
        form = await parser.parse()
    except ClientDisconnect:
        raise ClientLeft from None
    except MultiPartException as error:
        raise Problem("malformed-body", f"The body is no form: {error.message}") from None
    if any(isinstance(value, UploadFile) and (value.size or 0) > limit for _, value in form.multi_items()):
        await form.close()
        raise too_large
    return form


async def _bounded(request: Request, limit: int, problem: Problem) -> AsyncGenerator[bytes, None]:
    read = 0
    async for chunk in request.stream():
        read += len(chunk)
        if read > limit:
            raise problem
        yield chunk


async def _fields(form: FormData) -> tuple[bytes, str]:
    """The file's bytes and its kind; every mistake of the form at once."""
    items = form.multi_items()
    problems = [FieldProblem(name, "unknown field", None, "file, kind") for name, _ in items if name not in PARTS]
    problems += [
        FieldProblem(name, "given more than once") for name in PARTS if sum(name == other for other, _ in items) > 1
    ]
    file, kind = form.get("file"), form.get("kind")
    if not isinstance(file, UploadFile):
        message = "missing" if file is None else "a file's part has a filename in its head"
        problems.append(FieldProblem("file", message, file, "a PNG, JPEG or WebP image"))
    if not isinstance(kind, str):
        problems.append(
            FieldProblem("kind", "missing" if kind is None else "a name", None, "one of " + ", ".join(KINDS))
        )
    if problems or not isinstance(file, UploadFile) or not isinstance(kind, str):
        raise invalid(*problems)
    known_kind(kind)  # before the file is read
    return await file.read(), kind
