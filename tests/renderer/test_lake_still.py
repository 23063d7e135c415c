"""Flat lake water is a mirror and a window, and high waves draw nothing onto it that is not under water."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.renderer.drawing import CAMERAS, broken_shaders, furthest, mask, picture
from tests.renderer.world import DRY

pytestmark = pytest.mark.usefixtures("world")

FLAT: dict[str, Any] = {"technique": "lake", "wave_height": 0.0, "dull_blend_factor": 0.0, "spec_alpha": 0.0}
WINDOW: dict[str, Any] = {**FLAT, "draw_mode": 0.0}
MIRROR: dict[str, Any] = {**FLAT, "draw_mode": 100.0}


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_flat_water_shows_its_maps_to_the_byte_under_every_camera(camera: dict[str, Any]) -> None:
    region = mask(camera=camera, water=FLAT)
    mirrored = picture(camera=camera, water=FLAT, layers=["reflection_map"])
    bare = picture(camera=camera, water={**FLAT, "extents": DRY})

    assert furthest(picture(camera=camera, water=MIRROR), mirrored, region) == 0
    assert furthest(picture(camera=camera, water=WINDOW), bare, region) == 0
    assert furthest(mirrored, bare, region) > 50


def blue(shown: NDArray[np.uint8]) -> int:
    """How many pixels show the hut, which stands on dry ground."""
    r, g, b = (shown[..., k].astype(int) for k in range(3))
    return int(((b > 1.7 * r) & (b > 1.5 * g) & (b > 60)).sum())


def leaked(*, as_published: bool) -> int:
    """How many pixels of water show the hut through high waves."""
    near = {"eye": [6.0, 1.5, -4.0], "target": [5.5, 0.4, -10.0], "fov_y": 40}
    view: dict[str, Any] = {"camera": near, "sky": {"model": "constant", "color": [0.5, 0.5, 0.5]}}
    water = {**WINDOW, "wave_height": 2.0, "as_published": as_published}
    shown = picture(**view, water=water)
    assert blue(shown) > 100, "the hut stands in the picture"
    return blue(np.where(mask(**view, water=water)[..., None], shown, 0))


def test_waves_draw_nothing_onto_the_water_that_stands_on_land() -> None:
    assert leaked(as_published=False) == 0


def test_as_published_what_stands_on_land_leaks_and_without_the_guard_too() -> None:
    assert leaked(as_published=True) > 10
    with broken_shaders({"water/lake.glsl": ("if (refracted.a < 0.5)", "if (refracted.a < -0.5)")}):
        assert leaked(as_published=False) > 10
