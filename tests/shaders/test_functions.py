"""Each GLSL function against its twin, which knows the source and not the shader."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.light import Fog, LightBlock
from renderer.units import srgb_from_linear
from tests.reference import fog, fresnel, microfacet, normals, projection, tonemap
from tests.shaders.calling import call

Floats = NDArray[np.float64]


def off(expected: NDArray[np.floating], actual: NDArray[np.floating]) -> float:
    """The largest difference; NaN counts as infinite."""
    assert expected.shape == actual.shape
    difference = np.abs(np.asarray(expected, np.float64) - actual)
    return float(np.where(np.isnan(difference), np.inf, difference).max())


def units(count: int, seed: int) -> Floats:
    """Random directions, (count, 3), as the shader sees them: rounded to 32 bits."""
    return normals.unit(np.random.default_rng(seed).normal(size=(count, 3))).astype(np.float32).astype(np.float64)


@pytest.mark.parametrize(
    ("bias", "power"), [(0.1, 2.0), (0.0, 1.0), (-0.3, 1.0), (-1.0, 2.0), (1.0, 3.0), (0.05, 64.0)]
)
def test_the_refraction_weight_follows_the_formula_from_behind_to_head_on(bias: float, power: float) -> None:
    cosine = np.linspace(-1, 1, 2001)
    weight = call("lib/fresnel.glsl", "luna_refraction_weight(c, b, p)", c=cosine, b=bias, p=power)

    assert off(1 - fresnel.luna_reflection_weight(cosine.astype(np.float32), bias, power), weight) < 1e-5


def test_the_weight_has_the_values_of_the_document() -> None:
    cosine = np.cos(np.radians([0, 30, 45, 60, 75, 80, 85, 89, 90]))
    plain = [0, 0.1340, 0.2929, 0.5000, 0.7412, 0.8264, 0.9128, 0.9825, 1]
    demo = [0, 0.1500, 0.4000, 0.6500, 0.8330, 0.8698, 0.8924, 0.8997, 0.9000]
    weight = "1.0 - luna_refraction_weight(c, b, p)"

    assert off(np.array(plain), call("lib/fresnel.glsl", weight, c=cosine, b=0.0, p=1.0)) < 6e-5
    assert off(np.array(demo), call("lib/fresnel.glsl", weight, c=cosine, b=0.1, p=2.0)) < 6e-5


def test_a_weight_clamped_before_its_bias_is_told_apart() -> None:
    cosine = np.linspace(-1, 1, 2001)
    early = call("lib/fresnel.glsl", "b + clamp(pow(max(c, 0.0), p), 0.0, 1.0)", c=cosine, b=-0.3, p=2.0)

    assert off(1 - fresnel.luna_reflection_weight(cosine, -0.3, 2.0), early) > 0.2


def test_slopes_become_normals() -> None:
    slope = np.random.default_rng(1).normal(scale=0.7, size=(500, 2))

    assert off(normals.of_slope(slope), call("lib/normals.glsl", "normal_from_slope(s)", "vec3", s=slope)) < 1e-6
    assert (
        off(np.array([[0.0, 1.0, 0.0]]), call("lib/normals.glsl", "normal_from_slope(s)", "vec3", s=[[0.0, 0.0]])) == 0
    )


def test_blended_phases_keep_the_variance_of_one() -> None:
    rng = np.random.default_rng(2)
    now, before = rng.normal(size=(2, 40_000, 2))
    for earlier in (0.0, 0.25, 0.5, 0.9, 1.0):
        blended = call("lib/normals.glsl", "blended_slope(a, b, t)", "vec2", a=now, b=before, t=earlier)
        mixed = (1 - earlier) * now + earlier * before

        assert abs(float(blended.var()) - 1) < 0.03
        assert earlier in (0.0, 1.0) or mixed.var() < 0.85, "a plain mix must be told apart"


def test_maps_are_read_where_clip_space_says() -> None:
    clip = np.random.default_rng(3).uniform([-2, -2, 0, 0.5], [2, 2, 1, 9], size=(500, 4))

    assert off(projection.map_place(clip), call("lib/projection.glsl", "map_place(c)", "vec2", c=clip)) < 2e-6


@pytest.mark.parametrize("power", [1.0, 20.0, 200.0, 364.0])
def test_glints_follow_phong(power: float) -> None:
    n, light, view = units(4000, 4), units(4000, 5), units(4000, 6)
    mirrored = 2 * (n * light).sum(1, keepdims=True) * n - light
    view[::2] = normals.unit(mirrored[::2] + 0.05 * view[::2]).astype(np.float32)
    lobe = call("lib/microfacet.glsl", "phong_lobe(n, l, v, p)", n=n, l=light, v=view, p=power)

    assert off(microfacet.phong(n, light, view, power), lobe) < 1e-4
    assert (lobe[(n * light).sum(1) < 0] == 0).all()
    assert lobe.max() > 0.5


def test_srgb_is_exact_to_a_hundredth_of_a_step() -> None:
    line = np.linspace(0, 1, 4097)
    grey = np.repeat(line[:, None], 3, axis=1)
    encoded = call("lib/colour.glsl", "srgb_from_linear(c)", "vec3", c=grey)

    assert off(tonemap.srgb(grey.astype(np.float32)), encoded) < 0.01 / 255
    assert off(tonemap.srgb(line), srgb_from_linear(line)) < 1e-12


def test_the_dithered_pictures_curve_is_srgb_too() -> None:
    grey = np.repeat(np.linspace(0, 1, 4097)[:, None], 3, axis=1)

    assert (
        off(tonemap.srgb(grey.astype(np.float32)), call("lib/colour.glsl", "srgb_by_roots(c)", "vec3", c=grey))
        < 0.01 / 255
    )


def test_roots_are_squared_exactly() -> None:
    root = np.arange(256, dtype=np.float32)[:, None].repeat(3, 1) / np.float32(255)

    assert off(root * root, call("lib/colour.glsl", "linear_from_root(c)", "vec3", c=root)) == 0


def test_numbers_are_rounded_to_the_nearest_half_float() -> None:
    value = np.exp(np.random.default_rng(7).uniform(-9, 11, size=(4000, 3))).astype(np.float32)
    rounded = call("lib/colour.glsl", "rounded_to_half(c)", "vec3", c=value)

    assert (rounded.astype(np.float16).astype(np.float32) == rounded).all()
    assert (np.abs(rounded / value - 1) <= 2.0**-11).all()


@pytest.mark.parametrize("operator", ["reinhard", "aces"])
def test_tone_curves_follow_their_sources(operator: str) -> None:
    light = np.exp(np.random.default_rng(8).uniform(-7, 7, size=(2000, 3))).astype(np.float32)
    light[0] = 0
    shown = call("lib/tonemap.glsl", f"tonemap_{operator}(c)", "vec3", c=light)

    assert off(getattr(tonemap, operator)(light), shown) < 1e-6
    assert shown[0].max() == 0


def test_agx_keeps_greys_grey_and_follows_the_sigmoid() -> None:
    stops = np.linspace(-12.4, 4.0, 300)
    grey = np.repeat((2.0**stops)[:, None], 3, axis=1)
    shown = call("lib/tonemap.glsl", "tonemap_agx(c)", "vec3", c=grey)
    curve = tonemap.agx_sigmoid((stops + 12.47393) / (4.026069 + 12.47393))

    assert np.ptp(shown, axis=1).max() < 2e-3
    assert np.abs(shown.mean(axis=1) ** (1 / 2.2) - curve).max() < 0.01
    assert (np.diff(shown[:, 1]) > -1e-3).all()


def test_agx_desaturates_towards_white() -> None:
    red = np.array([[1.0, 0.02, 0.02]]) * 2.0 ** np.arange(-2, 8)[:, None]
    shown = call("lib/tonemap.glsl", "tonemap_agx(c)", "vec3", c=red)

    assert (shown >= 0).all()
    assert (shown <= 1).all()
    assert (np.diff(shown[:, 1] / shown[:, 0]) > 0).all()


@pytest.mark.parametrize("falloff", [0.0, 1e-4, 1e-3, 0.1, 2.0])
def test_fog_is_the_integral_along_the_way(falloff: float) -> None:
    rng = np.random.default_rng(9)
    eye = rng.uniform(-30, 30, 3000)
    rise = rng.choice([0.0, 5e-4, 1.1e-3, 0.01, 0.3, 5.0, 40.0], 3000) * rng.choice([-1.0, 1.0], 3000)
    eye, point = (a.astype(np.float32).astype(np.float64) for a in (eye, eye + rise))
    distance = np.maximum(rng.uniform(0, 400, 3000), np.abs(point - eye))
    block = Fog(density=0.01, height_falloff=falloff)
    through = call(
        "lib/fog.glsl", "fog_transmittance(a, b, d)", blocks=[block, LightBlock()], a=eye, b=point, d=distance
    )

    assert off(fog.transmittance(eye, point, distance, 0.01, falloff), through) < 0.5 / 255


@pytest.mark.parametrize("falloff", [0.02, 0.3])
def test_fog_before_the_sky_is_the_integral_to_where_the_air_ends(falloff: float) -> None:
    rise = np.linspace(0.01, 1, 200)
    direction = np.stack([np.sqrt(1 - rise**2), rise, np.zeros(200)], axis=1)
    far = 40 / falloff / rise
    block = Fog(color=(0.0, 0.0, 0.0), density=0.01, height_falloff=falloff)
    sky = call(
        "lib/fog.glsl",
        "fogged_sky(vec3(1.0), vec3(0.0, h, 0.0), d)",
        "vec3",
        blocks=[block, LightBlock()],
        d=direction,
        h=3.0,
    )
    expected = np.array([fog.transmittance(3.0, 3.0 + f * y, f, 0.01, falloff) for f, y in zip(far, rise, strict=True)])

    assert off(expected, sky[:, 0]) < 0.5 / 255
    level = call(
        "lib/fog.glsl", "fogged_sky(vec3(1.0), vec3(0.0), d)", "vec3", blocks=[block, LightBlock()], d=[[1.0, 0.0, 0.0]]
    )
    assert level.max() == 0
