"""The client's protocol without input or output: calls, answers, and when to try again.

An operation is a generator, a ``Script``. It yields what is to be done (``Send`` a call, ``Sleep``), is sent the
``Reply``, and returns its result; the failure of a step is thrown into it. Two small drivers, one blocking and one
for asyncio, carry scripts out, so that nothing of the protocol is written twice.
"""

from __future__ import annotations

import email.utils
import http
import json
import random
import time
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from .errors import PROBLEMS, ConnectionFailed, FieldError, Problem, TimedOut

T = TypeVar("T")

LONGEST_PAUSE = 120.0
"""Seconds: a service that asks for more is given up at once."""
_FIRST_BACKOFF, _LONGEST_BACKOFF = 0.25, 8.0
"""Seconds."""
_RETRIED = frozenset({429, 503})
_LONGEST_DETAIL = 500
"""Characters that are kept of an error page which is no problem+json."""


@dataclass(frozen=True)
class Call:
    """One HTTP request."""

    method: str
    path: str
    query: Mapping[str, str] = field(default_factory=dict)
    body: bytes | None = None
    """JSON, or a form."""
    headers: Mapping[str, str] = field(default_factory=dict)
    to: Path | None = None
    """The file that a successful answer's body goes to, instead of memory."""

    def __str__(self) -> str:
        return f"{self.method} {self.path}"


@dataclass(frozen=True)
class Reply:
    """One HTTP answer, complete."""

    status: int
    headers: Mapping[str, str]
    """Names in lower case."""
    body: bytes = b""

    def json(self) -> Any:
        """The body's value. Raises ConnectionFailed where it is no JSON: something else answered."""
        try:
            return json.loads(self.body)
        except ValueError as error:
            raise ConnectionFailed(f"the answer is not JSON ({error}): is this a Millpond service?") from error


@dataclass(frozen=True)
class Send:
    """To be done: the call, within ``seconds``."""

    call: Call
    seconds: float


@dataclass(frozen=True)
class Sleep:
    """To be done: nothing, for ``seconds``."""

    seconds: float


Script = Generator[Send | Sleep, Reply | None, T]
"""An operation: yields steps, is sent replies (None after a ``Sleep``), returns its result."""


@dataclass(frozen=True)
class Policy:
    """How long to try, and how often."""

    timeout: float = 120.0
    """Seconds for a whole operation, pauses included."""
    retries: int = 5
    """How often a call is sent again after a failed connection, 429 or 503."""
    clock: Callable[[], float] = time.monotonic
    jitter: Callable[[], float] = random.random
    """A number from 0 to 1, so that clients which failed together do not come back together."""

    def backoff(self, attempt: int) -> float:
        """Seconds before trying again, where the service did not say."""
        return min(_LONGEST_BACKOFF, _FIRST_BACKOFF * 2.0**attempt) * (0.5 + 0.5 * self.jitter())


def ask(call: Call, policy: Policy) -> Script[Reply]:
    """Send a call until it is answered well; only for calls that may be repeated, which all of ours may.

    Raises what the last try failed with: Problem, ConnectionFailed or TimedOut.
    """
    deadline = policy.clock() + policy.timeout
    attempt = 0
    while True:
        left = deadline - policy.clock()
        if left <= 0:
            raise TimedOut(f"{call}: no answer within {policy.timeout:g} s")
        try:
            reply = yield Send(call, left)
            if reply is None:
                raise TypeError("a call was sent, and no reply was given back")
            if http.HTTPStatus(200) <= reply.status < http.HTTPStatus(300):
                return reply
            failure: Problem | ConnectionFailed = problem_of(reply)
        except ConnectionFailed as error:
            failure = error
        pause = _pause(failure, attempt, policy)
        if pause is None or attempt >= policy.retries or policy.clock() + pause >= deadline:
            raise failure
        yield Sleep(pause)
        attempt += 1


def _pause(failure: Problem | ConnectionFailed, attempt: int, policy: Policy) -> float | None:
    """Seconds to wait before trying again, or None where that is no use."""
    if isinstance(failure, ConnectionFailed):
        return policy.backoff(attempt)
    if failure.status not in _RETRIED:
        return None
    if failure.retry_after is None:
        return policy.backoff(attempt)
    return failure.retry_after if failure.retry_after <= LONGEST_PAUSE else None


def problem_of(reply: Reply) -> Problem:
    """The problem that an answer tells of, also where it is no problem+json."""
    try:
        body = json.loads(reply.body)
    except ValueError:
        body = None
    if not isinstance(body, dict):
        text = reply.body[: 4 * _LONGEST_DETAIL].decode("utf-8", "replace").strip()[:_LONGEST_DETAIL]
        where = reply.headers.get("location")
        body = {"detail": f"moved to {where}: use that as the base URL" if where else text}
    kind = PROBLEMS.get(reply.status, Problem)
    return kind(
        reply.status,
        str(body.get("type", "about:blank")),
        str(body.get("title") or _phrase(reply.status)),
        str(body.get("detail") or ""),
        tuple(_field_errors(body.get("errors"))),
        retry_after_of(reply.headers),
        body,
    )


def _field_errors(errors: Any) -> Generator[FieldError, None, None]:
    for entry in errors if isinstance(errors, list) else ():
        if isinstance(entry, dict):
            path, message = str(entry.get("path", "")), str(entry.get("message", ""))
            yield FieldError(path, message, entry.get("value"), entry.get("bound"))


def retry_after_of(headers: Mapping[str, str]) -> float | None:
    """Seconds that a Retry-After header asks for, from a number or a date (RFC 9110, section 10.2.3)."""
    text = headers.get("retry-after", "").strip()
    if text.isdecimal():
        return float(text)
    try:
        date = email.utils.parsedate_to_datetime(text)
    except ValueError:
        return None
    aware = date if date.tzinfo else date.replace(tzinfo=UTC)
    return max(0.0, (aware - datetime.now(UTC)).total_seconds())


def _phrase(status: int) -> str:
    try:
        return http.HTTPStatus(status).phrase
    except ValueError:
        return "Unknown status"
