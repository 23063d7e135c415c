"""Frames that end worker processes: counted by key, and set aside for a while after the second."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from time import monotonic

from service.errors import FramePoisoned

STRIKES = 2
"""Processes that a frame may end before it is set aside."""
SET_ASIDE = 600.0
"""Seconds for which a frame is set aside, and after which a single strike is forgotten."""
_KEYS = 10_000
"""Keys that are remembered; the oldest are forgotten first."""


@dataclass
class _Record:
    strikes: int
    reason: str
    until: float


class PoisonCabinet:
    """The keys under suspicion. The caller locks."""

    def __init__(self) -> None:
        self._records: OrderedDict[str, _Record] = OrderedDict()

    def check(self, key: str) -> None:
        """Raises ``FramePoisoned`` while the key is set aside."""
        record = self._records.get(key)
        if record is None:
            return
        left = record.until - monotonic()
        if left <= 0:
            del self._records[key]
        elif record.strikes >= STRIKES:
            raise FramePoisoned(record.reason, key=key, retry_after=left)

    def strike(self, key: str, reason: str) -> bool:
        """Count a process that ended on the key; returns whether the key is now set aside."""
        record = self._records.pop(key, None)
        strikes = 1 if record is None or record.until < monotonic() else record.strikes + 1
        self._records[key] = _Record(strikes, reason, monotonic() + SET_ASIDE)
        if len(self._records) > _KEYS:
            self._records.popitem(last=False)
        return strikes >= STRIKES

    def clear(self, key: str) -> None:
        """The key was drawn well."""
        self._records.pop(key, None)
