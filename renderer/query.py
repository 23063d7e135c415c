"""The dotted form of a request: ``water=luna&camera.eye=9,3.2,9``, as URLs and command lines give it.

Lists are written with commas, ``null`` literally, lists of objects as JSON. A bare name may stand
beside its dotted fields: ``water=luna&water.ripple_scale=0.06,0.03``.
"""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any
from urllib.parse import quote, urlencode

from renderer.errors import FieldProblem, InvalidRequest
from renderer.request import FrameRequest
from renderer.scene.catalogue import SCENES

BARE = {"water": "technique", "sky": "model", "tonemap": "operator"}
"""Which field a bare name stands for."""
RESERVED = frozenset({"sig", "kid", "exp", "v"})
"""Names in a URL that are not the request's."""
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z")
WORDS: dict[str, Any] = {"null": None, "true": True, "false": False}
DEPTH = 6
"""Dots in a name beyond which no field lies."""


def parse_query(pairs: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """The nested request of dotted pairs, values typed by the schema; reserved names are left out.

    Raises ``InvalidRequest`` for a repeated field, or one given both as a value and by its parts.
    """
    data: dict[str, Any] = {}
    bare: dict[str, str] = {}
    seen: set[str] = set()
    problems: list[FieldProblem] = []
    for name, text in pairs:
        if name in RESERVED:
            continue
        if name in seen:
            problems.append(FieldProblem(name, "given more than once", text))
            continue
        seen.add(name)
        if name in BARE and text != "null" and not text.startswith("{"):
            bare[name] = text
            continue
        problem = _place(data, name, _value(name, text))
        if problem:
            problems.append(problem)
    for name, text in bare.items():
        inner = data.setdefault(name, {})
        if not isinstance(inner, dict) or inner.setdefault(BARE[name], text) != text:
            problems.append(FieldProblem(name, f"contradicts {name}.{BARE[name]}", text))
    if problems:
        raise InvalidRequest(tuple(problems))
    return data


def to_query(request: FrameRequest) -> str:
    """The whole request as a URL's query; ``parse_query`` leads back to the same key."""
    fields = json.loads(request.canonical())
    own = SCENES[request.scene].own
    pairs = list(_flat("", fields, {"fog": ..., "sun": ..., **own}))
    return urlencode(pairs, quote_via=quote, safe=",#")


def _flat(prefix: str, value: Any, own: Any) -> Iterable[tuple[str, str]]:
    if isinstance(value, Mapping):
        for name, item in value.items():
            beneath = own.get(name) if isinstance(own, Mapping) else None
            yield from _flat(f"{prefix}.{name}" if prefix else name, item, beneath)
    elif value is not None:
        yield prefix, _text(value)
    elif own is not None:
        yield prefix, "null"


def _text(value: Any) -> str:
    if isinstance(value, list):
        if not value or any(isinstance(item, list | dict) for item in value):
            return json.dumps(value)
        return ",".join(_text(item) for item in value)
    return value if isinstance(value, str) else json.dumps(value)


def _place(data: dict[str, Any], name: str, value: Any) -> FieldProblem | None:
    parts = name.split(".")
    if len(parts) > DEPTH or not all(parts):
        return FieldProblem(name, "unknown field", value)
    inner = data
    for depth, part in enumerate(parts[:-1], 1):
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            whole = ".".join(parts[:depth])
            return FieldProblem(name, f"{whole} is already given as a whole", value)
    if parts[-1] in inner:
        return FieldProblem(name, "given as a whole and by its parts", value)
    inner[parts[-1]] = value
    return None


def _value(name: str, text: str) -> Any:
    named = _kinds().get(name, frozenset())
    kinds = named - {"null"}
    value: Any = text
    if text == "null" and ("null" in named or kinds != {"string"}):
        value = None
    elif kinds and kinds <= {"strings"}:
        value = text.split(",")
    elif kinds and kinds <= {"string"}:
        pass
    elif text.startswith(("[", "{")):
        with contextlib.suppress(ValueError, RecursionError):
            value = json.loads(text)
    elif "," in text or (kinds == {"array"} and NUMBER.match(text)):
        value = [_scalar(item) for item in text.split(",")]
    else:
        value = _scalar(text)
    return value


def _scalar(text: str) -> Any:
    text = text.strip()
    if text in WORDS:
        return WORDS[text]
    if not NUMBER.match(text):
        return text
    is_whole = not set(text) & set(".eE") and len(text) < 20
    return int(text) if is_whole else float(text)


@cache
def _kinds() -> dict[str, frozenset[str]]:
    """What each dotted name may hold, by the JSON schema: ``string``, ``strings``, ``array``, ``null``."""
    schema = FrameRequest.model_json_schema()
    kinds: dict[str, set[str]] = {}
    _collect("", schema, schema.get("$defs", {}), kinds, DEPTH)
    return {name: frozenset(kind) for name, kind in kinds.items()}


def _collect(
    name: str,
    schema: Mapping[str, Any],
    defs: Mapping[str, Any],
    kinds: dict[str, set[str]],
    depth: int,
) -> None:
    if "$ref" in schema:
        schema = defs[schema["$ref"].rsplit("/", 1)[-1]]
    for option in [*schema.get("anyOf", []), *schema.get("oneOf", []), *schema.get("allOf", [])]:
        _collect(name, option, defs, kinds, depth)
    kind = schema.get("type")
    if kind == "array" and schema.get("items", {}) and "prefixItems" not in schema:
        item = schema["items"]
        kind = "strings" if item.get("type") == "string" or "enum" in item else "array"
    if kind not in (None, "object"):
        kinds.setdefault(name, set()).add(str(kind))
    if depth:
        for field, inner in schema.get("properties", {}).items():
            _collect(f"{name}.{field}" if name else field, inner, defs, kinds, depth - 1)
