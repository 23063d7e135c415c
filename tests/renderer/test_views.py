"""Sub-frames, smooth edges, tiles, and cameras and values of every legal kind."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from renderer.errors import FieldProblem, InvalidRequest
from renderer.pipeline import halton
from renderer.request import FrameRequest
from tests.reference import tonemap
from tests.renderer.drawing import (
    EYE,
    PLAIN,
    SIZE,
    WINDOW,
    Picture,
    asked,
    drawn,
    furthest,
    inside,
    linear,
    mask,
    picture,
    shared_renderer,
)
from tests.renderer.world import DRY, NAME

pytestmark = pytest.mark.usefixtures("world")

DRY_SCENE: dict[str, Any] = {"water": {"extents": DRY}}


# ------------------------------------------------------------------------------------------------- sub-frames and edges

K = {"fx": 130.0, "fy": 130.0, "cx": 80.0, "cy": 45.0}


def average_error(samples: int, average: Any) -> float:
    """How far a frame of several samples is from single frames with moved principal points, averaged."""
    dim = {"tonemap": {"operator": "none", "exposure": -1.0}, "ambient": [0.25] * 3}
    whole = picture(camera={**EYE, "intrinsics": K}, samples=samples, **dim)
    parts = []
    for i in range(1, samples + 1):
        moved = {**K, "cx": K["cx"] - (halton(i, 2) - 0.5), "cy": K["cy"] - (halton(i, 3) - 0.5)}
        parts.append(picture(camera={**EYE, "intrinsics": moved}, **dim))
    return float(np.abs(whole - average(parts)).max())


def test_samples_are_averaged_in_linear_light() -> None:
    assert average_error(4, lambda parts: 255 * tonemap.srgb(np.mean([linear(p) for p in parts], axis=0))) < 1.6


def test_an_average_of_encoded_values_fails() -> None:
    assert average_error(4, lambda parts: np.mean(parts, axis=0)) > 5


def test_sub_frames_are_spread_over_the_open_shutter() -> None:
    still = picture(samples=4, time=0.0)
    blurred = picture(samples=4, time=0.0, shutter=1.0)
    water = mask()

    assert furthest(still, blurred, water) > 10
    assert furthest(picture(samples=1, shutter=1.0), picture(samples=1)) == 0


def test_halton_is_the_radical_inverse() -> None:
    assert [halton(i, 2) for i in range(1, 6)] == [0.5, 0.25, 0.75, 0.125, 0.625]
    assert [halton(i, 3) for i in range(1, 4)] == pytest.approx([1 / 3, 2 / 3, 1 / 9])


def test_msaa_smooths_edges_and_leaves_surfaces_as_they_are() -> None:
    hard, smooth = picture(**DRY_SCENE, msaa=1), picture(**DRY_SCENE, msaa=4)
    flat = np.ones(hard.shape[:2], bool)
    steps = np.abs(np.diff(hard.astype(int), axis=0)).max(-1) > 6, np.abs(np.diff(hard.astype(int), axis=1)).max(-1) > 6
    flat[1:] &= ~steps[0]
    flat[:-1] &= ~steps[0]
    flat[:, 1:] &= ~steps[1]
    flat[:, :-1] &= ~steps[1]
    flat = inside(flat)
    apart = np.abs(hard.astype(int) - smooth).max(axis=-1)

    assert flat.mean() > 0.5
    assert (apart > 1)[flat].mean() < 0.005
    assert (apart > 1)[~flat].mean() > 0.1
    assert len(np.unique(smooth.reshape(-1, 3), axis=0)) > len(np.unique(hard.reshape(-1, 3), axis=0))


# ------------------------------------------------------------------------------------------------ cameras of every kind


def whole_and_tiled(water: dict[str, Any], split: tuple[int, int]) -> tuple[Picture, Picture]:
    """A picture in one piece and in four, cut at a pixel."""
    still = {**water, "ripple_scale": [0, 0]}
    whole = picture(camera={**EYE, "intrinsics": K}, water=still)
    tiled = np.zeros_like(whole)
    columns, rows = ((0, split[0], SIZE[0]), (0, split[1], SIZE[1]))
    for left, right in pairwise(columns):
        for top, bottom in pairwise(rows):
            lens = {**K, "cx": K["cx"] - left, "cy": K["cy"] - top}
            tiled[top:bottom, left:right] = picture(
                camera={**EYE, "intrinsics": lens}, width=right - left, height=bottom - top, water=still
            )
    return whole, tiled


@pytest.mark.parametrize("water", [{}, WINDOW], ids=["rippled", "flat"])
def test_four_tiles_off_the_axis_make_the_whole(water: dict[str, Any]) -> None:
    assert furthest(*whole_and_tiled(water, (80, 46))) <= 1


def test_tiles_cut_at_odd_pixels_differ_in_levels_of_detail_alone() -> None:
    """Derivatives are of blocks of 2 x 2 pixels: an odd cut pairs other rows, it shows where textures are oblique."""
    whole, tiled = whole_and_tiled({}, (80, 45))

    assert furthest(whole, tiled) <= 10
    assert (np.abs(whole.astype(int) - tiled).max(-1) > 1).mean() < 0.01


@pytest.mark.parametrize(
    "fields",
    [
        {"camera": {**EYE, "fov_y": 150.0}},
        {"camera": {**EYE, "fov_y": 2.0}},
        {"camera": {**EYE, "fov_y": 175.0}},
        {"camera": {**EYE, "fov_y": 0.1}},
        {"camera": {**EYE, "orthographic": {"height": 12.0}}},
        {"camera": {**EYE, "orthographic": {"height": 1e-3}}},
        {"width": 45, "height": 160},
        {"width": 1, "height": 1},
        {"width": 300, "height": 2},
        {"camera": {"eye": [0.0, 9.0, 0.01], "target": [0.0, 0.0, 0.0], "up": [0.0, 0.0, -1.0]}},
        {"camera": {"eye": [3.0, -1.0, 3.0], "target": [0.0, 3.0, 0.0]}},
        {"camera": {"eye": [3.0, -1.0, 3.0], "target": [0.0, -3.0, 0.0]}},
        {"camera": {**EYE, "near": 5.0, "far": 12.0}},
        {"camera": {**EYE, "near": 1e-6, "far": 1e7}},
        {"camera": {"eye": [9e6, 9e6, 9e6], "target": [0.0, 0.0, 0.0]}},
        {"camera": {"position": [0.0, 5.0, 20.0], "yaw": 1e300, "roll": -1e300}},
        {"water": {"extents": [-1e7, 1e7, -1e7, 1e7]}},
        {"water": {"level": 1e5}},
        {"water": {"level": -1e5}},
        {"water": {"ripple_height": 8.0, "ripple_scale": [1e7, -1e7]}},
        {"water": {"tile_0": 1e-3, "velocity_0": [1e7, 1e7]}, "time": 1e7},
        {"fog": {"density": 100.0, "height_falloff": 100.0}},
        {"fog": {"density": 0.02, "height_falloff": 0.0}, "camera": {**EYE, "orthographic": {"height": 12.0}}},
        {"time": -1e7, "period": 1e-3},
    ],
)
@pytest.mark.parametrize("layer", ["color", "reflection_map"])
def test_every_legal_camera_and_value_is_drawn(fields: dict[str, Any], layer: str) -> None:
    request = asked(**{**PLAIN, **fields, "layers": [layer]})
    shown = drawn(**{**PLAIN, **fields, "layers": [layer]}).color

    assert shown.shape == (request.height, request.width, 3)
    assert shown.flags["C_CONTIGUOUS"]


def test_a_wide_picture_holds_the_narrow_one_in_its_middle() -> None:
    wide = picture(camera={**EYE, "intrinsics": {**K, "cx": 160.0, "cy": 90.0}}, width=320, height=180, **DRY_SCENE)
    narrow = picture(camera={**EYE, "intrinsics": K}, **DRY_SCENE)

    assert (np.abs(wide[45:135, 80:240].astype(int) - narrow).max(-1) > 1).mean() < 0.002


def test_the_first_row_is_the_top_one() -> None:
    shown = picture(camera={**EYE, "target": [0.0, 3.2, 0.0]}, **DRY_SCENE)

    assert shown[0, :, 2].mean() > shown[-1, :, 2].mean() + 20, "sky above, ground below"


coordinate = st.floats(-1e7, 1e7)
place = st.lists(coordinate, min_size=3, max_size=3)


@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
@given(
    eye=place, target=place, up=place, extents=st.lists(coordinate, min_size=4, max_size=4), level=st.floats(-1e6, 1e6)
)
def test_huge_numbers_are_refused_with_a_bound_or_drawn(
    eye: list[float], target: list[float], up: list[float], extents: list[float], level: float
) -> None:
    fields = {"camera": {"eye": eye, "target": target, "up": up}, "water": {"extents": extents, "level": level}}
    refused: tuple[FieldProblem, ...] = ()
    try:
        shown = shared_renderer().render(FrameRequest.parse({"scene": NAME, "width": 32, "height": 18, **fields}))
    except InvalidRequest as error:
        refused = error.problems

    assert all(problem.path.startswith(("camera", "water")) for problem in refused)
    assert refused or shown.color.shape == (18, 32, 3)
