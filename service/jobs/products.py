"""A job's products: made of its frames when they are first asked for, and kept as artifacts."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from renderer.encode.image import encoder_versions
from renderer.errors import MillpondError
from renderer.request import FrameRequest
from service.artifacts import Artifact
from service.engines.base import Lane
from service.errors import ArtifactMissing, FrameUnfinished, JobUnfinished, ProductIncomplete, UnknownProduct
from service.frames import FrameCache, StoredFrame
from service.jobs.assembly import Member, manifest_of, sheet_of, write_movie, write_zip
from service.jobs.job import ENDED, FrameRecord, FrameState, Job
from service.jobs.store import JobStore
from service.jobs.view import PRODUCTS
from service.worker import FrameReport

_FORM = 1
"""Counts changes in how products are made, so that older ones are not served for newer."""
_REDRAW_SECONDS = 600.0
"""How long a frame that was lost from the store may take to be drawn again."""


@dataclass(frozen=True)
class Product:
    """A product's file."""

    path: Path
    digest: str
    """SHA-256, hex."""
    size: int
    """Bytes."""
    media_type: str
    filename: str

    @property
    def etag(self) -> str:
        """Its strong entity tag, in its quotes."""
        return f'"{self.digest}"'


class Products:
    """Makes each product once at a time; thread-safe, and slow where something has to be made."""

    def __init__(self, store: JobStore, cache: FrameCache) -> None:
        self._store = store
        self._cache = cache
        self._lock = threading.Lock()
        self._making: dict[str, threading.Lock] = {}

    def frame(self, record: FrameRecord) -> StoredFrame:
        """A job's frame, verified; drawn again if its artifact was lost.

        Raises ``FrameUnfinished``, ``ArtifactMissing`` where it can't be drawn again as it was.
        """
        if record.state is not FrameState.DONE or record.fingerprint is None:
            raise FrameUnfinished(record.job_id, record.index, record.state.value)
        request = FrameRequest.parse(json.loads(record.request))
        try:
            return self._cache.read(request, record.key, record.fingerprint)
        except ArtifactMissing:
            if request.key() != record.key or self._cache.fingerprint != record.fingerprint:
                raise
        drawn = self._cache.draw(request, Lane.INTERACTIVE)
        if not isinstance(drawn, FrameReport):
            try:
                drawn.future.result(_REDRAW_SECONDS)
            finally:
                drawn.leave()
        return self._cache.read(request, record.key, record.fingerprint)

    def product(self, job_id: str, name: str) -> Product:
        """A product of a job whose frames are all done.

        Raises ``UnknownProduct``, ``JobUnfinished``, ``ProductIncomplete``.
        """
        if name not in PRODUCTS:
            raise UnknownProduct(name, tuple(PRODUCTS))
        job, counts, _ = self._store.job(job_id)
        records = self._store.frames(job_id)
        missing = [record.index for record in records if record.state is not FrameState.DONE]
        if missing and job.state not in ENDED:
            raise JobUnfinished(job_id, job.state.value, counts.as_dict())
        if missing:
            raise ProductIncomplete(job_id, name, missing, f"the job is {job.state.value}")
        key = _key(job, records, name)
        with self._alone(key):
            artifact = self._cache.artifacts.verified(key) or self._make(job, records, name, key)
        filename = f"millpond-{job_id}-{name}"
        return Product(artifact.path, artifact.digest, artifact.size, PRODUCTS[name], filename)

    def _make(self, job: Job, records: list[FrameRecord], name: str, key: str) -> Artifact:
        members = [
            Member(
                record.index,
                FrameRequest.parse(json.loads(record.request)),
                record.key,
                record.digest or "",
                record.fingerprint or "",
            )
            for record in records
        ]

        def read(member: Member) -> bytes:
            try:
                stored = self.frame(records[member.index])
            except (MillpondError, TimeoutError, CancelledError) as error:
                raise ProductIncomplete(job.id, name, [member.index], str(error)) from error
            if stored.digest != member.digest:
                raise ProductIncomplete(job.id, name, [member.index], "drawn again with other bytes")
            return stored.data

        with self._cache.artifacts.writing(key) as path:
            _MAKERS[name](path, job, members, read)
        artifact = self._cache.artifacts.find(key)
        if artifact is None:
            raise ArtifactMissing(key)
        return artifact

    def _alone(self, key: str) -> ExitStack:
        """Hold the one right to make this product."""
        with self._lock:
            lock = self._making.setdefault(key, threading.Lock())
        stack = ExitStack()
        stack.enter_context(lock)
        stack.callback(self._making.pop, key, None)
        return stack


Read = Callable[[Member], bytes]
Maker = Callable[[Path, Job, list[Member], Read], object]


def _zip(path: Path, job: Job, members: list[Member], read: Read) -> None:
    write_zip(path, members, read, _manifest_bytes(job, members))


def _movie(path: Path, job: Job, members: list[Member], read: Read) -> None:
    size = {"width": members[0].request.width, "height": members[0].request.height}
    fps = job.spec["turntable"]["fps"]
    write_movie(path, map(read, members), **size, fps=fps, count=len(members))


def _sheet(path: Path, _: Job, members: list[Member], read: Read) -> None:
    path.write_bytes(sheet_of(members, read))


def _manifest(path: Path, job: Job, members: list[Member], _: Read) -> None:
    path.write_bytes(_manifest_bytes(job, members))


def _manifest_bytes(job: Job, members: list[Member]) -> bytes:
    """Of the spec only what made the frames: equal frames, equal manifests."""
    made: dict[str, Any] = {name: job.spec[name] for name in ("kind", "frame", "turntable")}
    return manifest_of(made, members)


_MAKERS: dict[str, Maker] = {
    "result.zip": _zip,
    "result.mp4": _movie,
    "contact-sheet.png": _sheet,
    "manifest.json": _manifest,
}


def _key(job: Job, records: list[FrameRecord], name: str) -> str:
    """The product's name as an artifact: what it is, of which frames, written by what."""
    parts = {
        "form": _FORM,
        "product": name,
        "made": {kind: job.spec[kind] for kind in ("kind", "frame", "turntable")},
        "frames": [(record.key, record.digest) for record in records],
        "encoders": encoder_versions(),
    }
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
