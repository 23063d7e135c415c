"""Frames that can be checked by hand: the shading rule, sub-frames, edges, tiles, and cameras of every kind."""

from __future__ import annotations

from itertools import count
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.errors import Cancelled
from renderer.pipeline import Renderer
from renderer.scene.catalogue import SCENES
from renderer.scene.material import Material
from renderer.scene.mesh import Mesh
from renderer.scene.scene import SceneObject
from tests.reference import normals, tonemap
from tests.renderer.drawing import (
    PLAIN,
    SIZE,
    asked,
    broken_shaders,
    drawn,
    furthest,
    linear,
    mask,
    picture,
)
from tests.renderer.world import DRY, LEVEL, entry_of

pytestmark = pytest.mark.usefixtures("world")

Floats = NDArray[np.float64]
DRY_SCENE: dict[str, Any] = {"water": {"extents": DRY}}


# ----------------------------------------------------------------------------------------------------- the shading rule

NUMBERS = count()  # the renderer keeps scenes by their names
ALBEDO, TINT = (0.8, 0.35, 0.06), (0.5, 0.9, 0.7)
FRONT: dict[str, Any] = {"eye": [0.0, 0.0, 1.0], "target": [0.0, 0.0, 0.0]}


@pytest.fixture
def facing(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Makes a scene of one quad that fills the picture, with this normal."""

    def make(normal: Floats) -> str:
        corners = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], float)
        color = np.tile([*TINT, 0.0], (4, 1))
        mesh = Mesh.build(corners, np.array([[0, 1, 2], [0, 2, 3]]), normal=np.tile(normal, (4, 1)), color=color)
        name = f"test facing {next(NUMBERS)}"
        monkeypatch.setitem(SCENES, name, entry_of(name, (SceneObject("quad", mesh, Material("grey", albedo=ALBEDO)),)))
        return name

    return make


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


LENSES = [{"fov_y": 1.0}, {"orthographic": {"height": 0.2}}]


@pytest.mark.parametrize("lens", LENSES, ids=["pinhole", "parallel"])
@pytest.mark.parametrize("distance", [0.5, 4.0, 30.0])
def test_fog_takes_light_by_the_way_through_it(facing: Any, lens: dict[str, Any], distance: float) -> None:
    mist = {"color": [0.6, 0.7, 0.8], "density": 0.05, "height_falloff": 0.0}
    camera = {"eye": [0.0, 0.0, distance], "target": [0.0, 0.0, 0.0], **lens}
    shown = picture(
        scene=facing(np.array([0.0, 0.0, 1.0])), camera=camera, sun=None, ambient=[0.5] * 3, fog=mist, **DRY_SCENE
    )
    through = np.exp(-0.05 * distance)
    expected = 255 * tonemap.srgb(np.array(ALBEDO) * TINT * 0.5 * through + np.array(mist["color"]) * (1 - through))

    assert np.abs(shown - expected).max() <= 0.6


def test_exposure_counts_in_stops() -> None:
    one = linear(picture(tonemap={"operator": "none", "exposure": -2.0}))
    two = linear(picture(tonemap={"operator": "none", "exposure": -3.0}))
    dark = one < 0.9

    assert np.abs(one - 2 * two)[dark].max() < 0.02


# ----------------------------------------------------------------------------------------------------- the frame itself


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
