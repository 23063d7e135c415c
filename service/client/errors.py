"""What can go wrong between a program and a Millpond service.

    MillpondError
    ├── ConnectionFailed        nobody answered, or the answer broke off
    │   └── Damaged             the bytes that came are not those that were sent
    ├── TimedOut                no answer, or no end of a job, within the time allowed
    ├── JobFailed               a job ended without its product: failed, cancelled or expired
    └── Problem                 the service refused: status, type, title, detail, errors
        ├── InvalidRequest      422: a field is unknown, of the wrong type or out of its bounds
        ├── Unauthorized        401: the API key is missing or unknown
        ├── Forbidden           403: this may not be done from here
        ├── NotFound            404: there is no such thing
        ├── Conflict            409: not in this state, for instance a job's movie before its last frame
        ├── Gone                410: the job has expired
        ├── TooManyRequests     429: this caller's share is used up
        └── Unavailable         503: the service is starting, stopping, or has too much to do

Connections that fail, 429 and 503 have already been tried again when they reach a program.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


class MillpondError(Exception):
    """Something went wrong between the program and the service."""

    def __init__(self, *facts: Any) -> None:
        super().__init__(*(facts or ((type(self).__doc__ or "").splitlines()[0],)))


class ConnectionFailed(MillpondError):
    """The service could not be reached, or its answer broke off."""


class Damaged(ConnectionFailed):
    """The bytes that came do not match the digest that the service gave for them."""


class TimedOut(MillpondError):
    """There was no end within the time allowed."""


class JobFailed(MillpondError):
    """A job ended without its product."""

    def __init__(self, job: Mapping[str, Any]) -> None:
        super().__init__(job)
        self.job = job
        """The job as the service described it last; ``error`` and ``counts`` tell what happened."""

    def __str__(self) -> str:
        error = self.job.get("error") or {}
        counts = self.job.get("counts") or {}
        done = f"{counts.get('done', 0)} of {counts.get('total', '?')} frames are done"
        reason = error.get("detail") or error.get("title") or error.get("kind")
        return f"job {self.job.get('id')} {self.job.get('state')}: " + (f"{reason} ({done})" if reason else done)


@dataclass(frozen=True)
class FieldError:
    """One mistake in a request."""

    path: str
    """The field as the caller wrote it: ``water.refraction_bias``."""
    message: str
    value: Any = None
    bound: Any = None
    """What would be right, where the service says so."""

    def __str__(self) -> str:
        bound = "" if self.bound is None else f" (allowed: {self.bound})"
        return f"{self.path or 'request'}: {self.message}{bound}"


class Problem(MillpondError):
    """The service refused, and said why (RFC 9457)."""

    def __init__(  # noqa: PLR0917 -- by position, for pickle
        self,
        status: int,
        type: str = "about:blank",  # noqa: A002 -- the name that RFC 9457 gives it
        title: str = "",
        detail: str = "",
        errors: tuple[FieldError, ...] = (),
        retry_after: float | None = None,
        body: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__(status, type, title, detail, errors, retry_after, body)
        self.status = status
        """HTTP status."""
        self.type = type
        """Path of the page, on the service, that explains this kind of problem."""
        self.title = title
        self.detail = detail
        self.errors = errors
        """Every mistake of the request, for 422."""
        self.retry_after = retry_after
        """Seconds after which the service asked to be tried again, if it did."""
        self.body = dict(body or {})
        """The whole answer, with what else it tells (``request_id``, a job's progress, ...)."""

    def __str__(self) -> str:
        told = "; ".join(map(str, self.errors)) or self.detail
        return f"{self.status} {self.title}" + (f": {told}" if told else "")


class InvalidRequest(Problem):
    """A field of the request is unknown, of the wrong type or out of its bounds (422)."""


class Unauthorized(Problem):
    """The API key is missing or unknown (401)."""


class Forbidden(Problem):
    """This may not be done from here (403)."""


class NotFound(Problem):
    """There is no such thing (404)."""


class Conflict(Problem):
    """The job's state does not allow that, now or ever (409)."""


class Gone(Problem):
    """The job has expired (410)."""


class TooManyRequests(Problem):
    """This caller's share is used up (429)."""


class Unavailable(Problem):
    """The service is starting, stopping, or has too much to do (503)."""


PROBLEMS: Mapping[int, type[Problem]] = {
    401: Unauthorized,
    403: Forbidden,
    404: NotFound,
    409: Conflict,
    410: Gone,
    422: InvalidRequest,
    429: TooManyRequests,
    503: Unavailable,
}
"""The class of each status that has one of its own."""
