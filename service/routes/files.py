"""Files as answers: by entity tag, whole or by one range (RFC 9110, sections 13 and 14)."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator
from pathlib import Path
from typing import BinaryIO

import anyio.to_thread
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from service.problems import Problem
from service.routes.answering import is_known_to
from service.routes.parts import is_head

PIECE = 1 << 20
"""Bytes that are read and sent at a time."""
ONE_RANGE = re.compile(r"bytes=(\d*)-(\d*)\Z")


async def file_answer(request: Request, path: Path, media_type: str, etag: str, headers: dict[str, str]) -> Response:
    """The file, the range of it that is asked for, or 304. Several ranges at once are answered with the whole."""
    headers = {**headers, "ETag": etag, "Accept-Ranges": "bytes"}
    if is_known_to(request.headers.get("if-none-match", ""), etag):
        return Response(status_code=304, headers=headers)
    file = await anyio.to_thread.run_sync(path.open, "rb")
    size = await anyio.to_thread.run_sync(file.seek, 0, 2)
    try:
        start, stop = asked_range(request.headers, size, etag)
    except Problem:
        file.close()
        raise
    headers["Content-Length"] = str(stop - start)
    if (start, stop) != (0, size):
        headers["Content-Range"] = f"bytes {start}-{stop - 1}/{size}"
    status = 206 if "Content-Range" in headers else 200
    if is_head(request):
        file.close()
        return Response(status_code=200, headers=headers, media_type=media_type)
    return StreamingResponse(_pieces(file, start, stop), status, headers, media_type)


def asked_range(headers: Headers, size: int, etag: str) -> tuple[int, int]:
    """First byte and end of what a Range header asks for; the whole file where it asks for nothing that is served.

    Raises ``Problem`` (416) for a range that lies past the file's end.
    """
    whole = (0, size)
    found = ONE_RANGE.match(headers.get("range", "").replace(" ", ""))
    if found is None or headers.get("if-range", etag) != etag:
        return whole
    first, last = found.groups()
    if not first and not last:
        return whole
    if not first:
        start, stop = max(0, size - int(last)), size
    else:
        start, stop = int(first), min(size, int(last) + 1) if last else size
        if last and int(last) < start:
            return whole
    if start >= size or start >= stop:
        raise Problem(
            "range-not-satisfiable",
            f"The file has {size} bytes.",
            headers={"Content-Range": f"bytes */{size}"},
        )
    return start, stop


async def _pieces(file: BinaryIO, start: int, stop: int) -> AsyncIterator[bytes]:
    try:
        file.seek(start)
        while start < stop:
            piece = await anyio.to_thread.run_sync(file.read, min(PIECE, stop - start))
            if not piece:
                return
            start += len(piece)
            yield piece
    finally:
        file.close()
