"""The sky: its declarations, its light, and how it is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from renderer.camera import compass_direction
from renderer.scene.sky import AnalyticSky, ConstantSky, GradientSky, SkyLight, ambient_color, sky_light, sun_color
from renderer.units import srgb_from_linear
from tests.reference import sky as twin
from tests.renderer.drawing import SIZE, picture

pytestmark = pytest.mark.usefixtures("world")

Floats = NDArray[np.float64]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
UP: dict[str, Any] = {"eye": [0, 5, 0], "target": [0, 45, -30], "up": [0, 1, 0], "fov_y": 70}
"""A camera that sees nothing but sky."""


def light_of(elevation: float, turbidity: float = 1.8) -> SkyLight:
    """The light of a sky under a white sun of strength 1."""
    return sky_light(
        AnalyticSky(turbidity=turbidity),
        sun_direction=compass_direction(0.0, elevation),
        sun_radiance=[1.0, 1.0, 1.0],
        ambient=[0.0, 0.0, 0.0],
        seed=0,
    )


def test_the_models_refuse_what_they_cannot_mean() -> None:
    for model, fields in (
        (ConstantSky, {"color": [0.1, 0.2]}),
        (ConstantSky, {"color": [-0.1, 0.2, 0.3]}),
        (GradientSky, {"middle": [0.1, 0.2, 0.3]}),
        (AnalyticSky, {"turbidity": 0.9}),
        (AnalyticSky, {"turbidity": float("nan")}),
        (AnalyticSky, {"clouds": 1.1}),
    ):
        with pytest.raises(ValidationError):
            model.model_validate(fields)
    assert ConstantSky.model_validate({"color": "#ffffff"}).color == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("elevation", [-40.0, -6.0, 0.0, 4.0, 30.0, 90.0])
@pytest.mark.parametrize("strength", [1e-3, 1.0, 1e7])
def test_the_light_of_any_sun_fits_half_floats(elevation: float, strength: float) -> None:
    light = sky_light(
        AnalyticSky(),
        sun_direction=compass_direction(10.0, elevation),
        sun_radiance=[strength, strength, strength],
        ambient=[0.2, 0.2, 0.2],
        seed=3,
    )

    for color in (light.airlight, light.sunlight, light.sun_disc, light.dome, light.ground):
        assert np.isfinite(color).all()
        assert min(color) >= 0
    assert max(light.sun_disc) < 20_000
    assert min(light.ground) > 0


def test_the_sun_reddens_and_fades_as_it_sinks() -> None:
    high, low, lowest = (np.array(sun_color(elevation)) for elevation in (60.0, 10.0, 2.0))

    assert max(high) == max(low) == max(lowest) == 1
    assert high[2] > low[2] > lowest[2]
    assert high[1] > low[1] > lowest[1]
    discs = [light_of(elevation).sun_disc for elevation in (60.0, 10.0, 2.0)]
    assert discs[0][0] > discs[1][0] > discs[2][0]


def test_suggested_ambient_light_is_near_the_contracts_by_day_and_dim_at_dusk() -> None:
    day, dusk = np.array(ambient_color(38.0)), np.array(ambient_color(-4.0))

    np.testing.assert_allclose(day @ LUMINANCE, 0.25, atol=0.05)
    assert day[2] > day[0]
    assert 0 < dusk.max() < 0.2 * day.max()


def test_haze_dims_the_sun() -> None:
    rays_left = [light_of(40.0, turbidity).sun_disc[1] for turbidity in (1.0, 1.5, 2.0, 3.0, 5.0, 8.0)]

    assert (np.diff(rays_left) < 0).all()


def rays(camera: dict[str, Any]) -> Floats:
    """Directions (n, 3) of the pixels' centres, row by row from the top."""
    eye, target = (np.array(camera[name], np.float64) for name in ("eye", "target"))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, camera["up"])
    right /= np.linalg.norm(right)
    above = np.cross(right, forward)
    width, height = SIZE
    half = np.tan(np.radians(camera["fov_y"] / 2))
    x = (np.arange(width) + 0.5 - width / 2) / (height / 2) * half
    y = (height / 2 - np.arange(height) - 0.5) / (height / 2) * half
    u, v = np.meshgrid(x, y)
    return np.asarray((forward + u[..., None] * right + v[..., None] * above).reshape(-1, 3))


def test_a_constant_sky_is_its_colour() -> None:
    color = [0.1, 0.4, 0.7]
    expected = np.round(255 * srgb_from_linear(np.array(color)))

    assert (picture(camera=UP, sky={"model": "constant", "color": color}, sun=None) == expected).all()


def test_a_gradient_sky_is_the_contracts_formula() -> None:
    horizon, zenith = [0.9, 0.5, 0.1], [0.05, 0.2, 0.6]
    shown = picture(camera=UP, sky={"model": "gradient", "horizon": horizon, "zenith": zenith}, sun=None)
    expected = twin.gradient(rays(UP), horizon, zenith).reshape(*SIZE[::-1], 3)

    assert np.abs(255 * srgb_from_linear(expected) - shown).max() < 0.7  # half floats before the rounding
    plain = np.asarray(rays(UP)[:, 1:2] / np.linalg.norm(rays(UP), axis=1, keepdims=True))
    wrong = ((1 - plain) * horizon + plain * zenith).reshape(*SIZE[::-1], 3)
    assert np.abs(255 * srgb_from_linear(wrong) - shown).max() > 10, "a gradient without its root is told apart"


@pytest.mark.parametrize("elevation", [50.0, 20.0])
def test_the_sun_stands_where_the_request_says(elevation: float) -> None:
    sun = compass_direction(140, elevation)
    eye = np.array([0.0, 30.0, 0.0])
    camera = {"eye": eye.tolist(), "target": (eye + 10 * sun).tolist(), "up": [0, 1, 0], "fov_y": 6}
    shown = picture(
        camera=camera,
        sky={"model": "analytic", "clouds": 0.0},
        sun={"azimuth": 140, "elevation": elevation, "shadows": False},
        tonemap={"operator": "none", "exposure": -6},
    ).mean(-1)
    rows, columns = np.nonzero(shown > 0.7 * shown.max())

    assert abs(rows.mean() - (SIZE[1] - 1) / 2) < 0.6
    assert abs(columns.mean() - (SIZE[0] - 1) / 2) < 0.6
    radius = np.sqrt(len(rows) / np.pi) * 6 / SIZE[1]
    assert abs(radius - 0.2666) < 0.06
