"""A turntable that is asked for: checked as a whole, before anything is drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from renderer.errors import FieldProblem, InvalidRequest
from renderer.request import FrameRequest, invalid
from renderer.trajectory import Turntable
from service.asking import frame_request, within
from service.settings import Limits


@dataclass(frozen=True)
class TurntablePlan:
    """A frame carried round, and all the frames that this makes."""

    frame: FrameRequest
    turntable: Turntable
    requests: tuple[FrameRequest, ...]

    @classmethod
    def of(cls, frame: FrameRequest, turntable: Turntable) -> TurntablePlan:
        """The plan of a frame and its turntable."""
        return cls(frame, turntable, tuple(frame.along(turntable)))


def plan_turntable(
    frame: Any, turntable: Any, limits: Limits | None, max_frames: int | None, preferred: str | None = None
) -> TurntablePlan:
    """The plan of two JSON objects.

    Raises ``InvalidRequest`` with every mistake of both, paths from the body that holds them as ``frame`` and
    ``turntable``.
    """
    problems: tuple[FieldProblem, ...] = ()
    start, turn = None, None
    try:
        start = frame_request(_object(frame), limits, preferred=preferred)
    except InvalidRequest as error:
        problems += within("frame", error.problems)
    try:
        turn = Turntable.model_validate(turntable)
    except ValidationError as error:
        problems += invalid(error, "turntable").problems
    if turn is not None and max_frames is not None and turn.frames > max_frames:
        message = f"at most {max_frames} frames are drawn here"
        problems += (FieldProblem("turntable.frames", message, turn.frames, f"<= {max_frames}"),)
    if problems or start is None or turn is None:
        raise InvalidRequest(problems)
    return TurntablePlan.of(start, turn)


def _object(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise InvalidRequest((FieldProblem("", "must be an object", value, "an object"),))
    return value
