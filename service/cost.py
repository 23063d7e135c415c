"""What a frame will cost here: a guess that learns from every frame drawn."""

from __future__ import annotations

import threading

from renderer.request import FrameRequest

_FIRST_GUESS = 0.4
"""Seconds a megapixel, before anything has been drawn: on the careful side for a software driver."""
_PER_FRAME = 0.02
"""Seconds that a frame costs besides its pixels."""
_MSAA = 1.7
"""What four samples an edge cost, against one: 238/152 CPU ms at 720p on the reference machine, and some more."""
_LEARNING = 0.2
"""Weight of the newest frame in the running mean."""


class CostModel:
    """Seconds a frame takes, by scene and technique; thread-safe."""

    def __init__(self) -> None:
        self._rates: dict[tuple[str, str], float] = {}
        self._lock = threading.Lock()

    def estimate(self, request: FrameRequest) -> float:
        """Seconds that the frame will take to render and encode."""
        with self._lock:
            rate = self._rates.get(_kind(request), _FIRST_GUESS)
        return _PER_FRAME + rate * _work(request)

    def learn(self, request: FrameRequest, seconds: float) -> None:
        """Take note of what a frame took."""
        rate = max(0.0, seconds - _PER_FRAME) / _work(request)
        with self._lock:
            known = self._rates.get(_kind(request), rate)
            self._rates[_kind(request)] = known + _LEARNING * (rate - known)


def _kind(request: FrameRequest) -> tuple[str, str]:
    return request.scene, type(request.water).__name__


def _work(request: FrameRequest) -> float:
    """Megapixels, weighted by samples."""
    return request.width * request.height * 1e-6 * request.samples * (_MSAA if request.msaa > 1 else 1.0)
