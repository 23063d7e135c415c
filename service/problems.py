"""Errors as HTTP answers: the kinds of problem, and the one table from exception to kind.

Bodies are RFC 9457 ``application/problem+json``; ``type`` is the path of a page that this service serves.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from starlette.exceptions import HTTPException
from starlette.responses import Response

from renderer.errors import (
    Cancelled,
    DeviceError,
    EncodeError,
    FieldProblem,
    ImageLibraryFull,
    InvalidRequest,
    MissingImage,
    NoDevice,
    SceneError,
)
from service import errors
from service.problem_kinds import KINDS

MEDIA_TYPE = "application/problem+json"
RETRY_SECONDS = 5.0
"""What Retry-After says where nobody knows better."""
LONGEST_TEXT = 4000
"""Characters of a text in a problem body: the doctor's report fits."""
LONGEST_LIST = 64
"""Items of a list in a problem body."""
NOT_FINITE = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}
"""Python's names of the numbers that JSON does not have, and JavaScript's."""
DEEPEST = 6
"""Levels of a value that a problem body repeats."""


@dataclass(eq=False)
class Problem(Exception):
    """A refusal: the kind, what is wrong this time, and the facts."""

    kind: str
    detail: str
    errors: tuple[FieldProblem, ...] = ()
    headers: Mapping[str, str] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def status(self) -> int:
        """The HTTP status."""
        return KINDS[self.kind].status

    def body(self, instance: str, request_id: str) -> dict[str, Any]:
        """The RFC 9457 object."""
        kind = KINDS[self.kind]
        body: dict[str, Any] = {
            "type": kind.path,
            "title": kind.title,
            "status": kind.status,
            "detail": self.detail,
            "instance": instance,
            "request_id": request_id,
        }
        if self.errors:
            body["errors"] = [_entry(problem) for problem in self.errors]
        return {**body, **self.facts}

    def response(self, instance: str, request_id: str) -> Response:
        """The HTTP answer, never to be cached."""
        return Response(
            json.dumps(_plain(self.body(instance, request_id)), allow_nan=False),
            self.status,
            {**self.headers, "Cache-Control": "no-store"},
            MEDIA_TYPE,
        )


TABLE: Mapping[type[Exception], str] = {
    NoDevice: "no-device",
    DeviceError: "render-failed",
    EncodeError: "render-failed",
    SceneError: "render-failed",
    MissingImage: "missing-image",
    ImageLibraryFull: "store-unavailable",
    Cancelled: "stopping",
    errors.WorkerDied: "renderer-crashed",
    errors.FrameTimedOut: "deadline",
    errors.FramePoisoned: "frame-set-aside",
    errors.Overloaded: "queue-full",
    errors.EngineUnavailable: "not-ready",
    errors.StoreUnavailable: "store-unavailable",
    errors.UnknownJob: "unknown-job",
    errors.JobExpired: "expired-job",
    errors.UnknownFrame: "unknown-frame",
    errors.UnknownProduct: "unknown-product",
    errors.FrameUnfinished: "job-unfinished",
    errors.JobUnfinished: "job-unfinished",
    errors.ProductIncomplete: "product-incomplete",
    errors.TransitionRefused: "job-state",
    errors.IdempotencyConflict: "idempotency-conflict",
    errors.BadCursor: "invalid-request",
}
"""The kind of problem of each exception; a subclass may have its own. What is not here is an internal error."""
FIELDS: Mapping[type[Exception], str] = {
    errors.BadCursor: "cursor",
    errors.IdempotencyConflict: "Idempotency-Key",
    MissingImage: "",
}
"""What an exception that stands for a 422 blames."""
BY_STATUS: Mapping[int, str] = {404: "not-found", 405: "method-not-allowed"}
"""The kind of problem of the statuses that the router itself raises."""
UNDER_WAY = frozenset({"queued", "running", "pending", "leased"})
"""States of a job, or of a frame of it, that end by themselves."""
TOLD = frozenset({"progress", "state", "missing"})
"""Attributes of an exception that its problem's body tells."""


def problem_of(error: Exception) -> Problem:
    """The problem that an exception is answered with."""
    if isinstance(error, Problem):
        return error
    if isinstance(error, InvalidRequest):
        return invalid(*error.problems)
    if isinstance(error, HTTPException):
        kind = BY_STATUS.get(error.status_code, "internal-error")
        return Problem(kind, KINDS[kind].meaning, headers=dict(error.headers or {}))
    return _told(error)


def _told(error: Exception) -> Problem:
    lineage = type(error).__mro__
    kind = next((TABLE[base] for base in lineage if base in TABLE), "internal-error")
    if kind == "internal-error":
        return Problem(kind, "The server's log has the details under this request_id.")
    facts = {name: value for name, value in vars(error).items() if name in TOLD and value is not None}
    mistakes = tuple(FieldProblem(FIELDS[base], str(error)) for base in lineage if base in FIELDS)
    return Problem(kind, str(error), mistakes, _retry(kind, error), facts)


def _retry(kind: str, error: Exception) -> dict[str, str]:
    is_coming = kind == "job-unfinished" and getattr(error, "state", None) in UNDER_WAY
    if KINDS[kind].status != 503 and not is_coming:
        return {}
    seconds = getattr(error, "retry_after", None) or RETRY_SECONDS
    return {"Retry-After": str(max(1, math.ceil(seconds)))}


def invalid(*problems: FieldProblem) -> Problem:
    """The problem of a request that breaks the schema or a cap."""
    return Problem("invalid-request", _sentence(problems), problems)


def _sentence(problems: Iterable[FieldProblem]) -> str:
    return "; ".join(str(problem) for problem in problems)


def _entry(problem: FieldProblem) -> dict[str, Any]:
    entry = {"path": problem.path, "message": problem.message, "value": problem.value}
    return entry if problem.bound is None else {**entry, "bound": problem.bound}


def _plain(value: Any, depth: int = DEEPEST) -> Any:
    """The value as JSON can hold it: NaN and infinities by name, long texts and deep trees cut."""
    if isinstance(value, Mapping | list | tuple) and depth == 0:
        return "…"
    if isinstance(value, Mapping):
        return {str(key): _plain(item, depth - 1) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, depth - 1) for item in value[:LONGEST_LIST]]
    if value is None or isinstance(value, int) or (isinstance(value, float) and math.isfinite(value)):
        return value
    text = NOT_FINITE.get(repr(value), str(value))
    return text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 1] + "…"
