"""What can go wrong in the service, outside HTTP.

    MillpondError                   (the renderer's root)
    └── ServiceError
        ├── FrameError              one frame failed; the others go on
        │   ├── WorkerDied          its process ended while it drew the frame
        │   ├── FrameTimedOut       its process was ended past the frame's deadline
        │   └── FramePoisoned       it ended two processes; it is set aside for a while
        ├── Overloaded              not this frame's fault: ask again after `retry_after` seconds
        │   ├── QueueFull           more seconds of work wait than may
        │   ├── EngineUnavailable   no worker can draw at present
        │   └── StoreUnavailable    the artifacts' disk takes no more
        ├── ArtifactMissing         no such artifact, or a damaged one that was removed
        └── JobError
            ├── UnknownJob          no job has this id
            ├── JobExpired          the job's frames are gone
            ├── UnknownFrame        the job has no frame of this index
            ├── UnknownProduct      jobs have no such product
            ├── FrameUnfinished     the frame is not drawn yet
            ├── JobUnfinished       the product needs frames that are not drawn yet
            ├── ProductIncomplete   frames failed or are lost: the product will not come
            ├── TransitionRefused   the job's state does not allow that
            ├── IdempotencyConflict the same idempotency key, another body
            ├── BadCursor           a page's cursor that was not handed out here
            └── StoreBusy           another dispatcher serves this store

The docstring of a class is its default message; attributes carry the facts.
"""

from __future__ import annotations

import signal as signals
from collections.abc import Mapping, Sequence

from renderer.errors import MillpondError


class ServiceError(MillpondError):
    """Something went wrong in the service."""


# ---------------------------------------------------------------------------------------------------- frames


class FrameError(ServiceError):
    """The frame could not be made."""

    def __init__(self, message: str | None = None, *, key: str = "") -> None:
        super().__init__(message)
        self.key = key
        """The frame's key, where it is known."""


class WorkerDied(FrameError):
    """The worker process ended while it drew the frame."""

    def __init__(
        self, reason: str = "", *, key: str = "", exit_code: int | None = None, pid: int | None = None
    ) -> None:
        name = signal_name(exit_code)
        how = reason or (f"by {name}" if name else f"with exit code {exit_code}")
        super().__init__(f"The worker process ended while it drew the frame: {how}.", key=key)
        self.reason = how
        self.exit_code = exit_code
        """As multiprocessing has it: minus the signal's number."""
        self.signal = name
        """The signal's name (``SIGKILL``), or None."""
        self.pid = pid


class FrameTimedOut(FrameError):
    """The frame was not drawn by its deadline; its process was ended."""

    def __init__(self, seconds: float, *, key: str = "") -> None:
        super().__init__(f"The frame was not drawn in {seconds:.1f} s; its process was ended.", key=key)
        self.seconds = seconds
        """How long it was given."""


class FramePoisoned(FrameError):
    """The frame ended two worker processes; it is set aside for a while."""

    def __init__(self, reason: str, *, key: str, retry_after: float) -> None:
        super().__init__(f"The frame ended two worker processes and is set aside: {reason}", key=key)
        self.reason = reason
        """What the second process ended of."""
        self.retry_after = retry_after
        """Seconds for which the key stays set aside."""


# -------------------------------------------------------------------------------------------------- overload


class Overloaded(ServiceError):
    """The service can't take this at present."""

    def __init__(self, message: str | None = None, *, retry_after: float = 1.0) -> None:
        super().__init__(message)
        self.retry_after = retry_after
        """Seconds after which it is worth asking again."""


class QueueFull(Overloaded):
    """More work waits than may."""

    def __init__(self, waiting: float, bound: float) -> None:
        retry_after = max(1.0, waiting - bound)
        super().__init__(
            f"About {waiting:.0f} s of work would wait; at most {bound:.0f} s may.", retry_after=retry_after
        )
        self.waiting = waiting
        """Predicted seconds of work, this frame's included."""
        self.bound = bound
        """Seconds of work that may wait."""


class EngineUnavailable(Overloaded):
    """No worker can draw at present."""


class StoreUnavailable(Overloaded):
    """The artifacts' disk takes no more."""


class ArtifactMissing(ServiceError):
    """There is no such artifact, or it was damaged and has been removed."""

    def __init__(self, name: str) -> None:
        super().__init__(f"There is no sound artifact {name!r}.")
        self.name = name


# ------------------------------------------------------------------------------------------------------ jobs


class JobError(ServiceError):
    """The job can't do that."""


class UnknownJob(JobError):
    """No job has this id."""

    def __init__(self, job_id: str) -> None:
        super().__init__(f"No job has the id {job_id!r}.")
        self.job_id = job_id


class JobExpired(JobError):
    """The job has expired: its frames are gone."""

    def __init__(self, job_id: str) -> None:
        super().__init__(f"The job {job_id} has expired; its frames and products are gone.")
        self.job_id = job_id


class UnknownFrame(JobError):
    """The job has no frame of this index."""

    def __init__(self, job_id: str, index: int, total: int) -> None:
        super().__init__(f"The job {job_id} has frames 0 to {total - 1}, not {index}.")
        self.job_id = job_id
        self.index = index
        self.total = total


class UnknownProduct(JobError):
    """Jobs have no such product."""

    def __init__(self, product: str, known: Sequence[str]) -> None:
        super().__init__(f"Jobs have no product {product!r}; they have {', '.join(known)}.")
        self.product = product
        self.known = tuple(known)


class JobUnfinished(JobError):
    """The job is not finished."""

    def __init__(self, job_id: str, state: str, progress: Mapping[str, int]) -> None:
        done, total = progress.get("done", 0), progress.get("total", 0)
        super().__init__(f"The job {job_id} is {state}: {done} of {total} frames are done.")
        self.job_id = job_id
        self.state = state
        self.progress = dict(progress)
        """The job's counts: ``total done failed pending leased``."""


class FrameUnfinished(JobError):
    """The frame is not drawn yet."""

    def __init__(self, job_id: str, index: int, state: str) -> None:
        super().__init__(f"Frame {index} of the job {job_id} is {state}.")
        self.job_id = job_id
        self.index = index
        self.state = state


class ProductIncomplete(JobError):
    """The product can't be made: frames failed or are lost."""

    def __init__(self, job_id: str, product: str, missing: Sequence[int], reason: str = "failed or lost") -> None:
        shown = ", ".join(map(str, missing[:10])) + (" …" if len(missing) > 10 else "")
        super().__init__(f"{product} of the job {job_id} can't be made: {reason}: frames {shown}.")
        self.job_id = job_id
        self.product = product
        self.missing = tuple(missing)
        """Indices of the frames that it lacks."""


class TransitionRefused(JobError):
    """The job's state does not allow that."""

    def __init__(self, action: str, state: str, job_id: str = "") -> None:
        which = f"The job {job_id}" if job_id else "A job"
        super().__init__(f"{which} that is {state} can't {action}.")
        self.action = action
        self.state = state
        self.job_id = job_id


class IdempotencyConflict(JobError):
    """This idempotency key was used for another request."""

    def __init__(self, key: str, job_id: str) -> None:
        super().__init__("This idempotency key was used for a job with another body.")
        self.key = key
        self.job_id = job_id
        """The job that was made with the key."""


class BadCursor(JobError):
    """The cursor was not handed out by this service."""


class StoreBusy(JobError):
    """Another process already dispatches the jobs of this store."""


def signal_name(exit_code: int | None) -> str | None:
    """The name of the signal that ended a process, from its exit code; None if it ended otherwise."""
    if exit_code is None or exit_code >= 0:
        return None
    try:
        return signals.Signals(-exit_code).name
    except ValueError:
        return f"signal {-exit_code}"
