"""Targets by what they are for, kept between frames within a byte budget."""

from __future__ import annotations

from renderer.gpu.device import Device
from renderer.gpu.target import Target

BUDGET = 768 * 2**20
"""Bytes of targets that stay on the device while nothing needs them."""
BYTES = {"f1": 1, "f2": 2, "f4": 4}


class Targets:
    """Lends targets by purpose and size; the least recently used go first."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._kept: dict[tuple[object, ...], tuple[Target, int]] = {}
        self._lent: set[tuple[object, ...]] = set()

    def lend(
        self,
        purpose: str,
        size: tuple[int, int],
        *,
        kind: str = "f2",
        components: int = 4,
        samples: int = 1,
        has_depth: bool = True,
        wrap: str = "clamp",
    ) -> Target:
        """The target for this purpose: the same one again until the next frame asks."""
        key = (purpose, size, kind, components, samples, has_depth, wrap)
        self._lent.add(key)
        if key in self._kept:
            self._kept[key] = self._kept.pop(key)
            return self._kept[key][0]
        pixels = size[0] * size[1] * samples
        cost = pixels * (BYTES[kind] * components + (4 if has_depth else 0))
        self._make_room(cost)
        target = Target(
            self.device,
            size,
            kind=kind,
            components=components,
            samples=samples,
            has_depth=has_depth,
            wrap=wrap,
        )
        self._kept[key] = (target, cost)
        return target

    def begin_frame(self) -> None:
        """Take everything back, and free what exceeds the budget, oldest first."""
        self._lent.clear()
        self._make_room(0)

    def _make_room(self, cost: int) -> None:
        """Free what no pass holds, oldest first, until this many bytes more fit the budget."""
        for key in [key for key in self._kept if key not in self._lent]:
            if self._held() + cost <= BUDGET:
                return
            self._kept.pop(key)[0].release()

    def _held(self) -> int:
        return sum(cost for _, cost in self._kept.values())
