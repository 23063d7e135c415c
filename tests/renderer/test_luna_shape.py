"""Luna's displaced surface (Luna 2006, section 5), and its water as published."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.water.normal_maps import SIZE, ripple_heights, ripple_slopes
from tests.reference.sampling import Sampler
from tests.renderer.drawing import EYE, Floats, broken_shaders, drawn, furthest, mask, picture
from tests.renderer.world import EMPTY, LEVEL

pytestmark = pytest.mark.usefixtures("world")

CELLS, SIDE = 192, 4.8
"""The cells of the surface, and a rectangle whose cells are texels of the height maps."""
BAND = 0.8
"""Metres that the side view is high."""
SIDE_VIEW: dict[str, Any] = {
    "eye": [0.0, LEVEL, 6.0],
    "target": [0.0, LEVEL, 0.0],
    "orthographic": {"height": BAND},
}


def water(**fields: Any) -> dict[str, Any]:
    half = SIDE / 2
    return {"extents": [-half, half, -half, half], "tile_0": 12.8, "tile_1": 12.8, **fields}


def silhouette(time: float = 0.0, **fields: Any) -> Floats:
    """The heights above the level at which water begins in each column of the side view, metres."""
    shown = drawn(
        scene=EMPTY, camera=SIDE_VIEW, layers=["water_mask"], time=time, water=water(**fields), tonemap="none", msaa=1
    ).color
    first = np.argmax(shown[..., 0] == 255, axis=0)
    return np.asarray(BAND * (0.5 - first / shown.shape[0]))


def lifted(time: float, factor: float) -> Floats:
    """The surface's corners (z, x), metres above the level, from the height maps."""
    line = np.linspace(-SIDE / 2, SIDE / 2, CELLS + 1)
    x, z = np.meshgrid(line, line)
    total = np.zeros_like(x)
    for number, velocity in enumerate(((0.09, 0.06), (-0.05, 0.08))):
        heights = ripple_heights(number).image[..., 0].astype(np.float64)
        place = np.stack([x, z], axis=-1).reshape(-1, 2) / 12.8 + np.array(velocity) * time
        total += 12.8 * Sampler(heights[..., None], "repeat").read(place).reshape(x.shape)
    return 0.5 * factor * total


@pytest.mark.parametrize(("time", "factor"), [(0.0, 3.0), (1.7, 3.0), (1.7, 1.5)])
def test_the_surface_stands_as_high_as_its_maps_say(time: float, factor: float) -> None:
    expected = lifted(time, factor).max(axis=0)
    columns = (np.arange(160) + 0.5 - 80) / 90 * BAND
    at = np.interp(columns, np.linspace(-SIDE / 2, SIDE / 2, CELLS + 1), expected)
    found = silhouette(time, displacement=factor)

    assert np.abs(expected).max() > 0.03 * factor
    assert np.abs(found - at).max() < 1.2 * BAND / 90


def test_slopes_and_heights_are_of_the_same_waves() -> None:
    heights, slopes = ripple_heights(3).image[..., 0], ripple_slopes(3).image
    step = 1 / SIZE
    along_x = (np.roll(heights, -1, 1) - np.roll(heights, 1, 1)) / (2 * step)
    along_z = (np.roll(heights, -1, 0) - np.roll(heights, 1, 0)) / (2 * step)

    assert np.corrcoef(along_x.ravel(), slopes[..., 0].ravel())[0, 1] > 0.99
    assert np.corrcoef(along_z.ravel(), slopes[..., 1].ravel())[0, 1] > 0.99
    assert along_x.std() == pytest.approx(slopes[..., 0].std(), rel=0.1)
    assert abs(float(heights.mean())) < 1e-9


def test_no_displacement_is_the_plane_to_the_byte() -> None:
    plane = picture(time=1.0)

    assert furthest(picture(time=1.0, water={"displacement": 0.0}), plane) == 0
    assert (
        furthest(picture(time=1.0, water={"displacement": 2.0, "ripple_height": 0.0, "ripple_scale": [0, 0]}), plane)
        > 3
    )
    lifted_mask = mask(time=1.0, camera=EYE, water={"displacement": 4.0})
    assert (lifted_mask != mask(time=1.0, camera=EYE)).sum() > 20, "the waterline moves"


def test_waves_grow_with_their_factor() -> None:
    spread = [float(silhouette(0.5, displacement=factor).std()) for factor in (0.0, 1.0, 2.0, 4.0)]

    assert spread[0] < 1e-9
    assert spread[1] < spread[2] < spread[3]


def test_a_surface_that_is_lifted_the_wrong_way_is_noticed() -> None:
    wrong = "return -luna.displacement * luna.ripple_height"
    with broken_shaders({"water/luna_shape.glsl": ("return luna.displacement * luna.ripple_height", wrong)}):
        found = silhouette(1.7, displacement=3.0)
    at = np.interp(
        (np.arange(160) + 0.5 - 80) / 90 * BAND,
        np.linspace(-SIDE / 2, SIDE / 2, CELLS + 1),
        lifted(1.7, 3.0).max(axis=0),
    )

    assert np.abs(found - at).max() > 3 * BAND / 90


def test_a_period_closes_the_lifted_surface_too() -> None:
    start = silhouette(0.0, displacement=3.0)
    looped = {"displacement": 3.0}
    first = drawn(
        scene=EMPTY, camera=SIDE_VIEW, layers=["water_mask"], time=0.0, period=7.0, water=water(**looped)
    ).color
    last = drawn(
        scene=EMPTY, camera=SIDE_VIEW, layers=["water_mask"], time=7.0, period=7.0, water=water(**looped)
    ).color

    assert (first == last).all()
    assert np.abs(start).max() > 0


# --------------------------------------------------------------------------------------------------------- as published


def test_as_published_ripples_drag_what_stands_in_the_air_into_the_water() -> None:
    published, right = (
        drawn(camera=EYE, water={"as_published": flag}, layers=["refraction_map"], tonemap="none", msaa=1).color
        for flag in (True, False)
    )

    assert furthest(published, right) <= 1, "one picture in bytes, encoded before it is stored or after"


def test_as_published_blends_what_the_display_shows() -> None:
    """Neutral light and flat water: the picture is the encoded maps' blend, not the encoding of the linear blend."""
    flat = {
        "material_ambient": [1, 1, 1],
        "light_ambient": [1, 1, 1],
        "light_diffuse": [0, 0, 0],
        "light_specular": [0, 0, 0],
        "ripple_height": 0.0,
        "as_published": True,
    }
    common: dict[str, Any] = {"camera": EYE, "water": flat, "tonemap": "none", "msaa": 1}
    shown = drawn(**common).color.astype(float)
    refraction = drawn(**common, layers=["refraction_map"]).color.astype(float)
    reflection = drawn(**common, layers=["reflection_map"]).color.astype(float)
    weight = drawn(**common, layers=["reflection_weight"]).color / 255.0
    where = mask(camera=EYE)
    # A flat mirror's reflection lies upside down at the pixel itself, in the picture's own rows.
    blend = reflection * weight + refraction * (1 - weight)

    assert np.abs(shown - blend)[where].max() <= 1.6
