"""Texture filtering and address modes: OpenGL 4.6, sections 8.14.2 and 8.14.3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Sampler:
    """A texture with linear filter and its address mode; ``image`` (h, w, c), first row at v = 0, v downwards."""

    image: Floats
    address: str = "mirror"

    def read(self, place: ArrayLike) -> Floats:
        """The filtered texels at places (n, 2)."""
        height, width, _ = self.image.shape
        p = np.asarray(place, np.float64) * [width, height] - 0.5
        low = np.floor(p).astype(int)
        share = p - low
        x0, x1 = self._texel(low[:, 0], width), self._texel(low[:, 0] + 1, width)
        y0, y1 = self._texel(low[:, 1], height), self._texel(low[:, 1] + 1, height)
        fx, fy = share[:, :1], share[:, 1:]
        top = self.image[y0, x0] * (1 - fx) + self.image[y0, x1] * fx
        bottom = self.image[y1, x0] * (1 - fx) + self.image[y1, x1] * fx
        return np.asarray(top * (1 - fy) + bottom * fy)

    def _texel(self, number: NDArray[np.int_], count: int) -> NDArray[np.int_]:
        if self.address == "repeat":
            return np.asarray(number % count)
        if self.address == "clamp":
            return np.asarray(np.clip(number, 0, count - 1))
        round_trip = number % (2 * count)
        return np.asarray(np.where(round_trip < count, round_trip, 2 * count - 1 - round_trip))
