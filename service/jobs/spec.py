"""What a caller submits as a job: checked as a whole, then expanded into frames."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic import Field, ValidationError

from renderer.blocks import Declaration
from renderer.errors import InvalidRequest
from renderer.request import FrameRequest, invalid
from service.jobs.store import Submission
from service.settings import Limits
from service.turntables import plan_turntable

Output = Literal["zip", "mp4"]


class JobForm(Declaration):
    """The fields of a job besides what it draws."""

    kind: Literal["turntable"]
    """What the frames are made from."""
    frame: Any = Field(default_factory=dict)
    """The first frame's request."""
    turntable: Any = Field(default_factory=dict)
    """How the camera is carried round."""
    outputs: tuple[Output, ...] = Field((), max_length=8, strict=False)
    """Products that are made as soon as all frames are drawn; others are made when they are asked for."""
    priority: int = Field(0, ge=-100, le=100)
    """Higher ones are drawn first."""
    order: Literal["sequential", "coarse_to_fine"] = "sequential"
    """The order of drawing; coarse to fine shows the whole early."""
    webhook: None = None
    """Reserved."""


def submission(
    body: Mapping[str, Any], limits: Limits | None, max_frames: int | None, idempotency_key: str | None
) -> Submission:
    """The job that a JSON object asks for. Raises ``InvalidRequest`` with every mistake of it."""
    problems = []
    form = None
    try:
        form = JobForm.model_validate(body)
    except ValidationError as error:
        problems += list(invalid(error).problems)
    try:
        plan = plan_turntable(body.get("frame", {}), body.get("turntable", {}), limits, max_frames)
    except InvalidRequest as error:
        raise InvalidRequest((*problems, *error.problems)) from None
    if form is None:
        raise InvalidRequest(tuple(problems))
    spec = {
        "kind": form.kind,
        "frame": json.loads(plan.frame.canonical()),
        "turntable": plan.turntable.model_dump(mode="json"),
        "outputs": list(form.outputs),
        "priority": form.priority,
        "order": form.order,
        "webhook": None,
    }
    return Submission(
        kind=form.kind,
        spec=spec,
        frames=[_identity(request) for request in plan.requests],
        body_digest=hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest(),
        priority=form.priority,
        order=coarse_to_fine(len(plan.requests)) if form.order == "coarse_to_fine" else None,
        idempotency_key=idempotency_key,
    )


def coarse_to_fine(count: int) -> Sequence[int]:
    """Every index once: first ones far apart, then those halfway between, and so on."""
    bits = max(1, (count - 1).bit_length())
    backwards = (int(f"{place:0{bits}b}"[::-1], 2) for place in range(1 << bits))
    return [index for index in backwards if index < count]


def _identity(request: FrameRequest) -> tuple[str, bytes]:
    return request.key(), request.canonical()
