"""Pictures to encode: like frames of water in what compression finds in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def landscape(height: int, width: int, *, shift: float = 0.0) -> NDArray[np.uint8]:
    """Sky, a bank and rippled water, uint8 (h, w, 3); ``shift`` moves it sideways by so many pixels."""
    random = np.random.default_rng(7)
    across = (np.arange(width) + shift)[np.newaxis, :] / 97.0
    down = np.linspace(0.0, 1.0, height)[:, np.newaxis]
    sky = 0.62 + 0.3 * down + 0.08 * np.sin(across * 1.7) * np.sin(down * 9.0)
    bank = sum(np.sin(across * k + down * k * 3.0 + k) / k for k in (2.0, 5.0, 11.0, 23.0, 47.0)) * 0.2 + 0.35
    water = 0.4 + 0.2 * down * np.sin(across * 3.0 + 60.0 * down) * np.sin(140.0 * down * down + across)
    grain = random.normal(0.0, 0.012, (height, width))
    level = np.where(down < 0.4, sky, np.where(down < 0.6, bank + 3.0 * grain, water + grain))
    tint = np.where((down < 0.4)[..., np.newaxis], (0.8, 0.9, 1.0), (0.8, 1.0, 0.7))
    linear = np.clip(level[..., np.newaxis] * tint, 0.0, 1.0)
    dither = random.random((height, width, 1))
    return np.asarray(np.floor(linear * 254.0 + dither), dtype=np.uint8)
