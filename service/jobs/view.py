"""Jobs and frames as the API shows them."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from renderer.encode.image import FORMATS
from service.errors import BadCursor
from service.jobs.job import ENDED, Counts, FrameRecord, FrameState, Job, JobState
from service.jobs.store import Pace

PRODUCTS: Mapping[str, str] = {
    "result.zip": "application/zip",
    "result.mp4": "video/mp4",
    "contact-sheet.png": "image/png",
    "manifest.json": "application/json",
}
"""What can be made of a job's frames, with its media type."""


@dataclass(frozen=True)
class JobView:
    """A job, how far it is, and how fast."""

    job: Job
    counts: Counts
    pace: Pace

    @property
    def frames_per_second(self) -> float | None:
        """Of the whole job once it has ended; until then of its latest frames; None where nothing can be said."""
        job = self.job
        if job.state in ENDED and job.started is not None and job.finished is not None and self.counts.done:
            return self.counts.done / max(1e-3, job.finished - job.started)
        return self.pace.frames / self.pace.seconds if self.pace.seconds > 0 else None

    @property
    def eta_seconds(self) -> float | None:
        """Seconds until its last frame, at the present pace; None where nothing is being drawn."""
        rate = self.frames_per_second
        if self.job.state is not JobState.RUNNING or not rate:
            return None
        return (self.counts.pending + self.counts.leased) / rate

    def as_json(self) -> dict[str, Any]:
        """The job as the API gives it; links are paths."""
        job, rate, eta = self.job, self.frames_per_second, self.eta_seconds
        return {
            "id": job.id,
            "kind": job.kind,
            "state": job.state.value,
            "counts": self.counts.as_dict(),
            "frames_per_second": None if rate is None else round(rate, 3),
            "eta_seconds": None if eta is None else round(eta, 1),
            "created": _moment(job.created),
            "started": _moment(job.started),
            "finished": _moment(job.finished),
            "links": links(job),
            "error": None if job.error is None else _problem(job.error),
        }


@dataclass(frozen=True)
class JobPage:
    """Some jobs, the newest first."""

    jobs: tuple[JobView, ...]
    next: str | None


@dataclass(frozen=True)
class FramePage:
    """Some of a job's frames, by index."""

    frames: tuple[FrameRecord, ...]
    next: str | None

    def as_json(self) -> dict[str, Any]:
        """The frames as the API gives them."""
        return {"frames": [_frame(frame) for frame in self.frames], "next": self.next}


def links(job: Job) -> dict[str, str]:
    """Paths of what belongs to a job."""
    path = f"/v1/jobs/{job.id}"
    verbs = ("cancel",)
    return {
        "self": path,
        "frames": f"{path}/frames",
        **{name: f"{path}/{name}" for name in PRODUCTS},
        **{verb: f"{path}/{verb}" for verb in verbs},
    }


def suffix_of(request: bytes) -> str:
    """How the file of a canonical request is named."""
    return FORMATS[json.loads(request)["format"]].suffixes[0]


def to_cursor(*parts: str | float) -> str:
    """An opaque place in a list."""
    return base64.urlsafe_b64encode(json.dumps(parts).encode()).decode().rstrip("=")


def from_cursor(cursor: str, *kinds: type) -> list[Any]:
    """What ``to_cursor`` was given, of these types. Raises ``BadCursor``."""
    try:
        parts: Any = json.loads(base64.urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)))
    except (binascii.Error, ValueError) as error:
        raise BadCursor from error
    is_ours = isinstance(parts, list) and len(parts) == len(kinds)
    if not is_ours or any(type(part) is not kind for part, kind in zip(parts, kinds, strict=True)):
        raise BadCursor
    return list(parts)


def _frame(frame: FrameRecord) -> dict[str, Any]:
    is_done = frame.state is FrameState.DONE
    shown = {
        "index": frame.index,
        "state": frame.state.value,
        "key": frame.key,
        "digest": frame.digest if is_done else None,
        "url": f"/v1/jobs/{frame.job_id}/frames/{frame.index}.{suffix_of(frame.request)}" if is_done else None,
    }
    return shown if frame.error is None else {**shown, "error": _problem(frame.error)}


def _problem(error: Mapping[str, Any]) -> dict[str, Any]:
    facts = {name: value for name, value in error.items() if name not in {"kind", "detail"}}
    kind = error.get("kind", "internal-error")
    title = str(kind).replace("-", " ").capitalize()
    return {"type": f"/problems/{kind}", "title": title, "detail": error.get("detail", ""), **facts}


def _moment(seconds: float | None) -> str | None:
    """RFC 3339, UTC."""
    if seconds is None:
        return None
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
