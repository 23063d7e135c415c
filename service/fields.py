"""Every field of a frame request in dotted form, read from its JSON schema: for the command line and the API's page."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from renderer.request import FrameRequest

DEPTH = 5
BOUNDS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}


@dataclass(frozen=True)
class FieldFacts:
    """What there is to say of one field."""

    path: str
    kind: str
    """``number``, ``integer``, ``boolean``, ``name``, or how many numbers."""
    description: str
    unit: str | None = None
    bound: str = ""
    default: Any = None
    has_default: bool = False
    schema: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def line(self) -> str:
        """Kind, unit, bounds and default in a few words."""
        words = [self.kind]
        if self.unit:
            words.append(self.unit)
        if self.bound:
            words.append(self.bound)
        if self.has_default and self.default not in (None, []):
            words.append(f"default {_written(self.default)}")
        return ", ".join(words)


@cache
def frame_fields() -> tuple[FieldFacts, ...]:
    """The fields of a frame request; where several forms have a field of one name, the first speaks."""
    schema = FrameRequest.model_json_schema()
    found: dict[str, FieldFacts] = {}
    for facts in _walk("", schema, schema.get("$defs", {}), DEPTH):
        known = found.get(facts.path)
        if known is None:
            found[facts.path] = facts
        elif facts.kind == known.kind == "name" and facts.bound not in known.bound:
            found[facts.path] = _joined(known, facts)
    return tuple(found.values())


def _joined(first: FieldFacts, second: FieldFacts) -> FieldFacts:
    """One field that tells forms apart, such as ``sky.model``: all its names."""
    schema = {"type": "string"}
    bound = f"{first.bound} | {second.bound}"
    return FieldFacts(first.path, "name", first.description or second.description, bound=bound, schema=schema)


def _walk(path: str, schema: Mapping[str, Any], defs: Mapping[str, Any], depth: int) -> Iterator[FieldFacts]:
    outer = schema
    if "$ref" in schema:
        schema = {**defs[schema["$ref"].rsplit("/", 1)[-1]], **{k: v for k, v in schema.items() if k != "$ref"}}
    options = [*schema.get("anyOf", ()), *schema.get("oneOf", ()), *schema.get("allOf", ())]
    options = [option for option in options if option.get("type") != "null"]
    for option in options:
        told = {name: outer[name] for name in ("description", "default") if name in outer}
        yield from _walk(path, {**option, **told}, defs, depth)
    properties = schema.get("properties", {})
    for name, inner in properties.items() if depth else ():
        yield from _walk(f"{path}.{name}" if path else name, inner, defs, depth - 1)
    if not properties and not options:
        yield _facts(path, schema)


def _facts(path: str, schema: Mapping[str, Any]) -> FieldFacts:
    items = schema.get("prefixItems") or [schema.get("items", {})]
    values = schema.get("enum") or ([schema["const"]] if "const" in schema else [])
    kind = str(schema.get("type", "value"))
    bounds = [f"{sign} {schema[name]:g}" for name, sign in BOUNDS.items() if name in schema]
    if kind == "array":
        count = schema.get("minItems")
        kind = f"{count} numbers" if count and count == schema.get("maxItems") else "list"
        values = values or items[0].get("enum", [])
        bounds = bounds or [f"{sign} {items[0][name]:g}" for name, sign in BOUNDS.items() if name in items[0]]
    elif kind == "string":
        kind = "name"
    return FieldFacts(
        path,
        kind,
        str(schema.get("description", "")).partition("\n\n")[0].replace("\n", " "),
        schema.get("x-unit"),
        " | ".join(map(str, values)) or " and ".join(bounds),
        schema.get("default"),
        has_default="default" in schema and not isinstance(schema["default"], Mapping),
        schema={name: value for name, value in schema.items() if name not in {"title", "default"}},
    )


def _written(value: Any) -> str:
    """The value as a query or a command line has it."""
    if isinstance(value, list | tuple):
        return ",".join(_written(item) for item in value)
    return value if isinstance(value, str) else json.dumps(value)
