"""What the water's shader reads, brought back beside the picture: the maps and the scene without water."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.frame import Frame
from renderer.gpu.target import Target
from renderer.passes.mapping import DrawnMap
from renderer.pipeline import Instant, Renderer, World
from tests.renderer.drawing import PLAIN, asked, drawn

Floats = NDArray[np.float64]


@dataclass
class Dump:
    """The maps with the projections that they are read by, and the scene behind the water; first row on top."""

    maps: dict[str, Floats] = field(default_factory=dict)
    projections: dict[str, Floats] = field(default_factory=dict)
    behind: Floats = field(default_factory=lambda: np.zeros((0, 0, 4)))


def values(target: Target) -> Floats:
    """A target's pixels, bytes as 0..1."""
    pixels = target.read()[::-1]
    return pixels.astype(np.float64) / (255.0 if pixels.dtype == np.uint8 else 1.0)


def dumped(**fields: Any) -> tuple[Frame, Dump]:
    """The small frame of these fields, and what its water was made from."""
    dump = Dump()
    draw = Renderer._maps

    def read(self: Renderer, world: World, instant: Instant, target: Target) -> Mapping[str, DrawnMap]:
        maps = draw(self, world, instant, target)
        dump.behind = values(target)
        dump.maps = {name: values(made.target) for name, made in maps.items()}
        dump.projections = {name: made.clip_from_world for name, made in maps.items()}
        return maps

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Renderer, "_maps", read)
        frame = drawn(**{**PLAIN, **fields})
    return frame, dump


def points(pixels: NDArray[np.int_], **fields: Any) -> tuple[Floats, Floats]:
    """Where the rays of pixels (n, 2: row, column) meet the water, and the unit vectors from there to the eye."""
    request = asked(**fields)
    view = request.view()
    x = (pixels[:, 1] + 0.5) / request.width * 2 - 1
    y = 1 - (pixels[:, 0] + 0.5) / request.height * 2
    rays = (np.stack([x, y, np.ones_like(x), np.zeros_like(x)], axis=-1) @ view.ray_from_ndc.T)[:, :3]
    eye = view.world_from_camera[:3, 3]
    reach = ((request.water.level or 0.0) - eye[1]) / rays[:, 1]
    return eye + rays * reach[:, None], -rays / np.linalg.norm(rays, axis=1, keepdims=True)
