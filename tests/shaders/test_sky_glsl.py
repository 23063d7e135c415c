"""The sky's GLSL functions against their twins and their closed-form limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene import air
from tests.reference import sky
from tests.shaders.calling import call

Floats = NDArray[np.float64]

AIR = "lib/atmosphere.glsl"
SKY = "lib/sky.glsl"


def directions(count: int, seed: int, *, above: bool = False) -> Floats:
    """Random unit directions, (count, 3), rounded to 32 bits; with ``above`` none falls below the horizon."""
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d[:, 1] = np.abs(d[:, 1]) if above else d[:, 1]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return np.asarray(d, np.float32).astype(np.float64)


def test_the_scaled_error_function_has_its_published_values() -> None:
    values = {0.0: 1.0, 0.5: 0.6156903442, 1.0: 0.4275835762, 3.0: 0.1790011511, 20.0: 0.0281743487}
    found = call(AIR, "erfcx(z)", z=np.array(list(values)))

    np.testing.assert_allclose(found, list(values.values()), rtol=2e-6)
    np.testing.assert_allclose([air.erfcx(z) for z in values], list(values.values()), rtol=1e-6)


@pytest.mark.parametrize("turbidity", [1.0, 2.0, 6.0])
@pytest.mark.parametrize("degrees", [90.0, 30.0, 10.0, 3.0, 0.0])
def test_optical_depth_from_the_ground_is_the_integral(degrees: float, turbidity: float) -> None:
    mu = float(np.sin(np.radians(degrees)))
    expected = sky.optical_depth(0.0, mu, turbidity)

    found = call(AIR, "optical_depth(0.0, mu, t)", "vec4", mu=[mu], t=turbidity)[0]
    np.testing.assert_allclose(found, expected, rtol=0.02)
    np.testing.assert_allclose(air.optical_depth(mu, turbidity), found, rtol=2e-5)


@pytest.mark.parametrize(("h", "degrees"), [(5.0, 1.0), (5.0, -1.5), (20.0, -3.0), (40.0, -5.0), (60.0, 10.0)])
def test_optical_depth_from_above_is_the_integral_through_the_lowest_point(h: float, degrees: float) -> None:
    mu = float(np.sin(np.radians(degrees)))
    found = call(AIR, "optical_depth(h, mu, 2.0)", "vec4", h=[h], mu=mu)[0]

    # Within its layer the ozone is a shell here and a tent there: that is the difference, and blue has none of it.
    expected = sky.optical_depth(h, mu, 2.0)
    np.testing.assert_allclose(found[3], expected[3], rtol=0.02, atol=2e-3)
    np.testing.assert_allclose(found, expected, rtol=0.05 if h < 15 else 0.15, atol=2e-3)


def test_the_vertical_column_is_the_scale_height() -> None:
    found = call(AIR, "exponential_length(0.0, 1.0, s)", s=np.array([8.0, 1.2]))

    np.testing.assert_allclose(found, [8.0, 1.2], rtol=2e-3)


def test_a_horizontal_column_is_the_square_root() -> None:
    found = call(AIR, "exponential_length(0.0, 0.0, s)", s=np.array([8.0, 1.2]))

    np.testing.assert_allclose(found, np.sqrt(np.pi / 2 * sky.RADIUS * np.array([8.0, 1.2])), rtol=1e-5)


def test_heights_along_a_ray_survive_the_planets_radius() -> None:
    rng = np.random.default_rng(5)
    h, mu, t = rng.uniform(0, 60, 500), rng.uniform(0, 1, 500), rng.uniform(0, 300, 500)
    there = call(AIR, "height_along(h, mu, t)", h=h, mu=mu, t=t)

    np.testing.assert_allclose(there, sky.height(*(v.astype(np.float32) for v in (h, mu, t))), rtol=2e-5, atol=2e-4)
    back = call(AIR, "distance_to_height(h, mu, height_along(h, mu, t))", h=h, mu=mu, t=t)
    far = t > 5
    np.testing.assert_allclose(back[far], t[far], rtol=2e-3)


def test_the_sun_sets_behind_the_planet() -> None:
    low = np.radians(np.linspace(-3, 1, 400))
    seen = call(AIR, "sun_visibility(0.0, mu)", mu=np.sin(low))

    assert seen[0] == 0
    assert seen[-1] == 1
    assert (np.diff(seen) >= -1e-6).all()
    assert call(AIR, "sun_visibility(8.5, mu)", mu=np.sin(np.radians([-2.0])))[0] == 1, "cirrus glows after sunset"


@pytest.mark.parametrize(
    ("phase", "mean_cosine"),
    [
        ("rayleigh_phase(c)", 0.0),
        ("henyey_greenstein(c, 0.8)", 0.8),
        ("henyey_greenstein(c, -0.3)", -0.3),
        ("cornette_shanks(c, 0.72)", None),
        ("aerosol_phase(c)", None),
    ],
)
def test_phase_functions_scatter_all_the_light_once(phase: str, mean_cosine: float | None) -> None:
    c, w = np.polynomial.legendre.leggauss(400)
    values = call(AIR, phase, c=c).astype(np.float64)

    assert abs(2 * np.pi * (w * values).sum() - 1) < 1e-4
    if mean_cosine is not None:
        assert abs(2 * np.pi * (w * c * values).sum() - mean_cosine) < 1e-4
    wrong = values * 4 * np.pi / (4 + np.pi)  # a slip that shipped elsewhere: 4 + pi for 4 pi
    assert abs(2 * np.pi * (w * wrong).sum() - 1) > 0.5


def test_phase_functions_are_their_sources() -> None:
    c = np.linspace(-1, 1, 301)

    np.testing.assert_allclose(call(AIR, "henyey_greenstein(c, 0.8)", c=c), sky.henyey_greenstein(c, 0.8), rtol=2e-5)
    np.testing.assert_allclose(call(AIR, "cornette_shanks(c, 0.72)", c=c), sky.cornette_shanks(c, 0.72), rtol=2e-5)


def spectra(wavelength: Floats, count: int = 400) -> Floats:
    """Light of skies and suns: scattered by air, haze or nothing, then dimmed by up to 30 air masses, (count, n)."""
    rng = np.random.default_rng(6)
    rows = []
    for _ in range(count):
        mass = 10 ** rng.uniform(-0.5, 1.5)
        through = np.exp(-8 * mass * sky.rayleigh(wavelength) - 15 * min(mass, 12) * sky.ozone(wavelength))
        haze = (wavelength / 550) ** -1.3
        through *= np.exp(-min(mass, 20) * rng.uniform(0, 0.15) * haze)
        rows.append(through * (sky.rayleigh(wavelength) * 70, haze, np.ones_like(wavelength))[rng.integers(3)])
    return np.array(rows)


def test_four_wavelengths_tell_the_colours_of_the_whole_spectrum() -> None:
    whole = np.maximum(sky.color(spectra(sky.ALL)), 0)
    found = call(AIR, "color_from_spectrum(s)", "vec3", s=spectra(sky.FOUR))
    luminance = whole @ [0.2126, 0.7152, 0.0722]

    np.testing.assert_array_less(np.abs(found - whole) / luminance[:, None], 0.05)
    three = np.stack([spectra(np.array([nm]))[:, 0] for nm in (680.0, 550.0, 440.0)], -1)
    assert (np.abs(three - whole) / luminance[:, None]).max() > 0.5, "three wavelengths would miss them"
    np.testing.assert_allclose(call(AIR, "color_from_spectrum(s)", "vec3", s=np.ones((1, 4)))[0], 1, atol=1e-3)


def test_the_table_is_found_again() -> None:
    d = directions(3000, 7, above=True)
    place = call(SKY, "sky_place(d)", "vec2", d=d)

    np.testing.assert_allclose(place, sky.table_place(d), atol=1e-6)
    assert place.min() >= 0
    assert place.max() <= 1
    np.testing.assert_allclose(call(SKY, "sky_direction(sky_place(d))", "vec3", d=d), d, atol=4e-6)
    longer = call(SKY, "sky_place(900.0 * d)", "vec2", d=d)
    np.testing.assert_allclose(longer, place, atol=1e-6)


def test_every_place_of_the_table_is_a_direction_above_the_horizon() -> None:
    p = np.random.default_rng(8).uniform(0, 1, (3000, 2))
    d = call(SKY, "sky_direction(p)", "vec3", p=p)

    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1, atol=1e-5)
    assert d[:, 1].min() > -1e-6
    np.testing.assert_allclose(call(SKY, "sky_place(sky_direction(p))", "vec2", p=p), p, atol=2e-6)


def test_below_the_horizon_the_place_is_the_horizons() -> None:
    d = directions(500, 9)
    d[:, 1] = -np.abs(d[:, 1])
    level = d * [1, 0, 1]

    lower, upper = (call(SKY, "sky_place(d)", "vec2", d=rays) for rays in (d, level))
    np.testing.assert_allclose(lower, upper, atol=1e-6)


def test_the_scattering_table_is_found_again() -> None:
    d, sun = directions(2000, 10, above=True), directions(2000, 11)
    found = call(SKY, "scattering_direction(scattering_place(d, s))", "vec2", d=d, s=sun)
    flat = np.linalg.norm(d[:, ::2], axis=1) * np.linalg.norm(sun[:, ::2], axis=1)
    cosine = (d[:, ::2] * sun[:, ::2]).sum(1) / flat

    np.testing.assert_allclose(found[:, 0], d[:, 1], atol=2e-4)
    np.testing.assert_allclose(np.cos(found[:, 1]), cosine, atol=2e-3)


def test_the_gradient_is_exact() -> None:
    d = directions(2000, 12) * np.random.default_rng(13).uniform(0.01, 50, (2000, 1))
    horizon, zenith = np.array([[0.9, 0.5, 0.2]]), np.array([[0.1, 0.2, 0.8]])
    found = call(SKY, "sky_gradient(d, h, z)", "vec3", d=d, h=horizon, z=zenith)

    np.testing.assert_allclose(found, sky.gradient(d, horizon, zenith), atol=1e-6)


@pytest.mark.parametrize("elevation", [60.0, 3.0])
def test_the_disc_has_the_suns_radius_and_a_darker_limb(elevation: float) -> None:
    e = np.radians(elevation)
    sun = np.array([0.0, np.sin(e), -np.cos(e)])
    across = np.array([0.0, np.cos(e), np.sin(e)])
    angle = np.radians(np.linspace(0, 2, 801))
    ray = np.cos(angle)[:, None] * sun + np.sin(angle)[:, None] * across
    disc = call(SKY, "sun_disc(7.0 * d, s)", d=ray, s=sun[None])

    half = np.degrees(angle[np.argmax(disc < 0.25)])
    assert abs(half - 0.2666) < 0.03
    assert 0.98 < disc[0] < 1.1
    assert disc[np.argmin(np.abs(np.degrees(angle) - 0.2))] < 0.95 * disc[0]
    assert (np.diff(disc) < 5e-3).all()
    assert disc[-1] < 1e-3


def test_there_is_one_sun_and_none_below_the_horizon() -> None:
    sun = np.array([[0.0, 0.6, -0.8]])

    assert call(SKY, "sun_disc(-s, s)", s=sun)[0] == 0
    assert call(SKY, "sun_disc(s, s)", s=sun * [1, -1, 1])[0] == 0


def test_the_ground_takes_over_without_an_edge() -> None:
    degrees = np.linspace(2, -12, 2801)
    e = np.radians(degrees)
    d = np.stack([0 * e, np.sin(e), -np.cos(e)], -1)
    arguments: dict[str, Any] = {"d": d, "s": np.array([[1.0, 1.0, 1.0]]), "g": np.array([[0.2, 0.2, 0.2]])}
    found = call(SKY, "sky_with_ground(s, d, g)", "vec3", **arguments)[:, 0]

    assert (found[degrees >= 0] == 1).all()
    np.testing.assert_allclose(found[degrees <= -6], 0.2, atol=1e-6)
    assert np.abs(np.diff(found, 2)).max() < 1e-4, "no crease at the horizon"


def test_an_overcast_sky_sends_seven_ninths_of_its_zenith() -> None:
    mu, w = np.polynomial.legendre.leggauss(20)
    mu, w = (mu + 1) / 2, w / 2
    shape = call(SKY, "overcast_shape(y)", y=mu)

    assert abs(2 * (w * mu * shape).sum() - 7 / 9) < 1e-6
