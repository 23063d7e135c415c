"""What the OpenAPI document says of the routes beyond their signatures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI, Response
from fastapi.openapi.utils import get_openapi

from renderer.encode.image import FORMATS
from renderer.request import FrameRequest
from renderer.scene.image_files import KINDS as IMAGE_KINDS
from renderer.trajectory import Turntable
from service.asking import SUFFIXES
from service.fields import FieldFacts, frame_fields
from service.jobs.spec import JobForm
from service.problem_kinds import KINDS
from service.problems import MEDIA_TYPE

REF = "#/components/schemas/{model}"
EXAMPLE = {"scene": "pond", "water": "luna", "time": 1.25, "width": 640, "height": 360}
ALWAYS = (401, 421, 500)
"""Statuses that every path under /v1 may answer with."""

PROBLEM_SCHEMA: Mapping[str, Any] = {
    "type": "object",
    "title": "Problem",
    "description": "An error (RFC 9457). Its type is the path of a page that says what it means and how to mend it.",
    "required": ["type", "title", "status", "detail", "instance", "request_id"],
    "properties": {
        "type": {"type": "string", "enum": [kind.path for kind in KINDS.values()]},
        "title": {"type": "string"},
        "status": {"type": "integer", "minimum": 400, "maximum": 599},
        "detail": {"type": "string"},
        "instance": {"type": "string", "description": "The path that was asked for."},
        "request_id": {"type": "string"},
        "errors": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["path", "message", "value"],
                "properties": {
                    "path": {"type": "string", "description": "The field as the caller wrote it."},
                    "message": {"type": "string"},
                    "value": {"description": "What was given."},
                    "bound": {"type": "string", "description": "What would be right."},
                },
            },
        },
    },
}

TURNTABLE_BODY: Mapping[str, Any] = {
    "type": "object",
    "title": "TurntableRequest",
    "additionalProperties": False,
    "properties": {
        "kind": {"const": "turntable"},
        "frame": {"$ref": REF.format(model="FrameRequest")},
        "turntable": {"$ref": REF.format(model="Turntable")},
        "outputs": {"type": "array", "items": {"enum": ["zip", "mp4"]}, "maxItems": 1},
        "format": {"enum": ["zip", "mp4"]},
    },
}


def job_form() -> dict[str, Any]:
    """The schema of a job's body, with what it draws spelt out."""
    form = JobForm.model_json_schema()
    drawn = {
        "frame": {"$ref": REF.format(model="FrameRequest")},
        "turntable": {"$ref": REF.format(model="Turntable")},
    }
    return {**form, "title": "JobRequest", "properties": {**form["properties"], **drawn}}


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The documented errors of a route."""
    content = {MEDIA_TYPE: {"schema": {"$ref": REF.format(model="Problem")}}}
    return {
        status: {
            "description": "; or: ".join(kind.title for kind in KINDS.values() if kind.status == status),
            "content": content,
        }
        for status in sorted({*statuses, *ALWAYS})
    }


def binary(*media_types: str) -> dict[str, Any]:
    """An answer that is a file of one of these types."""
    return {"description": "The file.", "content": {kind: {"schema": {"format": "binary"}} for kind in media_types}}


def body(model: str, example: Mapping[str, Any]) -> dict[str, Any]:
    """A JSON body of one of the document's schemas."""
    content = {"schema": {"$ref": REF.format(model=model)}, "example": example}
    return {"requestBody": {"required": True, "content": {"application/json": content}}}


image_upload: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["file", "kind"],
                    "additionalProperties": False,
                    "properties": {
                        "file": {"type": "string", "format": "binary", "description": "A PNG, JPEG or WebP image."},
                        "kind": {"enum": list(IMAGE_KINDS), "description": "What the image is for."},
                    },
                },
            },
        },
    },
}
image_answer: dict[str, Any] = {
    "description": "The image: its id is what requests name.",
    "content": {
        "application/json": {
            "schema": {
                "type": "object",
                "required": ["id", "kind", "width", "height"],
                "properties": {
                    "id": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
                    "kind": {"enum": list(IMAGE_KINDS)},
                    "width": {"type": "integer", "minimum": 1},
                    "height": {"type": "integer", "minimum": 1},
                },
            },
        },
    },
}


def answer(description: str, **schema: Any) -> dict[str, Any]:
    """A JSON answer."""
    content = {"application/json": {"schema": schema or {"type": "object"}}}
    return {"description": description, "content": content}


def suffixes_of(media_type: str) -> tuple[str, ...]:
    """The suffixes that a frame of this media type may have."""
    return tuple(name for entry in FORMATS.values() if entry.media_type == media_type for name in entry.suffixes)


def _parameter(facts: FieldFacts) -> dict[str, Any]:
    return {
        "name": facts.path,
        "in": "query",
        "required": False,
        "description": f"{facts.description} ({facts.line()})".strip(),
        "schema": _within_document(facts.schema),
        **({"style": "form", "explode": False} if facts.schema.get("type") == "array" else {}),
    }


def _within_document(schema: Any) -> Any:
    """A schema whose references lead to the document's components, not to a model's own definitions."""
    if isinstance(schema, Mapping):
        return {
            name: REF.format(model=value.rsplit("/", 1)[-1]) if name == "$ref" else _within_document(value)
            for name, value in schema.items()
        }
    return [_within_document(item) for item in schema] if isinstance(schema, list) else schema


_IMAGES = binary(*dict.fromkeys(entry.media_type for entry in FORMATS.values()))
_SUFFIX = {
    "name": "suffix",
    "in": "path",
    "required": True,
    "schema": {"enum": list(SUFFIXES)},
    "description": "The file format.",
}
_QUERY = [_parameter(facts) for facts in frame_fields()]
_FRAME_ERRORS = problems(404, 414, 422, 503, 504)

frame_by_query: dict[str, Any] = {
    "response_class": Response,
    "responses": {200: _IMAGES, 304: {"description": "The caller has the frame."}, **_FRAME_ERRORS},
    "openapi_extra": {"parameters": _QUERY},
}
frame_by_query_and_suffix: dict[str, Any] = {**frame_by_query, "openapi_extra": {"parameters": [_SUFFIX, *_QUERY]}}
frame_by_body: dict[str, Any] = {
    "response_class": Response,
    "responses": {200: _IMAGES, **problems(400, 403, 413, 415, 422, 503, 504)},
    "openapi_extra": body("FrameRequest", EXAMPLE),
}


def install(app: FastAPI, version: str) -> None:
    """Make the application's OpenAPI document name its problems and the renderer's own schemas."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            described = get_openapi(title=app.title, version=version, description=app.description, routes=app.routes)
            schemas = described.setdefault("components", {}).setdefault("schemas", {})
            schemas.update(Problem=PROBLEM_SCHEMA, TurntableRequest=TURNTABLE_BODY, JobRequest=job_form())
            for model in (FrameRequest, Turntable):
                schema = model.model_json_schema(ref_template=REF)
                schemas.update(schema.pop("$defs", {}))
                schemas[model.__name__] = schema
            _drop_foreign_errors(described)
            app.openapi_schema = described
        return app.openapi_schema

    app.openapi = document  # type: ignore[method-assign]  # FastAPI's documented way to extend the document


def _drop_foreign_errors(document: dict[str, Any]) -> None:
    """Take out FastAPI's own form of a 422, which is never sent."""
    for operation in (entry for path in document["paths"].values() for entry in path.values()):
        answers = operation["responses"]
        if "HTTPValidationError" in str(answers.get("422", "")):
            del answers["422"]
    for unused in ("HTTPValidationError", "ValidationError"):
        document["components"]["schemas"].pop(unused, None)
