"""Jobs: submitted, followed, cancelled; their frames and their products."""

from __future__ import annotations

import re
from typing import Any

import anyio.to_thread
from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse

from renderer.errors import FieldProblem
from service.artifacts import artifact_name
from service.frames import StoredFrame
from service.jobs import JobView
from service.jobs.view import PRODUCTS
from service.problems import Problem, invalid
from service.routes import schema
from service.routes.answering import caching, is_known_to, provenance, repr_digest
from service.routes.files import file_answer
from service.routes.parts import parts_of
from service.routes.reading import read_json

NEVER = {"Cache-Control": "no-store"}
MOST_ON_A_PAGE = 1000
SANE_KEY = re.compile(r"[\x21-\x7e]{1,255}\Z")
router = APIRouter(tags=["jobs"])


@router.post(
    "/v1/jobs",
    operation_id="submit_job",
    status_code=202,
    responses={202: schema.answer("The job."), **schema.problems(400, 403, 413, 415, 422, 503)},
    openapi_extra=schema.body("JobRequest", {"kind": "turntable", "frame": schema.EXAMPLE, "outputs": ["mp4"]}),
)
async def submit(request: Request) -> Response:
    """A job, checked as a whole and written down before it is answered.

    The same ``Idempotency-Key`` with the same body is the same job, however often it is sent.
    """
    parts = parts_of(request)
    body = await read_json(request, parts.settings.limits)
    key = request.headers.get("idempotency-key")
    if key is not None and not SANE_KEY.match(key):
        raise invalid(FieldProblem("Idempotency-Key", "not a key", key, "1 to 255 visible ASCII characters"))
    view = await anyio.to_thread.run_sync(parts.jobs.submit, body, key)
    return _shown(view, 202)


@router.get("/v1/jobs", operation_id="jobs", responses=schema.problems(422))
def page(request: Request, state: str | None = None, cursor: str | None = None, limit: str = "50") -> Response:
    """The jobs, newest first, a page at a time; ``state`` keeps those in one state."""
    found = parts_of(request).jobs.page(state=state, cursor=cursor, limit=_limit(limit))
    return JSONResponse({"jobs": [view.as_json() for view in found.jobs], "next": found.next}, headers=NEVER)


@router.get("/v1/jobs/{job_id}", operation_id="job", responses=schema.problems(404, 410))
def job(request: Request, job_id: str) -> Response:
    """A job: its state, counts, speed, ETA and links."""
    return _shown(parts_of(request).jobs.job(job_id), 200)


@router.post("/v1/jobs/{job_id}/cancel", operation_id="cancel_job", responses=schema.problems(404, 409, 410))
def cancel(request: Request, job_id: str) -> Response:
    """Stop a job; what is drawn stays. Cancelling a cancelled job changes nothing."""
    return _shown(parts_of(request).jobs.cancel(job_id), 200)


@router.get("/v1/jobs/{job_id}/frames", operation_id="job_frames", responses=schema.problems(404, 410, 422))
def frames(request: Request, job_id: str, cursor: str | None = None, limit: str = "200") -> Response:
    """What is known of the job's frames, a page at a time."""
    found = parts_of(request).jobs.frames(job_id, cursor=cursor, limit=_limit(limit))
    return JSONResponse(found.as_json(), headers=NEVER)


@router.get(
    "/v1/jobs/{job_id}/frames/{index}.{suffix}",
    operation_id="job_frame",
    response_class=Response,
    responses={200: schema.binary("image/png", "image/jpeg", "image/webp"), **schema.problems(404, 409, 410)},
)
def frame(request: Request, job_id: str, index: str, suffix: str) -> Response:
    """One frame of the job, once it is drawn."""
    parts = parts_of(request)
    number = int(index) if index.isdecimal() and len(index) < 10 else -1
    stored = parts.jobs.frame(job_id, number)
    return _image(request, stored, suffix, caching(parts.settings))


def _image(request: Request, stored: StoredFrame, suffix: str, cached: dict[str, str]) -> Response:
    expected = schema.suffixes_of(stored.media_type)
    if suffix not in expected:
        raise Problem("not-found", f"The job's frames are written .{' or .'.join(expected)}, not .{suffix}.")
    etag = f'"{artifact_name(stored.key, stored.fingerprint)}"'
    headers = {"ETag": etag, "X-Frame-Key": stored.key, "X-Fingerprint": stored.fingerprint, **cached}
    if is_known_to(request.headers.get("if-none-match", ""), etag):
        return Response(status_code=304, headers=headers)
    return Response(stored.data, headers={**headers, **provenance(stored)}, media_type=stored.media_type)


@router.get(
    "/v1/jobs/{job_id}/{product}",
    operation_id="job_product",
    response_class=Response,
    responses={
        200: schema.binary(*PRODUCTS.values()),
        206: schema.binary(*PRODUCTS.values()),
        **schema.problems(404, 409, 410, 416),
    },
)
async def product(request: Request, job_id: str, product: str) -> Response:
    """A product, verified against the job's frames: whole, or by one Range.

    ``result.zip``, ``result.mp4``, ``contact-sheet.png`` or ``manifest.json``.
    """
    parts = parts_of(request)
    made = await anyio.to_thread.run_sync(parts.jobs.product, job_id, product)
    headers = {
        **caching(parts.settings),
        "Repr-Digest": repr_digest(made.digest),
        "Content-Disposition": f'inline; filename="{made.filename}"',
    }
    return await file_answer(request, made.path, made.media_type, made.etag, headers)


def _shown(view: JobView, status: int) -> Response:
    facts: dict[str, Any] = view.as_json()
    headers = {**NEVER, "Location": f"/v1/jobs/{facts['id']}"} if status == 202 else NEVER
    return JSONResponse(facts, status, headers)


def _limit(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= MOST_ON_A_PAGE:
        raise invalid(FieldProblem("limit", "how many entries a page has", text, f"1 to {MOST_ON_A_PAGE}"))
    return int(text)
