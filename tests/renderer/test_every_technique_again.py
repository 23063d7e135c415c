"""What every technique keeps, continued: at any size, under any sky, at any time and place, drawn again."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.pipeline import Renderer
from renderer.water.catalogue import TECHNIQUES
from tests.renderer.drawing import (
    CAMERAS,
    EYE,
    PLAIN,
    Picture,
    asked,
    drawn,
    drawn_by,
    furthest,
    inside,
    linear,
    mask,
    picture,
)
from tests.renderer.techniques import SEA, SHIFT, WAYS, elsewhere, light, mirror, rough, still
from tests.renderer.world import EXTENTS, LEVEL, STILL

pytestmark = [pytest.mark.usefixtures("world", "telling"), pytest.mark.parametrize("name", TECHNIQUES)]

OPEN = [-4000.0, 4000.0, -4000.0, 4000.0]
SUN = {"direction": [0.6, 0.7, 0.4], "color": [1.0, 0.9, 0.8], "shadows": False}
GRADIENT = {"model": "gradient", "horizon": [0.8, 0.5, 0.2], "zenith": [0.05, 0.2, 0.7]}


# ----------------------------------------------------------------------------------------- T10, T11: resolution and sky


def box_filtered(shown: Picture) -> NDArray[np.float64]:
    """Half as many pixels each way, averaged in linear light, encoded again."""
    height, width, _ = shown.shape
    mean = linear(shown).reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))
    return np.asarray(np.where(mean <= 0.0031308, 12.92 * mean, 1.055 * mean ** (1 / 2.4) - 0.055) * 255)


def test_a_larger_picture_made_small_is_the_small_one_away_from_edges(name: str) -> None:
    water = still(name)
    small = picture(scene=STILL, sun=SUN, water=water).astype(float)
    large = box_filtered(picture(scene=STILL, sun=SUN, water=water, width=320, height=180))
    steps = np.zeros(small.shape[:2], bool)
    steps[1:] |= np.abs(np.diff(small, axis=0)).max(axis=-1) > 12
    steps[:, 1:] |= np.abs(np.diff(small, axis=1)).max(axis=-1) > 12
    smooth = inside(mask(scene=STILL) & ~steps, 2)
    error = float(np.mean((small - large)[smooth] ** 2))

    assert smooth.sum() > 1000
    assert 10 * np.log10(255**2 / max(error, 1e-9)) > 35


def test_the_sky_is_mirrored_by_direction_down_to_the_horizon(name: str) -> None:
    view = asked(camera=CAMERAS["rolled"]).view()
    shown = light(scene=SEA, camera=CAMERAS["rolled"], sky=GRADIENT, sun=None, water=mirror(name, extents=OPEN))
    height, width, _ = shown.shape
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    rays = np.stack([x, y, np.ones_like(x), np.zeros_like(x)], axis=-1) @ view.ray_from_ndc.T
    up = np.abs(rays[..., 1]) / np.linalg.norm(rays[..., :3], axis=-1)
    horizon, zenith = np.array(GRADIENT["horizon"]), np.array(GRADIENT["zenith"])
    expected = horizon + np.sqrt(up)[..., None] * (zenith - horizon)

    assert np.abs(shown - expected)[up > 0.002].max() < 3e-3


def test_the_sun_is_mirrored_where_its_direction_says(name: str) -> None:
    sun, eye = np.array([-0.4, 0.35, -0.8]), np.array([0.0, LEVEL + 3.0, 0.0])
    camera = {"eye": eye.tolist(), "target": (eye + sun * [1, -1, 1]).tolist(), "fov_y": 12.0}
    shown = light(
        scene=SEA,
        camera=camera,
        sky={"model": "analytic", "clouds": 0.0},
        sun={"direction": sun.tolist(), "shadows": False},
        water=mirror(name, extents=OPEN),
    ).max(axis=-1)
    rows, columns = np.nonzero(shown > 0.5 * shown.max())
    height, width = shown.shape

    assert 4 < len(rows) < 60, "a disc"
    assert abs(rows.mean() + 0.5 - height / 2) < 0.5
    assert abs(columns.mean() + 0.5 - width / 2) < 0.5


# --------------------------------------------------------------------------- T24, T25, T28: time, place, the same again


def test_water_that_moves_with_its_world_looks_the_same(name: str) -> None:
    tiled = {**rough(name), **(WAYS[name].repeats or {})}
    here = picture(scene=STILL, camera=EYE, sun=SUN, water=tiled, time=1.3)
    there = picture(
        scene=elsewhere(SHIFT),
        camera={key: np.add(value, [SHIFT, 0, SHIFT]).tolist() for key, value in EYE.items()},
        sun=SUN,
        water={**tiled, "extents": [edge + SHIFT for edge in EXTENTS]},
        time=1.3,
    )

    assert SHIFT % (WAYS[name].tile or 1.0) == 0
    assert (np.abs(here.astype(np.int16) - there).max(axis=-1) > 3).mean() < 0.01


@pytest.mark.parametrize("period", [0.7, 5.0])
def test_a_period_later_the_picture_is_the_same(name: str, period: float) -> None:
    def at(time: float) -> Picture:
        return picture(water=rough(name), time=time, period=period)

    assert furthest(at(0.0), at(period)) == 0
    assert furthest(at(0.0), at(0.4 * period), mask()) > 10


def test_the_same_request_is_the_same_picture_in_any_order_and_in_a_renderer_without_a_past(name: str) -> None:
    def shown() -> Picture:
        return drawn(**PLAIN, water=name, time=0.9).color

    first = shown()
    for other in TECHNIQUES:
        drawn(water=other, width=97, height=61)
    again = shown()
    with Renderer() as fresh, drawn_by(fresh):
        alone = shown()

    assert furthest(first, again) == 0
    assert furthest(first, alone) == 0
