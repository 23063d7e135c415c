"""From fields, a file's suffix and the caps to a checked frame request: the same for HTTP and the command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from renderer.encode.image import FORMATS
from renderer.errors import FieldProblem, InvalidRequest
from renderer.request import FrameRequest
from renderer.scene.images import image_library
from service.settings import Limits

DEFAULT_FORMAT = "png"
SUFFIXES: Mapping[str, tuple[str, ...]] = {
    suffix: tuple(name for name, entry in FORMATS.items() if suffix in entry.suffixes)
    for suffix in dict.fromkeys(suffix for entry in FORMATS.values() for suffix in entry.suffixes)
}
"""The formats that a suffix may stand for, the first where nothing else is said."""


def frame_request(
    data: Mapping[str, Any],
    limits: Limits | None = None,
    *,
    suffix: str | None = None,
    preferred: str | None = None,
) -> FrameRequest:
    """The request that the fields mean; the format by suffix, else ``format``, else ``preferred``.

    ``suffix`` is one of ``SUFFIXES``. Raises ``InvalidRequest`` for what breaks the schema or a cap, and where
    suffix and ``format`` disagree.
    """
    asked = data.get("format")
    if suffix is not None:
        choices = SUFFIXES[suffix]
        if isinstance(asked, str) and asked in FORMATS and asked not in choices:
            contradiction = FieldProblem("format", f"the name ends in .{suffix}", asked, " or ".join(choices))
            raise InvalidRequest((contradiction,))
        data = {**data, "format": choices[0] if asked is None else asked}
    elif asked is None and "format" not in data:
        data = {**data, "format": preferred or DEFAULT_FORMAT}
    if limits is not None:
        _refuse_past_caps(data, limits)
    try:
        frame = FrameRequest.parse(data)
    except UnicodeEncodeError as error:  # JSON and command lines can spell text that is none
        raise InvalidRequest((FieldProblem("", f"holds half of a surrogate pair: {error.object!a}"),)) from None
    if limits is not None:
        _refuse_too_many_pixels(frame, limits)
    _refuse_unknown_images(frame)
    return frame


def _refuse_past_caps(data: Mapping[str, Any], limits: Limits) -> None:
    """Before the schema sees it: this server's caps are lower than the schema's bounds, and are what to tell."""
    over = [
        FieldProblem(name, f"this server draws at most {cap}", data[name], f"<= {cap}")
        for name, cap in (("width", limits.width), ("height", limits.height), ("samples", limits.samples))
        if isinstance(data.get(name), int | float) and data[name] > cap
    ]
    if over:
        raise InvalidRequest(tuple(over))


def _refuse_too_many_pixels(frame: FrameRequest, limits: Limits) -> None:
    pixels = frame.width * frame.height
    if pixels > limits.pixels:
        message = f"{frame.width}×{frame.height} is {pixels} pixels; this server draws at most {limits.pixels}"
        bound = f"width * height <= {limits.pixels}"
        raise InvalidRequest((FieldProblem("width", message, frame.width, bound),))


def _refuse_unknown_images(frame: FrameRequest) -> None:
    library = image_library()
    problems = []
    for path, (name, kind) in frame.images().items():
        found = library.kind_of(name)
        if found != kind:
            message = "no image here has this id: upload it" if found is None else f"this image is a {found}: upload it"
            bound = f"the id that POST /v1/images (or `millpond image add`) gives for kind {kind}"
            problems.append(FieldProblem(path, f"{message} with POST /v1/images, kind {kind}", name, bound))
    if problems:
        raise InvalidRequest(tuple(problems))


def within(prefix: str, problems: Iterable[FieldProblem]) -> tuple[FieldProblem, ...]:
    """The problems of a part, with their paths from the whole."""
    return tuple(
        FieldProblem(
            f"{prefix}.{problem.path}" if problem.path else prefix, problem.message, problem.value, problem.bound
        )
        for problem in problems
    )
