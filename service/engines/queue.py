"""Two lanes of waiting frames: pure bookkeeping, without locks or processes."""

from __future__ import annotations

from collections import OrderedDict
from concurrent.futures import Future
from dataclasses import dataclass
from time import monotonic

from service.engines.base import Lane
from service.worker import FrameReport, FrameTask


@dataclass(eq=False)
class Entry:
    """A frame on its way through an engine."""

    task: FrameTask
    lane: Lane
    future: Future[FrameReport]
    queued: float
    """Monotonic seconds at which it was submitted."""
    is_taken: bool = False
    """Whether its future is marked as running: cancelling it is then a matter for the worker."""
    returns: int = 0
    """How often it came back unbegun."""


class Lanes:
    """Frames that wait, each lane in order of arrival."""

    def __init__(self) -> None:
        self._waiting: dict[Lane, OrderedDict[Future[FrameReport], Entry]] = {lane: OrderedDict() for lane in Lane}

    def __len__(self) -> int:
        return sum(map(len, self._waiting.values()))

    def waiting(self, lane: Lane) -> int:
        """How many wait in a lane."""
        return len(self._waiting[lane])

    def add(self, task: FrameTask, lane: Lane) -> Entry:
        """Queue a frame behind its lane's others."""
        entry = Entry(task, lane, Future(), monotonic())
        self._waiting[lane][entry.future] = entry
        return entry

    def take(self, lane: Lane) -> Entry | None:
        """The lane's next frame that is still wanted, marked as running; None where there is none."""
        waiting = self._waiting[lane]
        while waiting:
            _, entry = waiting.popitem(last=False)
            if entry.is_taken or entry.future.set_running_or_notify_cancel():
                entry.is_taken = True
                return entry
        return None

    def put_back(self, entry: Entry) -> None:
        """Queue a frame that was taken and not begun before its lane's others."""
        entry.returns += 1
        waiting = self._waiting[entry.lane]
        waiting[entry.future] = entry
        waiting.move_to_end(entry.future, last=False)

    def promote(self, future: Future[FrameReport]) -> bool:
        """Move a waiting batch frame behind the interactive ones; False where it does not wait there."""
        entry = self._waiting[Lane.BATCH].pop(future, None)
        if entry is None:
            return False
        entry.lane = Lane.INTERACTIVE
        self._waiting[Lane.INTERACTIVE][future] = entry
        return True

    def drop(self, future: Future[FrameReport]) -> bool:
        """Forget a cancelled frame that waits; False where it does not wait, or was begun before."""
        for waiting in self._waiting.values():
            entry = waiting.get(future)
            if entry is not None and not entry.is_taken:
                del waiting[future]
                future.set_running_or_notify_cancel()  # whoever waits for it learns only so that it is over
                return True
        return False

    def drain(self) -> list[Entry]:
        """Forget all, and return what waited."""
        entries = [entry for waiting in self._waiting.values() for entry in waiting.values()]
        for waiting in self._waiting.values():
            waiting.clear()
        return entries
