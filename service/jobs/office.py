"""Jobs as routes and commands use them: submit, look, fetch, cancel."""

from __future__ import annotations

import fcntl
import logging
import os
import secrets
import threading
from collections.abc import Mapping
from pathlib import Path
from queue import SimpleQueue
from time import monotonic, sleep
from typing import IO, Any

from renderer.errors import FieldProblem, InvalidRequest, MillpondError
from service.artifacts import LocalArtifacts
from service.errors import StoreBusy
from service.frames import FrameCache, StoredFrame
from service.jobs.dispatcher import Dispatcher
from service.jobs.job import Action, JobState
from service.jobs.products import Product, Products
from service.jobs.spec import submission
from service.jobs.store import JobStore
from service.jobs.view import FramePage, JobPage, JobView, from_cursor, to_cursor
from service.settings import Limits

log = logging.getLogger(__name__)

_TAKEOVER_SECONDS = 15.0
"""How long a start waits for an earlier process, which is stopping, to let go of the store."""


class Jobs:
    """Everything about jobs; thread-safe, and to be kept off an event loop: it reads and writes the disk.

    ``data_dir`` holds the lock by which one process at a time dispatches the store's jobs.
    """

    def __init__(
        self,
        database_url: str,
        cache: FrameCache,
        artifacts: LocalArtifacts,
        *,
        data_dir: Path,
        expiry_seconds: float = 7 * 86_400.0,
        max_frames: int | None = None,
        limits: Limits | None = None,
    ) -> None:
        data_dir.mkdir(parents=True, exist_ok=True)
        self.artifacts = artifacts
        self.store = JobStore(database_url)
        self._limits = limits
        self._max_frames = max_frames
        self._products = Products(self.store, cache)
        self._lock_path = data_dir / "dispatcher.lock"
        self._lock_file: IO[bytes] | None = None
        owner = f"{os.getpid()}-{secrets.token_hex(4)}"
        self._dispatcher = Dispatcher(
            self.store, cache, owner=owner, expiry_seconds=expiry_seconds, on_ended=self._ended
        )
        self._to_prepare: SimpleQueue[str | None] = SimpleQueue()
        self._preparer = threading.Thread(target=self._prepare, name="products", daemon=True)

    def start(self) -> None:
        """Take the store over and go on with its jobs. Raises ``StoreBusy`` where another process holds it."""
        self._lock_file = _hold(self._lock_path)
        self._dispatcher.start(is_alone=True)
        self._preparer.start()

    def close(self) -> None:
        """Let go; what is unfinished goes on with the next start."""
        self._dispatcher.close()
        self._to_prepare.put(None)
        if self._lock_file is not None:
            self._lock_file.close()
        self.store.close()

    # ------------------------------------------------------------------------------------------------ jobs

    def submit(self, body: Mapping[str, Any], idempotency_key: str | None = None) -> JobView:
        """Check a job as a whole and write it down. Raises ``InvalidRequest``, ``IdempotencyConflict``."""
        wanted = submission(body, self._limits, self._max_frames, idempotency_key)
        job = self.store.submit(wanted)
        self._dispatcher.wake()
        return self.job(job.id)

    def job(self, job_id: str) -> JobView:
        """A job as it stands. Raises ``UnknownJob``, ``JobExpired``."""
        return JobView(*self.store.job(job_id))

    def page(self, *, state: str | None = None, cursor: str | None = None, limit: int = 50) -> JobPage:
        """Jobs, the newest first. Raises ``InvalidRequest``, ``BadCursor``."""
        before = None if cursor is None else from_cursor(cursor, float, str)
        found = self.store.jobs(
            state=None if state is None else _state(state),
            before=None if before is None else (before[0], before[1]),
            limit=limit + 1,
        )
        views = tuple(JobView(*facts) for facts in found[:limit])
        more = len(found) > limit
        return JobPage(views, to_cursor(views[-1].job.created, views[-1].job.id) if more else None)

    def cancel(self, job_id: str) -> JobView:
        """Draw no more of it; what is done stays. Raises ``TransitionRefused`` once it has ended otherwise."""
        return self._act(job_id, Action.CANCEL)

    def pause(self, job_id: str) -> JobView:
        """Begin no more of its frames until ``resume``."""
        return self._act(job_id, Action.PAUSE)

    def resume(self, job_id: str) -> JobView:
        """Go on after ``pause``."""
        return self._act(job_id, Action.RESUME)

    def retry(self, job_id: str) -> JobView:
        """Draw what a failed or cancelled job lacks."""
        return self._act(job_id, Action.RETRY)

    def _act(self, job_id: str, action: Action) -> JobView:
        self.store.act(job_id, action)
        self._dispatcher.wake()
        return self.job(job_id)

    # ------------------------------------------------------------------------------------------------ results

    def frames(self, job_id: str, *, cursor: str | None = None, limit: int = 200) -> FramePage:
        """A job's frames by index. Raises ``UnknownJob``, ``JobExpired``, ``BadCursor``."""
        start = 0 if cursor is None else from_cursor(cursor, int)[0]
        found = self.store.frames(job_id, start=start, limit=limit + 1)
        more = len(found) > limit
        return FramePage(tuple(found[:limit]), to_cursor(found[limit].index) if more else None)

    def frame(self, job_id: str, index: int) -> StoredFrame:
        """One frame's bytes, verified. Raises ``UnknownFrame``, ``FrameUnfinished``, ``ArtifactMissing``."""
        return self._products.frame(self.store.frame(job_id, index))

    def product(self, job_id: str, product: str) -> Product:
        """A product, made now if it was not yet. See ``Products.product``."""
        return self._products.product(job_id, product)

    # ------------------------------------------------------------------------------------------------ hidden

    def _ended(self, job_id: str) -> None:
        self._to_prepare.put(job_id)

    def _prepare(self) -> None:
        """Make the products that ended jobs asked for, one after the other."""
        while (job_id := self._to_prepare.get()) is not None:
            try:
                job, _, _ = self.store.job(job_id)
                if job.state is JobState.SUCCEEDED:
                    for output in job.spec["outputs"]:
                        self._products.product(job_id, f"result.{output}")
            except MillpondError:  # whoever asks for it is told
                log.exception("a product of job %s can't be made", job_id)


def _state(name: str) -> JobState:
    if name not in set(JobState):
        bound = "one of " + ", ".join(JobState)
        raise InvalidRequest((FieldProblem("state", "jobs have no such state", name, bound),))
    return JobState(name)


def _hold(path: Path) -> IO[bytes]:
    """Hold a file's lock for as long as it is open: it ends with the process, however that ends."""
    file = path.open("wb")
    deadline = monotonic() + _TAKEOVER_SECONDS
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            if monotonic() > deadline:
                file.close()
                raise StoreBusy from error
            sleep(0.1)
        else:
            return file
