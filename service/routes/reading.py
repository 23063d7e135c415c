"""From HTTP to a request that the renderer knows: bodies, queries, formats, caps."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any
from urllib.parse import parse_qsl

from starlette.datastructures import Headers
from starlette.requests import ClientDisconnect, Request

from renderer.encode.image import FORMATS
from renderer.errors import FieldProblem
from renderer.query import parse_query
from service.asking import SUFFIXES
from service.problems import Problem, invalid
from service.routes.boundary import ClientLeft
from service.settings import Limits

BY_MEDIA_TYPE: Mapping[str, str] = {entry.media_type: name for name, entry in reversed(FORMATS.items())}


async def read_json(request: Request, limits: Limits) -> dict[str, Any]:
    """The request's body, one JSON object; refuses other types, repeated names and too many bytes."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json" and not (kind.startswith("application/") and kind.endswith("+json")):
        given = f"not {kind!r}" if kind else "and no Content-Type was given"
        raise Problem("unsupported-media-type", f"The body must be application/json, {given}.")
    return parse_json(await _read(request, limits.body_bytes))


async def _read(request: Request, limit: int) -> bytes:
    problem = Problem(
        "too-large",
        f"The body has more than {limit} bytes.",
        headers={"Connection": "close"},
        facts={"bound": limit},
    )
    length = request.headers.get("content-length", "")
    if length.isdecimal() and int(length) > limit:
        raise problem
    body = bytearray()
    try:
        async for chunk in request.stream():
            body += chunk
            if len(body) > limit:
                raise problem
    except ClientDisconnect:
        raise ClientLeft from None
    return bytes(body)


class _Repeated:
    """Stands for the value of a name that an object has twice."""


def parse_json(body: bytes) -> dict[str, Any]:
    """A JSON object; NaN and infinities pass, so that the schema can refuse them by their path."""
    repeated = False

    def collect(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        nonlocal repeated
        found = dict(pairs)
        if len(found) < len(pairs):
            repeated = True
            names = [name for name, _ in pairs]
            found.update({name: _Repeated() for name in found if names.count(name) > 1})
        return found

    try:
        data = json.loads(body.decode("utf-8"), object_pairs_hook=collect)
    except (ValueError, RecursionError) as error:
        reason = "it nests too deeply" if isinstance(error, RecursionError) else str(error)
        raise Problem("malformed-body", f"The body is not JSON: {reason}.") from None
    if not isinstance(data, dict):
        raise invalid(FieldProblem("", "the body must be a JSON object", data, "an object"))
    if repeated:
        raise invalid(*(FieldProblem(path, "the name stands twice") for path in _repeated_paths(data)))
    return data


def _repeated_paths(data: Any) -> list[str]:
    """Where names stand twice; by a list of what is left to look at, since a body may nest deeper than Python does."""
    found: list[str] = []
    left: list[tuple[str, Any]] = [("", data)]
    while left:
        path, value = left.pop()
        if isinstance(value, _Repeated):
            found.append(path)
        items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        left += [(f"{path}.{name}" if path else str(name), item) for name, item in items]
    return sorted(found)


def read_query(query: bytes) -> tuple[dict[str, Any], str | None]:
    """The frame's fields of a query, nested as in JSON, and the version that the query names in ``v``."""
    try:
        pairs = parse_qsl(query.decode("ascii"), keep_blank_values=True, errors="strict")
    except UnicodeDecodeError:
        raise invalid(FieldProblem("", "the query is not percent-encoded UTF-8")) from None
    version = next((value for name, value in pairs if name == "v"), None)
    return parse_query(pairs), version


def known_suffix(suffix: str) -> str:
    """The suffix as the formats write it; a suffix of no format is 404 with the list."""
    if suffix.lower() not in SUFFIXES:
        listed = ", ".join(f".{name}" for name in SUFFIXES)
        raise Problem("not-found", f"No frame format is written .{suffix}; there are {listed}.")
    return suffix.lower()


def accepted_format(headers: Headers) -> str | None:
    """The frame format that the Accept header names, if it names exactly one."""
    return BY_MEDIA_TYPE.get(sole_type(headers) or "")


def sole_type(headers: Headers) -> str | None:
    """The one media type that the Accept header leaves open; JSON, the type of errors, is not counted."""
    named = {
        kind
        for kind, weight in _ranges(",".join(headers.getlist("accept")))
        if weight > 0 and not kind.endswith(("/json", "+json"))
    }
    return named.pop() if len(named) == 1 else None


def _ranges(accept: str) -> list[tuple[str, float]]:
    found = []
    for entry in filter(None, (part.strip().lower() for part in accept.split(","))):
        kind, *parameters = (part.strip() for part in entry.split(";"))
        weight = next((text[2:] for text in parameters if text.startswith("q=")), "1")
        try:
            found.append((kind, float(weight)))
        except ValueError:
            found.append((kind, 0.0))
    return found
