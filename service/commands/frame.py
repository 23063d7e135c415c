"""``millpond frame``: one image, drawn without a server, with the same key and bytes as over HTTP."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

from renderer.encode.image import REQUEST_KEYWORD, read_png_text
from renderer.errors import EncodeError
from renderer.request import FrameRequest
from service.asking import SUFFIXES, frame_request
from service.commands.drawing import Demand, frames_of_this_process, refuse_unwritable, write_whole
from service.commands.options import Option, Usage, help_text, overlaid, take_apart
from service.frames import FrameCache, StoredFrame

USAGE = "millpond frame OUT [options] [--FIELD VALUE …]"
SUMMARY = (
    "Draws one frame into OUT (.png, .jpg, .webp; - writes to standard output), without a server: the same request has "
    "the same key and the same bytes as over HTTP."
)
OPTIONS = (
    Option("from", "FILE", "draw the request that a PNG of ours carries, or a JSON file; fields go over it"),
    Option("require", "KIND", "the device to draw on: any, gpu or cpu"),
    Option("print-request", "", "write the resolved request as JSON instead of drawing it"),
    Option("help", "", "this text"),
)


def help_page() -> str:
    """The answer to ``--help``."""
    return help_text(USAGE, SUMMARY, OPTIONS, has_fields=True)


def run(arguments: Sequence[str]) -> int:
    """Draw, write, say what was written."""
    given = take_apart(arguments, OPTIONS)
    if len(given.positional) != 1:
        raise Usage(f"one OUT is needed, not {len(given.positional)}: {USAGE}")
    out = given.positional[0]
    below = _request_in(Path(given.own["from"])) if "from" in given.own else {}
    frame = _frame(out, below, given.frame_fields())
    if "print-request" in given.own:
        sys.stdout.write(frame.canonical().decode() + "\n")
        return 0
    if out != "-":
        refuse_unwritable(Path(out))
    began = time.perf_counter()
    with frames_of_this_process(cast("Demand", given.choice("require", ("any", "gpu", "cpu")))) as cache:
        ready = time.perf_counter()
        stored = asyncio.run(_draw(cache, frame))
        drawn = time.perf_counter()
    if out == "-":
        sys.stdout.buffer.write(stored.data)
        return 0
    write_whole(Path(out), stored.data)
    sys.stdout.write(
        f"{out}  {frame.width}×{frame.height}  {len(stored.data)} bytes  {stored.driver}\n"
        f"key {stored.key}\n"
        f"drawn in {drawn - ready:.3f} s, after {ready - began:.2f} s to set up\n"
    )
    return 0


async def _draw(cache: FrameCache, frame: FrameRequest) -> StoredFrame:
    return await cache.frame(frame)


def _frame(out: str, below: dict[str, Any], above: dict[str, Any]) -> FrameRequest:
    if out == "-":
        return frame_request(overlaid(below, above))
    suffix = Path(out).suffix.removeprefix(".").lower()
    if suffix not in SUFFIXES:
        listed = ", ".join(f".{name}" for name in SUFFIXES)
        raise Usage(f"{out}: no frame format is written {'.' + suffix if suffix else 'without a suffix'}; use {listed}")
    if "format" not in above:  # the name of the new file decides, not the format of the old one
        below = {name: value for name, value in below.items() if name != "format"}
    return frame_request(overlaid(below, above), suffix=suffix)


def _request_in(path: Path) -> dict[str, Any]:
    """The request that a PNG carries, or that a JSON file is."""
    try:
        data = path.read_bytes()
        text = data.decode() if data.lstrip()[:1] == b"{" else read_png_text(data)[REQUEST_KEYWORD]
        request = json.loads(text)
    except OSError as error:
        raise Usage(f"{path} can't be read: {error.strerror}") from error
    except KeyError:
        raise Usage(f"{path} carries no request: it was not drawn by Millpond, or was rewritten since") from None
    except (EncodeError, ValueError) as error:
        raise Usage(f"{path} carries no request: {error}") from error
    if not isinstance(request, dict):
        raise Usage(f"{path} carries no request: not a JSON object")
    return request
