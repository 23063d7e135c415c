"""Every operation of the client, as a script: what is asked, and what the answer means."""

from __future__ import annotations

import dataclasses
import json
import uuid
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from .errors import ConnectionFailed, JobFailed, MillpondError, TimedOut, Unavailable
from .exchange import Call, Policy, Reply, Script, Sleep, ask
from .shapes import ACTIVE, ENDED, FrameFacts, ImageFacts, JobFacts
from .uploads import ImageSource, file_bytes, form

Observer = Callable[[JobFacts], None]
"""Is shown a job each time that its state is known anew."""

READY_SECONDS = 5.0
"""How long one question whether the service is ready may take."""
_FIRST_PAUSE, _LONGEST_PAUSE, _PAUSE_GROWTH = 0.1, 1.0, 1.4
"""Seconds between two looks at a job, and their ratio."""


class UnknownJobState(UserWarning):
    """The service named a state that this client does not know; it goes on waiting."""


def frame(policy: Policy, request: Mapping[str, Any] | None, fields: Mapping[str, Any]) -> Script[Reply]:
    """A frame; ``fields`` are laid over ``request``."""
    return (yield from ask(_post("/v1/frame", {**(request or {}), **fields}), policy))


def turntable(
    policy: Policy,
    request: Mapping[str, Any] | None,
    settings: Mapping[str, Any],
    product: str,
    to: Path | None,
) -> Script[Reply]:
    """A whole turntable in one answer."""
    body = {"frame": request or {}, "turntable": _given(settings), "format": product}
    return (yield from ask(_post("/v1/turntable", body, to=to), policy))


def submit(policy: Policy, job: Mapping[str, Any], idempotency_key: str | None = None) -> Script[JobFacts]:
    """A new job. One key for all tries, so that a lost answer does not make a second job."""
    headers = {"Idempotency-Key": idempotency_key or uuid.uuid4().hex}
    return _job((yield from ask(_post("/v1/jobs", job, headers=headers), policy)))


def turntable_body(
    request: Mapping[str, Any] | None, settings: Mapping[str, Any], outputs: Sequence[str], more: Mapping[str, Any]
) -> dict[str, Any]:
    """The job of a turntable."""
    return {
        "kind": "turntable",
        "frame": request or {},
        "turntable": _given(settings),
        "outputs": list(outputs),
        **_given(more),
    }


def job(policy: Policy, job_id: str) -> Script[JobFacts]:
    """A job as it stands."""
    return _job((yield from ask(Call("GET", _path(job_id)), policy)))


def cancel(policy: Policy, job_id: str) -> Script[JobFacts]:
    """End a job; what is drawn stays."""
    return _job((yield from ask(Call("POST", f"{_path(job_id)}/cancel"), policy)))


def wait(policy: Policy, job_id: str, seconds: float, show: Observer) -> Script[JobFacts]:
    """Look at a job until it has succeeded. Raises JobFailed where it ends otherwise, and TimedOut."""
    deadline = policy.clock() + seconds
    pause = _FIRST_PAUSE
    unknown: set[str] = set()
    while True:
        left = max(0.0, deadline - policy.clock())
        facts = yield from job(dataclasses.replace(policy, timeout=min(policy.timeout, left)), job_id)
        show(facts)
        state = facts["state"]
        if state == "succeeded":
            return facts
        if state in ENDED:
            raise JobFailed(facts)
        if state not in ACTIVE | unknown:
            unknown.add(state)
            warnings.warn(f"job {job_id} is in the unknown state {state!r}; waiting on", UnknownJobState, stacklevel=2)
        if policy.clock() + pause > deadline:
            counts = facts["counts"]
            done = f"{counts['done']} of {counts['total']} frames are done"
            raise TimedOut(f"job {job_id} did not end within {seconds:g} s: {state}, {done}")
        yield Sleep(pause)
        pause = min(_LONGEST_PAUSE, pause * _PAUSE_GROWTH)


def frames(policy: Policy, job_id: str) -> Script[list[FrameFacts]]:
    """What is known of each frame of a job, over all pages."""
    found: list[FrameFacts] = []
    query: dict[str, str] = {"limit": "1000"}
    while True:
        page = (yield from ask(Call("GET", f"{_path(job_id)}/frames", query), policy)).json()
        found.extend(page["frames"])
        if not page.get("next"):
            return found
        query = {**query, "cursor": str(page["next"])}


def frame_name(index: int, suffix: str) -> str:
    """The file, among a job's, of one frame."""
    return f"frames/{int(index)}.{quote(suffix, safe='')}"


def job_file(policy: Policy, job_id: str, name: str, to: Path | None = None) -> Script[Reply]:
    """A file of a job: ``frames/7.png``, ``result.mp4``, ``contact-sheet.png``."""
    return (yield from ask(Call("GET", f"{_path(job_id)}/{name}", to=to), policy))


def upload_image(policy: Policy, source: ImageSource, kind: str) -> Script[ImageFacts]:
    """Keep an image at the service; repeating it changes nothing."""
    content_type, body = form({"kind": kind}, file_bytes(source))
    call = Call("POST", "/v1/images", body=body, headers={"Content-Type": content_type})
    found: ImageFacts = (yield from ask(call, policy)).json()
    return found


def info(policy: Policy) -> Script[dict[str, Any]]:
    """Versions, driver, workers and caps of the service."""
    found = (yield from ask(Call("GET", "/v1/info"), policy)).json()
    return dict(found)


def ready(policy: Policy) -> Script[bool]:
    """Whether every worker has drawn its canary frame. Not being reachable is not being ready."""
    once = dataclasses.replace(policy, timeout=min(policy.timeout, READY_SECONDS), retries=0)
    try:
        yield from ask(Call("GET", "/readyz"), once)
    except (Unavailable, ConnectionFailed, TimedOut):
        return False
    return True


def wait_ready(policy: Policy, seconds: float) -> Script[None]:
    """Return once the service is ready; raises TimedOut that says why it is not."""
    deadline = policy.clock() + seconds
    pause = _FIRST_PAUSE
    once = dataclasses.replace(policy, timeout=READY_SECONDS, retries=0)
    while True:
        try:
            yield from ask(Call("GET", "/readyz"), once)
        except (Unavailable, ConnectionFailed, TimedOut) as error:
            if policy.clock() + pause > deadline:
                raise TimedOut(f"the service was not ready within {seconds:g} s: {error}") from error
        else:
            return
        yield Sleep(pause)
        pause = min(_LONGEST_PAUSE, pause * _PAUSE_GROWTH)


def _post(path: str, body: Any, *, headers: Mapping[str, str] | None = None, to: Path | None = None) -> Call:
    # NaN and infinities go as they are: the service refuses them by the field's path, as it does all else.
    content = json.dumps(plain(body), separators=(",", ":")).encode()
    return Call("POST", path, body=content, headers={"Content-Type": "application/json", **(headers or {})}, to=to)


def plain(value: Any) -> Any:
    """The value as JSON has it: NumPy arrays and tuples as lists, NumPy numbers as numbers.

    Raises TypeError for what JSON cannot hold.
    """
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def _given(settings: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in settings.items() if value is not None}


def _path(job_id: str) -> str:
    return f"/v1/jobs/{quote(job_id, safe='')}"


def _job(reply: Reply) -> JobFacts:
    facts = reply.json()
    if not isinstance(facts, dict) or "id" not in facts or "state" not in facts:
        raise MillpondError("the answer describes no job: is this a Millpond service?")
    counts = {"total": 0, "done": 0, "failed": 0, "pending": 0, "leased": 0, **facts.get("counts", {})}
    known: JobFacts = {
        "kind": "",
        "frames_per_second": None,
        "eta_seconds": None,
        "created": "",
        "started": None,
        "finished": None,
        "links": {},
        "error": None,
        **facts,
        "counts": counts,
    }  # type: ignore[typeddict-item]  # what the service adds later passes through
    return known
