"""How many may do something at a time, where waiting for a turn would only hide the load."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from service.errors import Overloaded


class Places:
    """So many places; who finds none is sent away at once. Thread-safe."""

    def __init__(self, count: int, retry_after: float = 5.0) -> None:
        self._count = count
        self._retry_after = retry_after
        self._taken = 0
        self._lock = threading.Lock()

    @property
    def taken(self) -> int:
        """How many are taken."""
        return self._taken

    @contextmanager
    def place(self) -> Iterator[None]:
        """One place for the length of the block. Raises ``Overloaded`` where there is none."""
        with self._lock:
            if self._taken >= self._count:
                raise Overloaded(f"All {self._count} places are taken.", retry_after=self._retry_after)
            self._taken += 1
        try:
            yield
        finally:
            with self._lock:
                self._taken -= 1
