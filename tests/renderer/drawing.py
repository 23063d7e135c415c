"""Drawing with the one renderer of this process."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.frame import Frame
from renderer.gpu import source
from renderer.pipeline import Renderer
from renderer.request import FrameRequest
from tests.reference import normals
from tests.renderer.world import NAME

Picture = NDArray[np.uint8]
Floats = NDArray[np.float64]

SIZE = (160, 90)
PLAIN: dict[str, Any] = {"tonemap": "none", "msaa": 1}
"""What makes bytes checkable by hand."""
NEUTRAL: dict[str, Any] = {
    "material_ambient": [1, 1, 1],
    "light_ambient": [1, 1, 1],
    "light_diffuse": [0, 0, 0],
    "light_specular": [0, 0, 0],
}
"""Luna's light and material by which the blend of the maps is what one sees."""
FLAT: dict[str, Any] = {**NEUTRAL, "ripple_height": 0.0, "ripple_scale": [0.0, 0.0]}
MIRROR: dict[str, Any] = {**FLAT, "refraction_bias": -1.0}
"""Water that reflects everything."""
WINDOW: dict[str, Any] = {**FLAT, "refraction_bias": 1.0}
"""Water that lets everything through."""


EYE: dict[str, Any] = {"eye": [7.0, 3.2, 9.0], "target": [0.0, 0.3, 0.0]}
CAMERAS: dict[str, dict[str, Any]] = {
    "upright": {**EYE, "fov_y": 45},
    "rolled": {"position": [7.0, 3.2, 9.0], "yaw": 38.0, "pitch": -14.0, "roll": 22.0},
    "off axis": {**EYE, "intrinsics": {"fx": 110.0, "fy": 120.0, "cx": 30.0, "cy": 70.0}},
    "parallel": {"eye": [12.0, 12.0, 16.0], "target": [0.0, 0.3, 0.0], "orthographic": {"height": 9.0}},
    "steep": {"eye": [2.0, 9.0, 6.0], "target": [0.0, 0.0, 0.0], "fov_y": 70},
}
"""Cameras of every kind that see the pond from above."""


STEEP: dict[str, Any] = {"eye": [1.0, 8.0, 7.0], "target": [0.0, 0.0, 0.5], "fov_y": 60}
GRAZING: dict[str, Any] = {"eye": [0.0, 0.8, 12.0], "target": [0.0, 0.3, 0.0], "fov_y": 60}


@cache
def shared_renderer() -> Renderer:
    """The renderer of this process: a second context would only cost memory."""
    os.environ.setdefault("LP_NUM_THREADS", "2")
    return Renderer()


_DRAWING: list[Renderer] = []
"""Renderers that draw in place of the shared one, the last first."""


@contextmanager
def drawn_by(renderer: Renderer) -> Iterator[None]:
    """Let another renderer draw for a while: one whose shaders are broken, say."""
    _DRAWING.append(renderer)
    try:
        yield
    finally:
        _DRAWING.pop()


@contextmanager
def broken_shaders(changes: Mapping[str, tuple[str, str]]) -> Iterator[None]:
    """Draw with shaders in which texts are replaced: file -> (what stands there, what stands there now)."""
    with TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        shaders = Path(folder) / "shaders"
        shutil.copytree(source.SHADERS, shaders)
        for file, (old, new) in changes.items():
            text = (shaders / file).read_text()
            assert text.count(old) == 1, f"{file} no longer says {old!r}"
            (shaders / file).write_text(text.replace(old, new))
        patch.setattr(source, "SHADERS", shaders)
        source._read.cache_clear()
        try:
            with Renderer() as renderer, drawn_by(renderer):
                yield
        finally:
            source._read.cache_clear()


def asked(**fields: Any) -> FrameRequest:
    """A small frame of the test world."""
    return FrameRequest.parse({"scene": NAME, "width": SIZE[0], "height": SIZE[1], **fields})


def drawn(**fields: Any) -> Frame:
    """The frame of ``asked``."""
    renderer = _DRAWING[-1] if _DRAWING else shared_renderer()
    return renderer.render(asked(**fields))


def picture(**fields: Any) -> Picture:
    """The bytes of a small frame with linear light and hard edges, (h, w, 3)."""
    return drawn(**{**PLAIN, **fields}).color


def mask(**fields: Any) -> NDArray[np.bool_]:
    """Where water is seen, (h, w)."""
    shown = drawn(**{**PLAIN, **fields, "layers": ["water_mask"]}).color
    assert set(np.unique(shown)) <= {0, 255}
    return np.asarray(shown[..., 0] == 255)


def linear(encoded: Picture) -> Floats:
    """Linear light of sRGB bytes (IEC 61966-2-1, section 5.2)."""
    c = encoded / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def furthest(a: Picture, b: Picture, where: NDArray[np.bool_] | None = None) -> int:
    """The largest difference of two pictures, in steps of 255."""
    difference = np.abs(a.astype(np.int16) - b.astype(np.int16))
    chosen = difference if where is None else difference[where]
    return int(chosen.max(initial=0))


def inside(region: NDArray[np.bool_], margin: int = 1) -> NDArray[np.bool_]:
    """The region without a rim of ``margin`` pixels; the picture's border is no rim."""
    padded = np.pad(region, margin, mode="edge")
    kept = np.ones_like(region)
    height, width = region.shape
    for dy in range(2 * margin + 1):
        for dx in range(2 * margin + 1):
            kept &= padded[dy : dy + height, dx : dx + width]
    return kept


def views(camera: dict[str, Any]) -> Floats:
    """The unit vector from each pixel's place on the water towards the eye, (h, w, 3)."""
    request = asked(camera=camera)
    view = request.view()
    across = (np.arange(request.width) + 0.5) / request.width * 2 - 1
    down = 1 - (np.arange(request.height) + 0.5) / request.height * 2
    x, y = np.meshgrid(across, down)
    rays = np.stack([x, y, np.ones_like(x), np.zeros_like(x)], axis=-1) @ view.ray_from_ndc.T
    return -normals.unit(rays[..., :3])
