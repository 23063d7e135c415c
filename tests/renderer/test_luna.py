"""Luna's water in the picture: the weight, the ripples, the light, the time. Rows of Luna 2006 by their numbers.

Each check is seen to fail where the shader is broken in the way that it is there to catch.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene.material import Texture
from renderer.water.luna import Luna
from tests.reference import fresnel, microfacet, normals, tonemap
from tests.renderer.drawing import (
    FLAT,
    MIRROR,
    PLAIN,
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
from tests.renderer.world import DRY, EMPTY, LEVEL

pytestmark = pytest.mark.usefixtures("world")

Floats = NDArray[np.float64]
STEEP: dict[str, Any] = {"eye": [1.0, 8.0, 7.0], "target": [0.0, 0.0, 0.5], "fov_y": 60}
GRAZING: dict[str, Any] = {"eye": [0.0, 0.8, 12.0], "target": [0.0, 0.3, 0.0], "fov_y": 60}
OPEN = [-4000.0, 4000.0, -4000.0, 4000.0]


def views(camera: dict[str, Any]) -> Floats:
    """The unit vector from each pixel's place on the water towards the eye, (h, w, 3)."""
    request = asked(camera=camera)
    view = request.view()
    across = (np.arange(request.width) + 0.5) / request.width * 2 - 1
    down = 1 - (np.arange(request.height) + 0.5) / request.height * 2
    x, y = np.meshgrid(across, down)
    rays = np.stack([x, y, np.ones_like(x), np.zeros_like(x)], axis=-1) @ view.ray_from_ndc.T
    return -normals.unit(rays[..., :3])


# ------------------------------------------------------------------------------------------------------- L10, L11: the weight


def weight_error(bias: float, power: float, camera: dict[str, Any]) -> float:
    """The largest difference of the weight's picture from the formula at each pixel's own angle, in steps of 255."""
    water = {**FLAT, "refraction_bias": bias, "refraction_power": power}
    shown = drawn(**PLAIN, camera=camera, water=water, layers=["reflection_weight"]).color
    expected = fresnel.luna_reflection_weight(views(camera)[..., 1], bias, power)
    region = mask(camera=camera)
    assert region.sum() > 3000
    assert (shown[~region] == 0).all()
    return float(np.abs(shown - 255 * expected[..., None])[region].max())


WEIGHTS = [(0.1, 2.0), (0.0, 1.0), (-0.3, 1.0), (-0.25, 3.0), (0.4, 0.5), (0.0, 12.0)]


@pytest.mark.parametrize("camera", [STEEP, GRAZING, {**STEEP, "orthographic": {"height": 9.0}, "fov_y": None}])
@pytest.mark.parametrize(("bias", "power"), WEIGHTS)
def test_the_weight_is_the_formula_at_every_pixel(bias: float, power: float, camera: dict[str, Any]) -> None:
    assert weight_error(bias, power, camera) <= 0.58


def test_a_negative_bias_reflects_everything_before_grazing() -> None:
    water = {**FLAT, "refraction_bias": -0.3, "refraction_power": 1.0}
    shown = drawn(**PLAIN, camera=GRAZING, water=water, layers=["reflection_weight"]).color
    cosine = views(GRAZING)[..., 1]

    assert (shown[mask(camera=GRAZING) & (cosine > 0) & (cosine < 0.29)] == 255).all()


CLAMP = "clamp(bias + pow(max(NoV, 0.0), power), 0.0, 1.0)"


@pytest.mark.parametrize(
    ("bias", "broken"),
    [
        (-0.3, "max(bias, 0.0) + pow(max(NoV, 0.0), power)"),
        (0.4, "bias * pow(max(NoV, 0.0), power)"),
        (0.1, "bias + (1.0 - bias) * pow(max(NoV, 0.0), power)"),
    ],
)
def test_another_weight_fails(bias: float, broken: str) -> None:
    with broken_shaders({"lib/fresnel.glsl": (CLAMP, broken)}):
        assert weight_error(bias, 1.0, STEEP) > 10


# ----------------------------------------------------------------------------------------------------- L6 to L8: the ripples


@pytest.fixture
def tilt(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Gives both ripple maps one slope everywhere; returns the normal that they mean."""

    def set_slope(x: float, z: float, *, opposite: bool = False) -> Floats:
        def slopes(number: int) -> Texture:
            sign = -1.0 if opposite and number % 2 else 1.0
            image = np.broadcast_to(np.array([sign * x, sign * z], np.float32), (4, 4, 2)).copy()
            return Texture(f"slope {sign * x} {sign * z}", image)

        monkeypatch.setattr("renderer.water.luna.ripple_slopes", slopes)
        return normals.of_slope(np.array([x, z]))

    yield set_slope


SLOPE = 33 / 128
"""A slope that a half float holds exactly."""


def shifted(plain: NDArray[np.uint8], right: float, down: Floats) -> Floats:
    """Where each pixel reads a picture that is read farther right and down, in linear light; beyond the edge: the edge."""
    light = linear(plain)
    height, width, _ = light.shape
    x = np.clip(np.arange(width) + right, 0, width - 1)
    y = np.clip(np.arange(height) + down, 0, height - 1)
    x0, y0 = np.minimum(x.astype(int), width - 2), np.minimum(y.astype(int), height - 2)
    fx, fy = (x - x0)[None, :, None], (y - y0)[:, None, None]
    rows = light[y0] * (1 - fy) + light[y0 + 1] * fy
    return np.asarray(rows[:, x0] * (1 - fx) + rows[:, x0 + 1] * fx)


def shift_error(water: dict[str, Any], layer: str, tilted: Floats, scale: tuple[float, float]) -> float:
    """How far ripples of one tilt are from one shift of the map by scale times the normal, damped, in steps of 255."""
    request = asked()
    flat = {**water, "ripple_scale": [0, 0], "ripple_height": 0.0}
    plain = picture(camera=STEEP, water=flat, layers=[layer])
    shown = picture(camera=STEEP, water={**water, "ripple_scale": list(scale), "ripple_height": 1.0})
    v = (np.arange(request.height) + 0.5) / request.height
    down = tilted[2] * scale[1] * normals.bottom_damping(v) * request.height
    right = float(tilted[0] * scale[0] * request.width)
    expected = 255 * tonemap.srgb(shifted(plain, right, down))
    reach = int(np.ceil(max(abs(right), np.abs(down).max()))) + 2
    region = inside(mask(camera=STEEP), reach)
    region[:, :reach] = region[:, -reach:] = False
    region[:reach] = False
    assert region.sum() > 2500
    assert furthest(shown, picture(camera=STEEP, water=flat), region) > 50, "the ripples do something"
    return float(np.abs(shown - expected).max(axis=-1)[region].max())


@pytest.mark.parametrize(("water", "layer"), [(WINDOW, "refraction_map"), (MIRROR, "reflection_map")])
@pytest.mark.parametrize(
    ("slope", "pixels"),
    [((SLOPE, 0.0), (8, 0)), ((-SLOPE, 0.0), (6, 0)), ((0.0, SLOPE), (0, 4)), ((0.0, -SLOPE), (0, 5))],
)
def test_one_tilt_shifts_the_map_by_scale_times_normal(
    tilt: Any, water: dict[str, Any], layer: str, slope: tuple[float, float], pixels: tuple[int, int]
) -> None:
    n = tilt(*slope)
    scale = (pixels[0] / 160 / max(abs(n[0]), 1e-9), pixels[1] / 90 / max(abs(n[2]), 1e-9))

    assert shift_error(water, layer, n, scale) <= 1.5


@pytest.mark.parametrize(
    ("slope", "change"),
    [
        ((SLOPE, 0.0), ("n.xz * luna.ripple_scale", "n.zx * luna.ripple_scale")),
        ((SLOPE, 0.0), ("n.xz * luna.ripple_scale", "n.xy * luna.ripple_scale")),
        ((SLOPE, 0.0), ("n.xz * luna.ripple_scale", "0.5 * n.xz * luna.ripple_scale")),
        ((0.0, SLOPE), ("place.y - shift.y", "place.y + shift.y")),
        ((0.0, SLOPE), ("shift.y *= bottom_damping(1.0 - place.y)", "shift.y *= bottom_damping(place.y)")),
    ],
)
def test_another_shift_fails(tilt: Any, slope: tuple[float, float], change: tuple[str, str]) -> None:
    n = tilt(*slope)
    with broken_shaders({"water/luna.glsl": change}):
        assert shift_error(WINDOW, "refraction_map", n, (8 / 160 / 0.25, 4 / 90 / 0.25)) > 10


def test_opposite_tilts_leave_a_flat_mirror(tilt: Any) -> None:
    water = {**MIRROR, "ripple_scale": [0.2, 0.2], "ripple_height": 1.0}
    tilt(SLOPE, -SLOPE, opposite=True)

    assert furthest(picture(water=water), picture(water=MIRROR), mask()) <= 1


def test_ripples_do_not_move_the_picture_as_a_whole() -> None:
    """The .xz of a z-up normal would: the mean offset of Luna's own maps is nothing."""
    view = {**STEEP, "eye": [1.0, 14.0, 7.0]}
    plain = picture(camera=view, water=WINDOW).astype(float)
    mean = np.mean(
        [
            picture(camera=view, water={**WINDOW, "ripple_scale": [0.05, 0.05], "ripple_height": 1.0}, time=t)
            for t in range(16)
        ],
        axis=0,
    )
    region = inside(mask(camera=view), 6)
    errors = {
        step: float(np.abs(mean - np.roll(plain, step, axis=(0, 1)))[region].mean())
        for step in ((0, 0), (2, 0), (-2, 0), (0, 2), (0, -2))
    }

    assert min(errors, key=lambda step: errors[step]) == (0, 0)


# ------------------------------------------------------------------------------------------------- L12: light and material

ZERO, ONE = [0.0] * 3, [1.0] * 3
BLACK: dict[str, Any] = {f"{a}_{b}": ZERO for a in ("material", "light") for b in ("ambient", "diffuse", "specular")}
SUN = {"direction": [0.3, 0.8, 0.5], "shadows": False}
HIGH = 0.8 / np.sqrt(0.98)
"""Sine of that sun's elevation: n.l of flat water."""


@pytest.mark.parametrize(
    ("light", "factor"),
    [
        ({"material_ambient": ONE, "light_ambient": [0.8, 0.4, 0.2]}, [0.8, 0.4, 0.2]),
        ({"material_ambient": [0.3, 0.6, 0.9], "light_ambient": ONE}, [0.3, 0.6, 0.9]),
        ({"material_diffuse": ONE, "light_diffuse": [0.9, 0.5, 0.1]}, [0.9 * HIGH, 0.5 * HIGH, 0.1 * HIGH]),
        ({"material_diffuse": [0.2, 0.4, 0.8], "light_diffuse": ONE}, [0.2 * HIGH, 0.4 * HIGH, 0.8 * HIGH]),
        ({"material_ambient": ONE, "light_diffuse": ONE}, ZERO),
        ({"material_diffuse": ONE, "light_ambient": ONE}, ZERO),
        (
            {
                "material_ambient": [0.5] * 3,
                "light_ambient": [0.4] * 3,
                "material_diffuse": [0.6] * 3,
                "light_diffuse": [0.7] * 3,
            },
            [0.2 + 0.42 * HIGH] * 3,
        ),
    ],
)
def test_each_light_times_its_material_lights_the_blend(light: dict[str, Any], factor: list[float]) -> None:
    water = {**FLAT, **BLACK, **light, "refraction_bias": 0.1}
    blend = linear(picture(water={**FLAT, "refraction_bias": 0.1}, sun=SUN))
    expected = 255 * tonemap.srgb(np.clip(blend * factor, 0, 1))
    shown = picture(water=water, sun=SUN)

    assert (np.abs(shown - expected)[mask()] <= 1.6).all()


def test_the_suns_own_brightness_does_not_dim_the_documents_light() -> None:
    water = {**WINDOW, **BLACK, "material_diffuse": ONE, "light_diffuse": ONE}
    dark = {**SUN, "intensity": 0.25}
    bright = linear(picture(scene=EMPTY, water=water, sun=SUN, sky="constant", camera=STEEP))
    dim = linear(picture(scene=EMPTY, water=water, sun=dark, sky="constant", camera=STEEP))

    assert np.abs(bright - dim).max() < 1e-6


def glint(direction: list[float], camera: dict[str, Any], power: float, **fields: Any) -> Floats:
    """The picture of the sun's glint alone, in linear light."""
    water = {**FLAT, **BLACK, "material_specular": [0.9, 0.6, 0.3], "light_specular": ONE, "specular_power": power}
    sun = {"direction": direction, "shadows": False}
    return linear(picture(scene=EMPTY, camera=camera, sun=sun, water={**water, "extents": OPEN}, **fields))


@pytest.mark.parametrize("power", [4.0, 60.0, 200.0])
def test_the_glint_is_phongs_lobe_about_the_mirrored_sun(power: float) -> None:
    direction = [-0.1, 0.8, -0.6]
    view = views(STEEP)
    up = np.broadcast_to([0.0, 1.0, 0.0], view.shape)
    lobe = microfacet.phong(up, np.broadcast_to(normals.unit(direction), view.shape), view, power)
    expected = 255 * tonemap.srgb(lobe[..., None] * [0.9, 0.6, 0.3])
    shown = 255 * tonemap.srgb(glint(direction, STEEP, power))

    assert expected.max() > 100
    assert np.abs(shown - expected).max() <= 1.0


@pytest.mark.parametrize("direction", [[-0.1, -0.01, -0.6], [-0.1, 0.0, -0.6], [0.0, -1.0, 0.0]])
def test_a_sun_below_the_water_has_no_glint_and_no_diffuse_light(direction: list[float]) -> None:
    water = {**WINDOW, **BLACK, "material_diffuse": ONE, "light_diffuse": ONE, "extents": OPEN}
    sun = {"direction": direction, "shadows": False}

    assert glint(direction, GRAZING, 1.0).max(where=(views(GRAZING)[..., 1] > 0)[..., None], initial=0) == 0
    assert picture(scene=EMPTY, camera=STEEP, sun=sun, water=water).max() == 0


def test_a_glint_from_behind_is_caught() -> None:
    guard = "NoL > 0.0 ? pow(max(dot(mirrored, v), 0.0), power) : 0.0"
    with broken_shaders({"lib/microfacet.glsl": (guard, "pow(abs(dot(mirrored, v)), power)")}):
        assert glint([-0.1, -0.01, -0.6], GRAZING, 1.0).max() > 0.1


def test_no_sun_is_neither_diffuse_light_nor_glint() -> None:
    water = {**WINDOW, **BLACK, "material_ambient": ONE, "light_ambient": ONE}
    lit = {**water, "material_diffuse": ONE, "light_diffuse": ONE, "material_specular": ONE, "light_specular": ONE}

    assert furthest(picture(water=water, sun=None), picture(water=lit, sun=None)) == 0
    assert furthest(picture(water=water, sun=SUN), picture(water=lit, sun=SUN)) > 50


# --------------------------------------------------------------------------------------------- L1, L18: parameters and figures

OTHER: dict[str, Any] = {
    "level": LEVEL + 0.4,
    "extents": [-8.0, 8.0, -8.0, 8.0],
    "ripple_scale": [0.02, 0.09],
    "refraction_bias": -0.2,
    "refraction_power": 5.0,
    "tile_0": 7.0,
    "tile_1": 5.0,
    "velocity_0": [0.2, 0.1],
    "velocity_1": [0.1, -0.2],
    "ripple_height": 2.0,
    "material_ambient": [0.1, 0.5, 0.9],
    "material_diffuse": [0.3, 0.5, 0.9],
    "material_specular": [0.9, 0.1, 0.1],
    "specular_power": 20.0,
    "light_ambient": [0.2, 0.5, 0.9],
    "light_diffuse": [0.2, 0.5, 0.9],
    "light_specular": [0.1, 0.5, 0.9],
}


@pytest.mark.parametrize("name", sorted(set(Luna.model_fields) - {"technique"}))
def test_every_parameter_changes_the_water_and_nothing_else(name: str) -> None:
    glittering = {"direction": [-5.0, 4.0, -8.0], "shadows": False}
    view = {**PLAIN, "sun": glittering, "time": 2.0}
    region = mask(time=2.0, water={name: OTHER[name]}) | mask(time=2.0)
    plain, other = (picture(**view, water=water) for water in ({}, {name: OTHER[name]}))

    assert furthest(plain, other, region) > 3
    assert furthest(plain, other, ~region) == 0


def test_the_figures_of_the_document_can_be_asked_for() -> None:
    rippled, still = picture(), picture(water={"ripple_height": 0.0})
    water = mask()

    assert furthest(rippled, still, water) > 30
    assert furthest(rippled, still, ~water) == 0
    assert furthest(picture(layers=["refraction_map"]), picture(water={"extents": DRY})) == 0
    assert furthest(picture(layers=["reflection_map"]), picture(layers=["refraction_map"])) > 100
    assert drawn(**PLAIN, layers=["reflection_weight"]).color[water].max() > 100


def test_ripples_are_sown_by_the_seed() -> None:
    assert furthest(picture(seed=0), picture(seed=1), mask()) > 20
    assert furthest(picture(seed=0), picture(seed=1), ~mask()) == 0
