"""A job: requests with a state. Values and the one transition table; nothing here is stored or drawn.

What a job can do:

    queued ──start──▶ running ──succeed──▶ succeeded ──┐
      ▲  │              │  └────fail────▶ failed ──────┤
      │  pause        pause                            ├─expire──▶ expired
      │  ▼              ▼                              │
      └─resume──────── paused ──cancel──▶ cancelled ───┘

``queued``, ``running`` and ``paused`` can be cancelled; a ``failed`` or ``cancelled`` job can be retried, which queues
it again with what is not done. A paused job's frames that are being drawn may still be its last.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from service.errors import TransitionRefused


class JobState(StrEnum):
    """Where a job stands. The list is closed."""

    QUEUED = "queued"
    """Accepted; none of its frames has been begun since."""
    RUNNING = "running"
    """Its frames are being drawn. A restart of the service leaves it so."""
    PAUSED = "paused"
    """No new frame of it is begun."""
    SUCCEEDED = "succeeded"
    """Every frame is done, by key and checksum."""
    FAILED = "failed"
    """Every frame is done or failed, and at least one failed."""
    CANCELLED = "cancelled"
    """Somebody ended it; what is done stays."""
    EXPIRED = "expired"
    """Its frames have been forgotten. Nothing follows."""


class FrameState(StrEnum):
    """Where a job's frame stands. The list is closed."""

    PENDING = "pending"
    LEASED = "leased"
    """A dispatcher has it, until its lease ends."""
    DONE = "done"
    """Its artifact is stored; nothing takes it back."""
    FAILED = "failed"


class Action(StrEnum):
    """What can happen to a job."""

    START = "start"
    PAUSE = "pause"
    RESUME = "resume"
    SUCCEED = "succeed"
    FAIL = "fail"
    CANCEL = "cancel"
    RETRY = "retry"
    EXPIRE = "expire"


TRANSITIONS: Mapping[Action, Mapping[JobState, JobState]] = {
    Action.START: {JobState.QUEUED: JobState.RUNNING},
    Action.PAUSE: {JobState.QUEUED: JobState.PAUSED, JobState.RUNNING: JobState.PAUSED},
    Action.RESUME: {JobState.PAUSED: JobState.QUEUED},
    Action.SUCCEED: {JobState.RUNNING: JobState.SUCCEEDED, JobState.PAUSED: JobState.SUCCEEDED},
    Action.FAIL: {JobState.RUNNING: JobState.FAILED, JobState.PAUSED: JobState.FAILED},
    Action.CANCEL: {
        JobState.QUEUED: JobState.CANCELLED,
        JobState.RUNNING: JobState.CANCELLED,
        JobState.PAUSED: JobState.CANCELLED,
    },
    Action.RETRY: {JobState.FAILED: JobState.QUEUED, JobState.CANCELLED: JobState.QUEUED},
    Action.EXPIRE: {
        JobState.SUCCEEDED: JobState.EXPIRED,
        JobState.FAILED: JobState.EXPIRED,
        JobState.CANCELLED: JobState.EXPIRED,
    },
}
"""From an action to the states that it leaves and reaches. What is not here can't happen."""

ENDED = frozenset({JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELLED, JobState.EXPIRED})
"""States in which nothing is drawn for the job."""
IDEMPOTENT: Mapping[Action, frozenset[JobState]] = {
    Action.PAUSE: frozenset({JobState.PAUSED}),
    Action.RESUME: frozenset({JobState.QUEUED, JobState.RUNNING}),
    Action.CANCEL: frozenset({JobState.CANCELLED}),
    Action.RETRY: frozenset({JobState.QUEUED, JobState.RUNNING}),
}
"""States in which asking for the action once more changes nothing and is no mistake."""


def after(state: JobState, action: Action, job_id: str = "") -> JobState:
    """The state that the action leads to. Raises ``TransitionRefused``."""
    reached = TRANSITIONS[action].get(state)
    if reached is not None:
        return reached
    if state in IDEMPOTENT.get(action, ()):
        return state
    raise TransitionRefused(action.value, state.value, job_id)


@dataclass(frozen=True)
class Job:
    """A job as it stands in the store; times are seconds since 1970, UTC."""

    id: str
    kind: str
    state: JobState
    spec: Mapping[str, Any]
    """What was submitted, checked and complete."""
    total: int
    """How many frames it has."""
    priority: int
    """Higher ones are drawn first."""
    created: float
    started: float | None = None
    finished: float | None = None
    error: Mapping[str, Any] | None = None
    """Why it failed: ``kind``, ``detail`` and the ``frames`` that did."""


@dataclass(frozen=True)
class Counts:
    """How many of a job's frames are in which state."""

    total: int
    done: int = 0
    failed: int = 0
    pending: int = 0
    leased: int = 0

    def as_dict(self) -> dict[str, int]:
        """The counts by name, as the API gives them."""
        return {
            "total": self.total,
            "done": self.done,
            "failed": self.failed,
            "pending": self.pending,
            "leased": self.leased,
        }


@dataclass(frozen=True)
class FrameRecord:
    """A job's frame as it stands in the store."""

    job_id: str
    index: int
    state: FrameState
    key: str
    request: bytes = field(repr=False)
    """The canonical request."""
    attempts: int = 0
    """How often it was begun and failed by its own fault."""
    digest: str | None = None
    """SHA-256 of its artifact, hex."""
    size: int | None = None
    fingerprint: str | None = None
    error: Mapping[str, Any] | None = None
    """Why it failed: ``kind`` and ``detail``."""


@dataclass(frozen=True)
class Lease:
    """The right to report on a frame, until somebody else holds it."""

    job_id: str
    index: int
    fence: int
    """Grows with every lease of the frame; a report with an older one changes nothing."""
    key: str
    request: bytes = field(repr=False)
    attempts: int = 0


@dataclass(frozen=True)
class Done:
    """A report: the frame is drawn and stored."""

    lease: Lease
    key: str
    digest: str
    size: int
    fingerprint: str


@dataclass(frozen=True)
class Failed:
    """A report: the frame failed by its own fault. It is tried again while ``may_retry``."""

    lease: Lease
    kind: str
    detail: str
    may_retry: bool


@dataclass(frozen=True)
class Released:
    """A report: the frame was not begun, or not by its fault ended; it is pending again."""

    lease: Lease


Report = Done | Failed | Released
