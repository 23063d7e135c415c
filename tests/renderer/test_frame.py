"""Frames that can be checked by hand: the shading rule, sub-frames, edges, tiles, and cameras of every kind."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.errors import Cancelled, InvalidRequest
from renderer.pipeline import Renderer, halton
from renderer.request import FrameRequest
from renderer.scene.catalogue import SCENES
from renderer.scene.material import Material
from renderer.scene.mesh import Mesh
from renderer.scene.scene import SceneObject
from tests.reference import normals, tonemap
from tests.renderer.drawing import (
    PLAIN,
    SIZE,
    WINDOW,
    asked,
    broken_shaders,
    drawn,
    furthest,
    inside,
    linear,
    mask,
    picture,
)
from tests.renderer.world import DRY, LEVEL, NAME, entry_of

pytestmark = pytest.mark.usefixtures("world")

Floats = NDArray[np.float64]
DRY_SCENE: dict[str, Any] = {"water": {"extents": DRY}}


# ------------------------------------------------------------------------------------------------------ the shading rule

NUMBERS = count()  # the renderer keeps scenes by their names
ALBEDO, TINT = (0.8, 0.35, 0.06), (0.5, 0.9, 0.7)
FRONT: dict[str, Any] = {"eye": [0.0, 0.0, 1.0], "target": [0.0, 0.0, 0.0]}


@pytest.fixture
def facing(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Makes a scene of one quad that fills the picture, with this normal."""

    def make(normal: Floats) -> str:
        corners = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], float)
        color = np.tile([*TINT, 0.0], (4, 1))
        mesh = Mesh.build(corners, np.array([[0, 1, 2], [0, 2, 3]]), normal=np.tile(normal, (4, 1)), color=color)
        name = f"test facing {next(NUMBERS)}"
        monkeypatch.setitem(SCENES, name, entry_of(name, (SceneObject("quad", mesh, Material("grey", albedo=ALBEDO)),)))
        return name

    yield make


def shading_error(scene: str, normal: Floats, sun: dict[str, Any] | None, ambient: list[float]) -> float:
    """How far the picture's bytes are from the rule of the contract, in steps of 255; 0.5 is rounding."""
    shown = picture(scene=scene, camera=FRONT, sun=sun, ambient=ambient, fog=None, **DRY_SCENE, width=16, height=9)
    radiance = np.array(ambient)
    if sun is not None:
        facing_sun = max(0.0, float(normals.unit(normal) @ normals.unit(sun["direction"])))
        radiance = radiance + np.array(sun["color"]) * sun["intensity"] * facing_sun
    expected = 255 * tonemap.srgb(np.clip(np.array(ALBEDO) * TINT * radiance, 0, 1))
    assert np.ptp(shown.reshape(-1, 3), axis=0).max() == 0, "one colour everywhere"
    return float(np.abs(shown[0, 0] - expected).max())


SUNS: list[dict[str, Any] | None] = [
    None,
    {"direction": [0.0, 0.0, 1.0], "color": [1.0, 1.0, 1.0], "intensity": 1.0, "shadows": False},
    {"direction": [3.0, 4.0, 5.0], "color": [1.0, 0.8, 0.4], "intensity": 1.5, "shadows": False},
    {"direction": [-1.0, -2.0, 0.5], "color": [0.5, 0.8, 1.0], "intensity": 3.0, "shadows": False},
    {"direction": [0.2, 0.3, -1.0], "color": [1.0, 1.0, 1.0], "intensity": 2.0, "shadows": False},
]
NORMALS = [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [-0.3, 0.7, 0.4], [0.1, -0.9, 0.2]]


@pytest.mark.parametrize("sun", SUNS)
@pytest.mark.parametrize("normal", NORMALS)
def test_a_matte_surface_has_the_colour_that_the_rule_gives(
    facing: Any, normal: list[float], sun: dict[str, Any] | None
) -> None:
    n = normals.unit(normal)

    assert shading_error(facing(n), n, sun, [0.22, 0.25, 0.30]) <= 0.56
    assert shading_error(facing(n), n, sun, [0.0, 0.0, 0.0]) <= 0.56


SRGB = "srgb_from_linear(min(c, vec3(1.0)))"


@pytest.mark.parametrize(
    ("file", "change"),
    [
        ("passes/scene.frag", ("max(NoL, 0.0)", "abs(NoL)")),
        ("passes/scene.frag", ("vec3 n = normalize(normal_world)", "vec3 n = -normalize(normal_world)")),
        ("passes/composite.frag", (SRGB, "srgb_from_linear(srgb_from_linear(min(c, vec3(1.0))))")),
        ("passes/composite.frag", (SRGB, "pow(min(c, vec3(1.0)), vec3(1.0 / 2.2))")),
    ],
)
def test_another_rule_fails(facing: Any, file: str, change: tuple[str, str]) -> None:
    with broken_shaders({file: change}):
        errors = [
            shading_error(facing(normals.unit(n)), normals.unit(n), sun, [0.22, 0.25, 0.3])
            for n in NORMALS
            for sun in SUNS[2:]
        ]
    assert max(errors) > 2


def test_brightness_past_white_is_white_and_no_operator_dithers_none(facing: Any) -> None:
    scene = facing(np.array([0.0, 0.0, 1.0]))
    bright = {**PLAIN, "scene": scene, "camera": FRONT, **DRY_SCENE}

    assert (drawn(**bright, ambient=[1e4] * 3, sun=None).color == 255).all()
    grey = drawn(**bright, ambient=[0.2] * 3, sun=None).color
    assert len(np.unique(grey[..., 0])) == 1
    dithered = drawn(**{**bright, "tonemap": "aces"}, ambient=[0.2] * 3, sun=None).color
    assert 1 < len(np.unique(dithered[..., 0])) <= 3


def test_the_brightest_light_that_may_be_asked_for_is_white_not_black() -> None:
    blinding = {"sun": {"direction": [1, 2, 1], "color": [1e4] * 3, "intensity": 1000.0}, "ambient": [1e4] * 3}

    for operator in ("none", "reinhard", "aces", "agx"):
        shown = drawn(**blinding, tonemap={"operator": operator, "exposure": 4.0}, msaa=1).color
        assert shown[-30:].min() > 200, operator


def test_exposure_counts_in_stops() -> None:
    one = linear(picture(tonemap={"operator": "none", "exposure": -2.0}))
    two = linear(picture(tonemap={"operator": "none", "exposure": -3.0}))
    dark = one < 0.9

    assert np.abs(one - 2 * two)[dark].max() < 0.02


# -------------------------------------------------------------------------------------------------- sub-frames and edges

K = {"fx": 130.0, "fy": 130.0, "cx": 80.0, "cy": 45.0}
EYE: dict[str, Any] = {"eye": [7.0, 3.2, 9.0], "target": [0.0, 0.3, 0.0]}


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


# ------------------------------------------------------------------------------------------------------- cameras of every kind


@pytest.mark.parametrize("water", [{}, WINDOW], ids=["rippled", "flat"])
def test_four_tiles_off_the_axis_make_the_whole(water: dict[str, Any]) -> None:
    whole = picture(camera={**EYE, "intrinsics": K}, water={**water, "ripple_scale": [0, 0]})
    tiled = np.zeros_like(whole)
    for x in (0, 80):
        for y in (0, 45):
            lens = {**K, "cx": K["cx"] - x, "cy": K["cy"] - y}
            tile = picture(
                camera={**EYE, "intrinsics": lens}, width=80, height=45, water={**water, "ripple_scale": [0, 0]}
            )
            tiled[y : y + 45, x : x + 80] = tile
    apart = np.abs(whole.astype(int) - tiled).max(-1) > 1

    assert apart.mean() < 0.002, "an edge may fall on the other side of a pixel's centre"


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
    try:
        request = FrameRequest.parse({"scene": NAME, "width": 32, "height": 18, **fields})
    except InvalidRequest as refused:
        assert all(problem.path.startswith(("camera", "water")) for problem in refused.problems)
        return
    assert drawn(**request.model_dump(mode="json", include={"camera", "water"}), width=32, height=18).color.shape == (
        18,
        32,
        3,
    )


# -------------------------------------------------------------------------------------------------------- the frame itself


def test_a_frame_names_its_driver_and_holds_its_layer(renderer: Renderer) -> None:
    frame = drawn(layers=["water_mask"])

    assert frame.renderer == renderer.driver
    assert frame.layers["water_mask"] is frame.color
    assert frame.color.dtype == np.uint8
    assert frame.timings["render"] > 0


def test_a_frame_that_nobody_waits_for_stops_between_samples(renderer: Renderer) -> None:
    asked_for = iter([False, False, True])
    request = asked(samples=8)

    with pytest.raises(Cancelled):
        renderer.render(request, is_cancelled=lambda: next(asked_for))
    assert furthest(renderer.render(request).color, renderer.render(request).color) == 0


def test_passes_are_measured_where_that_is_asked_for() -> None:
    with Renderer(measures_passes=True) as measuring:
        frame = measuring.render(asked(width=64, height=36))
    assert set(frame.timings) == {"shadow", "sky", "scene", "maps", "water", "composite", "render"}
    assert all(seconds >= 0 for seconds in frame.timings.values())


def test_the_water_lies_at_its_level() -> None:
    request = asked()
    middle = request.view().project(np.array([[4.0, LEVEL, 5.0]]))[0]
    x, y = (middle[0] + 1) / 2 * SIZE[0], (1 - middle[1]) / 2 * SIZE[1]

    assert mask()[int(y), int(x)]
    assert not mask(water={"level": -3.0}).any()
