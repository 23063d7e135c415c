"""Luna's water in the picture: the weight, the ripples, the light, the time. Rows of Luna 2006 by their numbers.

Each check is seen to fail where the shader is broken in the way that it is there to catch.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene.material import Texture
from tests.reference import fresnel, normals, tonemap
from tests.renderer.drawing import (
    FLAT,
    GRAZING,
    MIRROR,
    PLAIN,
    STEEP,
    WINDOW,
    Floats,
    asked,
    broken_shaders,
    drawn,
    furthest,
    inside,
    linear,
    mask,
    picture,
    views,
)

pytestmark = pytest.mark.usefixtures("world")


# ------------------------------------------------------------------------------------------------- L10, L11: the weight


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


# ------------------------------------------------------------------------------------------------ L6 to L8: the ripples


@pytest.fixture
def tilt(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Gives both ripple maps one slope everywhere; returns the normal that they mean."""

    def set_slope(x: float, z: float, *, opposite: bool = False) -> Floats:
        def slopes(number: int) -> Texture:
            sign = -1.0 if opposite and number % 2 else 1.0
            image = np.broadcast_to(np.array([sign * x, sign * z], np.float32), (4, 4, 2)).copy()
            return Texture(f"slope {sign * x} {sign * z}", image)

        monkeypatch.setattr("renderer.water.luna.ripple_slopes", slopes)
        return normals.of_slope(np.array([x, z]))

    return set_slope


SLOPE = 33 / 128
"""A slope that a half float holds exactly."""


def shifted(plain: NDArray[np.uint8], right: float, down: Floats) -> Floats:
    """Where each pixel reads a picture that is read farther right and down, in linear light, clamped to its edge."""
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
