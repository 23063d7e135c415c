"""Scrolling as a pure function of time, exactly periodic where a period is asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Scroll:
    """Where a scrolling map stands: its offset now, its offset one period earlier, and their blend.

    With a period T the map at time t is the blend of its phases at t and t − T with weights 1 − t/T
    and t/T: it repeats exactly after T although the scroll itself does not. The shader divides the
    blended slopes by the root of the weights' squares, which keeps their variance.
    """

    offsets: tuple[float, float, float, float]
    """Now (x, y), and one period earlier (x, y), in tiles, 0..1."""
    blend: float
    """Weight of the earlier phase."""

    @classmethod
    def at(cls, velocity: tuple[float, float], time: float, period: float | None) -> Scroll:
        """The scroll of a map with this velocity, tiles per second, at ``time`` seconds.

        Phases are reduced to one tile in double precision, so that late times stay as sharp as early ones.
        """
        now = time if period is None else math.fmod(math.fmod(time, period) + period, period)
        x, y = (_phase(v * now) for v in velocity)
        if period is None or not cls.needs_blend(velocity, period):
            return cls((x, y, x, y), 0.0)
        before = tuple(_phase(v * (now - period)) for v in velocity)
        return cls((x, y, before[0], before[1]), now / period)

    @staticmethod
    def needs_blend(velocity: tuple[float, float], period: float | None) -> bool:
        """Whether the scroll does not come back by itself: it moves a fraction of a tile in a period."""
        if period is None:
            return False
        return any(abs(v * period - round(v * period)) > 1e-9 for v in velocity)


def _phase(tiles: float) -> float:
    return tiles - math.floor(tiles)
