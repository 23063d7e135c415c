"""Cameras at the water (T8 of the acceptance list): the plane crosses the near plane, the eye lies in a crest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.water.catalogue import TECHNIQUES
from tests.renderer.drawing import picture
from tests.renderer.world import EMPTY, LEVEL

pytestmark = pytest.mark.usefixtures("world")

BRIGHT: dict[str, Any] = {
    "scene": EMPTY,
    "sky": {"model": "constant", "color": [0.8, 0.8, 0.8]},
    "sun": None,
    "ambient": [1.0, 1.0, 1.0],
    "time": 1.3,
}
"""Nothing dark is to be seen, whichever way a ray goes: a black pixel is a hole or no number."""


def at(height: float, **camera: Any) -> dict[str, Any]:
    return {"eye": [3.0, LEVEL + height, 2.0], "target": [-3.0, LEVEL - 0.4, -2.0], "fov_y": 70, **camera}


@pytest.mark.parametrize("near", [None, 0.001, 0.5, 3.0])
@pytest.mark.parametrize("height", [0.3, 0.01, 0.0, -0.01, -0.3])
@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_no_hole_opens_where_the_plane_meets_the_camera(technique: str, height: float, near: float | None) -> None:
    depth = {} if near is None else {"near": near}
    shown = picture(**BRIGHT, camera=at(height, **depth), water={"technique": technique})

    assert shown.min() > 40


@pytest.mark.parametrize("height", [0.12, 0.05, 0.0, -0.05])
def test_no_hole_opens_inside_a_crest(height: float) -> None:
    shown = picture(**BRIGHT, camera=at(height), water={"displacement": 6.0})

    assert shown.min() > 40


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_crossing_the_near_plane_cuts_and_moves_nothing(technique: str) -> None:
    """Beyond the near plane the picture is the same: depth has no other part in it."""
    water = {"technique": technique}
    plain = picture(camera=at(0.3), water=water, time=1.3)
    cut = picture(camera=at(0.3, near=0.4), water=water, time=1.3)

    changed = np.abs(plain.astype(int) - cut).max(axis=-1) > 2
    assert changed[-3:].mean() > 0.5, "what lies before the near plane is gone"
    assert changed[:75].mean() < 0.005
