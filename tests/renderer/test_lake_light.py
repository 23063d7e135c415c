"""The lake's colours: dull colour (K20), highlight (K21, K22), and what may be asked of it (K23).

Each check is seen to fail where the shader is broken in the way that it is there to catch.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.errors import InvalidRequest
from renderer.scene.images import ImageLibrary
from renderer.water.lake import Lake
from tests.reference import lake, tonemap
from tests.renderer.drawing import (
    PLAIN,
    STEEP,
    Floats,
    asked,
    broken_shaders,
    drawn,
    furthest,
    linear,
    mask,
    picture,
    views,
)
from tests.renderer.making_images import even, file_of
from tests.renderer.world import EMPTY, LEVEL

pytestmark = pytest.mark.usefixtures("world")

OPEN = [-4000.0, 4000.0, -4000.0, 4000.0]
NIGHT: dict[str, Any] = {"scene": EMPTY, "sky": {"model": "constant", "color": [0.0, 0.0, 0.0]}}
TOWARDS: dict[str, Any] = {"eye": [0.0, 8.0, 7.0], "target": [-1.2, 0.0, 0.0], "fov_y": 60}
"""Looks at where the documents' light is mirrored."""
BARE: dict[str, Any] = {"technique": "lake", "wave_height": 0.0, "dull_blend_factor": 0.0, "spec_alpha": 0.0}


# ------------------------------------------------------------------------------------------------ K20, T14: dull colour


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0])
def test_as_published_the_dull_colour_is_mixed_in_as_displayed(factor: float) -> None:
    water = {**BARE, "as_published": True}
    combined = picture(camera=STEEP, water=water) / 255
    shown = picture(camera=STEEP, water={**water, "dull_blend_factor": factor})

    assert np.abs(shown - 255 * lake.dulled(combined, factor))[mask(camera=STEEP)].max() <= 1.0


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0])
def test_by_default_the_dull_colour_is_mixed_in_as_light(factor: float) -> None:
    dull = linear(255 * np.array(lake.DULL))
    combined = linear(picture(camera=STEEP, water=BARE))
    shown = picture(camera=STEEP, water={**BARE, "dull_blend_factor": factor})
    expected = 255 * tonemap.srgb(lake.dulled(combined, factor, dull))

    assert np.abs(shown - expected)[mask(camera=STEEP)].max() <= 1.1


def test_all_dull_is_exactly_the_documents_colour() -> None:
    for as_published in (False, True):
        water = {**BARE, "dull_blend_factor": 1.0, "as_published": as_published}
        shown = picture(camera=STEEP, water=water)[mask(camera=STEEP)]

        assert np.abs(shown - 255 * np.array(lake.DULL)).max() <= 0.51


# --------------------------------------------------------------------------------------- K21, K22, T13: the highlight


def glint(power: float, *, as_published: bool, **fields: Any) -> Floats:
    """The picture of the highlight alone over black water, as displayed, 0..1."""
    water = {**BARE, "spec_alpha": 0.6, "spec_power": power, "as_published": as_published, "extents": OPEN, **fields}
    return picture(**NIGHT, camera=TOWARDS, water=water) / 255.0


def expected_glint(power: float) -> Floats:
    view = lake.in_document(views(TOWARDS))
    return lake.highlight(view, np.zeros((*view.shape[:2], 2)), 0.0, power, lake.LIGHT)


def test_as_published_the_highlights_peak_is_its_colour_times_its_alpha() -> None:
    shown = glint(364.0, as_published=True)

    assert np.abs(shown.max(axis=(0, 1)) - [0.588, 0.582, 0.42]).max() < 0.01


@pytest.mark.parametrize("power", [4.0, 60.0, 364.0])
def test_the_highlights_profile_has_twice_the_exponent(power: float) -> None:
    t = expected_glint(power)
    shown = glint(power, as_published=True)

    assert np.abs(255 * (shown - lake.added(t))).max() <= 1.0
    assert np.abs(255 * (shown - lake.added(np.sqrt(t)))).max() > 20, "once the exponent must be told apart"


@pytest.mark.parametrize("power", [4.0, 364.0])
def test_by_default_the_highlight_is_light(power: float) -> None:
    color = np.array(lake.HIGHLIGHT)
    color[:3] = ((color[:3] + 0.055) / 1.055) ** 2.4
    expected = tonemap.srgb(lake.added(expected_glint(power), color))

    assert np.abs(255 * (glint(power, as_published=False) - expected)).max() <= 1.0


def test_the_highlight_stands_39_degrees_high_and_ignores_the_sun() -> None:
    light = Lake().light_direction
    assert np.degrees(np.arcsin(light[1] / np.linalg.norm(light))) == pytest.approx(39.4, abs=0.05)
    assert lake.in_document(light) == pytest.approx(lake.LIGHT)

    water = {**BARE, "spec_alpha": 0.6, "extents": OPEN}
    shown = [
        picture(**NIGHT, camera=TOWARDS, water=water, sun=sun)
        for sun in (None, {"direction": [1.0, 0.2, 1.0]}, {"direction": [-1.0, 1.0, 0.0]})
    ]
    assert shown[0].max() > 150
    assert all(furthest(shown[0], other) == 0 for other in shown[1:])


def test_the_highlight_is_added_after_the_dull_colour() -> None:
    dark = {"dull_color": [0.0, 0.0, 0.0], "dull_blend_factor": 1.0}

    assert np.array_equal(glint(364.0, as_published=True), glint(364.0, as_published=True, **dark))


def test_a_highlight_that_dulls_is_caught() -> None:
    dark = {"dull_color": [0.0, 0.0, 0.0], "dull_blend_factor": 1.0}
    late = ("vec3 radiance = dulled +", "vec3 radiance = dulled + (1.0 - lake.dull_blend_factor) *")
    with broken_shaders({"water/lake.glsl": late}):
        assert glint(364.0, as_published=True, **dark).max() < 0.1


@pytest.mark.parametrize("power", [1.0, 364.5])
@pytest.mark.parametrize("direction", [[0.1, 0.5, -0.6], [0.3, -0.2, 0.9], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
def test_an_eye_below_the_water_sees_no_highlight_and_no_holes(direction: list[float], power: float) -> None:
    below = {"eye": [0.0, LEVEL - 3.0, 7.0], "target": [0.0, LEVEL + 1.0, 0.0], "fov_y": 80}
    water = {**BARE, "extents": OPEN, "wave_height": 1.0}
    sky = {"model": "constant", "color": [0.2, 0.2, 0.2]}
    fields: dict[str, Any] = {"scene": EMPTY, "sky": sky, "camera": below}
    bright = {**water, "spec_alpha": 0.6, "spec_power": power, "light_direction": direction}
    plain, lit = (picture(**fields, water=w) for w in (water, bright))

    if direction[1] >= 0:
        assert furthest(plain, lit) == 0
    assert plain.min() > 100
    assert lit.min() > 100


# ----------------------------------------------------------------------------------------- K23, T29: what may be asked

OTHER: dict[str, Any] = {
    "level": LEVEL + 0.4,
    "extents": [-8.0, 8.0, -8.0, 8.0],
    "as_published": True,
    "fresnel_mode": 0,
    "draw_mode": 3.0,
    "wave_length": 0.3,
    "wave_height": 0.2,
    "wind_force": -13.0,
    "wind_direction": 30.0,
    "spec_power": 5.0,
    "spec_perturb": 5.0,
    "spec_color": [0.9, 0.1, 0.1],
    "spec_alpha": 0.1,
    "light_direction": [-0.3, 0.6, -0.6],
    "clear_color": [0.9, 0.1, 0.1],
    "reflection_clip_bias": 1.0,
    "dull_blend_factor": 0.8,
    "dull_color": [0.9, 0.1, 0.1],
    "refraction_clip_bias": -0.5,
}
PUBLISHED_ONLY = {"clear_color", "refraction_clip_bias"}
"""What by default shows only where the maps would not be whole."""


@pytest.mark.parametrize("name", sorted(set(Lake.model_fields) - {"technique"}))
def test_every_parameter_changes_the_water_and_nothing_else(name: str, images: ImageLibrary) -> None:
    other = OTHER[name] if name in OTHER else images.put(file_of(even(160, 128, 230)), name).id
    base = {"technique": "lake", "spec_power": 20.0, "wave_height": 0.3, "as_published": name in PUBLISHED_ONLY}
    if name == "clear_color":
        base |= {"refraction_clip_bias": -1.0, "draw_mode": 0.2}
    view: dict[str, Any] = {"time": 2.0, "camera": TOWARDS}
    plain, changed = (picture(**view, water=water) for water in (base, {**base, name: other}))
    region = mask(**view, water={**base, name: other}) | mask(**view, water=base)

    assert furthest(plain, changed, region) > 3
    assert name == "as_published" or furthest(plain, changed, ~region) == 0


def metric(name: str, value: float) -> float:
    """What a parameter is there for, measured in the picture."""
    sky = {"model": "gradient", "horizon": [0.9, 0.9, 0.9], "zenith": [0.0, 0.0, 0.0]}
    water = {**BARE, "extents": OPEN, "wave_length": 0.001, "draw_mode": 0.5, name: value}
    if name.startswith("spec"):
        water |= {"draw_mode": 0.0, "wave_height": 0.05, "spec_alpha": value if name == "spec_alpha" else 0.6}
    if name.startswith("wave_"):
        water |= {"draw_mode": 100.0, "wave_height": value if name == "wave_height" else 0.2}
    fields: dict[str, Any] = {"scene": EMPTY, "sky": sky, "camera": TOWARDS}
    if name == "draw_mode":
        return float(drawn(**PLAIN, **fields, water=water, layers=["reflection_weight"]).color.mean())
    shown = linear(picture(**fields, water=water))
    if name == "wave_length":
        return -float(np.abs(np.diff(shown, axis=1)).mean())
    if name == "dull_blend_factor":
        return -float(np.abs(shown - lake_dull()).mean())
    base = linear(picture(**fields, water={**water, name: 0.0}))
    return float(np.abs(shown - base).mean())


def lake_dull() -> Floats:
    return linear(255 * np.array(lake.DULL))


@pytest.mark.parametrize(
    ("name", "sweep"),
    [
        ("draw_mode", [0.0, 0.5, 1.0, 2.0, 9.0]),
        ("wave_height", [0.0, 0.02, 0.05, 0.1, 0.2]),
        ("wave_length", [0.001, 0.002, 0.004, 0.008]),
        ("dull_blend_factor", [0.0, 0.25, 0.5, 1.0]),
        ("spec_alpha", [0.0, 0.2, 0.6, 1.0]),
        ("spec_perturb", [0.0, 0.5, 1.0, 2.0]),
    ],
)
def test_each_control_is_monotone_and_nothing_at_zero(name: str, sweep: list[float]) -> None:
    measured = [metric(name, value) for value in sweep]

    assert (np.diff(measured) > 0).all()
    if sweep[0] == 0 and name != "dull_blend_factor":
        assert measured[0] == 0


def test_a_higher_power_makes_a_smaller_highlight() -> None:
    sizes = [glint(power, as_published=True).mean() for power in (5.0, 20.0, 100.0, 364.0)]

    assert (np.diff(sizes) < 0).all()


@pytest.mark.parametrize(
    ("field", "value", "bound"),
    [
        ("fresnel_mode", 3, "0, 1 or 2"),
        ("draw_mode", -0.1, ">= 0"),
        ("wave_length", 0.0, ">= 0.0001"),
        ("spec_power", 0.0, "> 0"),
        ("dull_blend_factor", 1.01, "<= 1"),
        ("light_direction", [0.0, 0.0, 0.0], "length > 0"),
    ],
)
@pytest.mark.parametrize("technique", ["lake", "lake_edges"])
def test_a_value_out_of_bounds_is_named_with_its_bound(technique: str, field: str, value: Any, bound: str) -> None:
    with pytest.raises(InvalidRequest) as raised:
        asked(water={"technique": technique, field: value})
    problem = raised.value.problems[0]

    assert (problem.path, problem.value) == (f"water.{field}", value)
    assert bound in (problem.bound or "")
