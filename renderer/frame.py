"""What the renderer gives back."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Frame:
    """One drawn image."""

    color: NDArray[np.uint8]
    """(height, width, 3) bytes, top row first: the layer that was asked for, tone mapped if it is a colour."""
    renderer: str
    """The driver that drew it."""
    layers: dict[str, NDArray[np.generic]] = field(default_factory=dict)
    """Each layer asked for, by name."""
    timings: dict[str, float] = field(default_factory=dict)
    """CPU seconds by pass, where the renderer measures them; ``render`` is the whole in wall seconds."""
