"""The table that an analytic sky is baked into."""

from __future__ import annotations

import itertools
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import compass_direction
from renderer.passes.sky import SkyPass
from renderer.scene import sky as sky_module
from renderer.scene.sky import AnalyticSky, mean_sky, sky_light
from tests.reference import sky as twin
from tests.renderer.drawing import asked, shared_renderer

pytestmark = pytest.mark.usefixtures("world")

Floats = NDArray[np.float64]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@cache
def sky_pass() -> SkyPass:
    return SkyPass(shared_renderer().device)


def baked(elevation: float | None, **fields: Any) -> Floats:
    """The table of an analytic sky, (n, n, 4), row by row from the bottom; without a sun where elevation is None."""
    sun = None if elevation is None else {"azimuth": 20.0, "elevation": elevation}
    seed = fields.pop("seed", 0)
    sky_pass().prepare(asked(sky={"model": "analytic", **fields}, sun=sun, seed=seed))
    table = list(sky_pass()._kept.values())[-1]
    data = table.framebuffer.read(components=4, dtype="f2")
    return np.frombuffer(data, np.float16).reshape(*table.size[::-1], 4).astype(np.float64)


@cache
def clear(elevation: float, turbidity: float = 1.8) -> Floats:
    """A table without clouds."""
    return baked(elevation, turbidity=turbidity, clouds=0.0)


@cache
def table_directions() -> tuple[Floats, Floats]:
    """Direction (n, n, 3) and solid angle of each texel, by inverting the twin's map numerically."""
    n = sky_module.TABLE_SIZE
    s = (np.arange(n) + 0.5) / n * 2 - 1
    u, v = np.meshgrid(s, s)
    x, z = (u + v) / 2, (u - v) / 2
    d = np.stack([x, (1 - np.abs(x) - np.abs(z)) / 2, z], -1)
    length = np.linalg.norm(d, axis=-1, keepdims=True)
    d /= length
    # The plane |x| + 2 y + |z| = 1 seen from the middle: its normal has length 3 for unit steps of x and z along it.
    solid = 1.0 / length[..., 0] ** 3
    np.testing.assert_allclose(twin.table_place(d)[::97, ::97], np.stack([u, v], -1)[::97, ::97] / 2 + 0.5, atol=1e-9)
    return d, solid * 2 * np.pi / solid.sum()


def mean_radiance(table: Floats) -> Floats:
    """Irradiance of a level surface over pi."""
    d, solid = table_directions()
    return np.asarray((table[..., :3] * (solid * d[..., 1])[..., None]).sum((0, 1)) / np.pi)


def at(table: Floats, azimuth: float, elevation: float) -> Floats:
    """Radiance of the nearest texel."""
    n = sky_module.TABLE_SIZE
    column, row = np.minimum((twin.table_place(compass_direction(azimuth, elevation)) * n).astype(int), n - 1)
    return np.asarray(table[row, column, :3])


def test_solid_angles_of_the_table_fill_the_hemisphere() -> None:
    d, solid = table_directions()

    assert abs(solid.sum() - 2 * np.pi) < 1e-9
    assert abs((solid * d[..., 1]).sum() - np.pi) < 1e-3


@pytest.mark.parametrize("elevation", [60.0, 10.0, 0.0, -4.0])
def test_the_tabulated_mean_of_the_sky_is_the_bakes(elevation: float) -> None:
    light = sky_light(
        AnalyticSky(),
        sun_direction=compass_direction(0.0, elevation),
        sun_radiance=[1.0, 1.0, 1.0],
        ambient=[0.0, 0.0, 0.0],
        seed=0,
    )
    adapted = np.array(light.airlight) / (np.pi * sky_module.AIR_GAIN)
    found = (mean_radiance(clear(elevation)) - np.array(light.dome) * 7 / 9) / adapted

    np.testing.assert_allclose(found, mean_sky(elevation), rtol=0.04)


@pytest.mark.parametrize(("degrees", "azimuth", "sun"), [(40.0, 0.3, 50.0), (6.0, 1.5, 30.0), (12.0, 2.9, 4.0)])
def test_light_scattered_once_is_the_integral(degrees: float, azimuth: float, sun: float) -> None:
    sky_pass.cache_clear()
    baked(sun, turbidity=2.0, clouds=0.0)
    scattering = sky_pass()._scattering
    assert scattering is not None
    columns, rows = sky_module.SCATTERING_SIZE
    data = np.frombuffer(scattering.framebuffer.read(components=4, dtype="f4"), np.float32).reshape(3, rows, columns, 4)
    column, row = round(azimuth / np.pi * (columns - 1)), round(np.sqrt(degrees / 90) * (rows - 1))
    mu = np.sin((row / (rows - 1)) ** 2 * np.pi / 2)
    by_air, by_haze = twin.single_scattering(mu, column / (columns - 1) * np.pi, np.sin(np.radians(sun)), 2.0)

    np.testing.assert_allclose(data[0, row, column], by_air, rtol=0.04)
    np.testing.assert_allclose(data[1, row, column], by_haze, rtol=0.04)
    assert (data[2, row, column] > 0).all()


@pytest.mark.parametrize(
    ("elevation", "clouds", "turbidity"),
    [(60, 0.0, 1.0), (60, 0.5, 10.0), (2, 1.0, 2.0), (-6, 0.3, 1.8), (-40, 0.0, 4.0)],
)
def test_every_texel_is_a_light(elevation: float, clouds: float, turbidity: float) -> None:
    table = baked(elevation, clouds=clouds, turbidity=turbidity)

    assert np.isfinite(table).all()
    assert table[..., :3].min() > 0
    assert table[..., :3].max() < 100
    assert table[..., 3].min() >= 0
    assert table[..., 3].max() <= 1


def test_a_noon_sky_is_blue_above_and_pale_at_the_horizon() -> None:
    table = clear(60.0)
    zenith, middle, horizon = (at(table, 200, elevation) for elevation in (90, 30, 1))

    assert zenith[2] > 2 * zenith[0]
    assert horizon[2] < 1.5 * horizon[0]
    assert 0.12 < zenith @ LUMINANCE < 0.3
    assert zenith @ LUMINANCE < middle @ LUMINANCE * 1.2 < horizon @ LUMINANCE


def test_a_setting_sun_is_red_and_the_sky_over_it_blue() -> None:
    table = clear(0.5)
    near, zenith = at(table, 20, 1), at(table, 20, 80)

    assert near[0] > 2 * near[1] > 2 * near[2]
    assert zenith[2] > 1.3 * zenith[0]


def test_no_hue_between_orange_and_blue_is_green() -> None:
    for elevation, azimuth in itertools.product((0.5, 5.0, -3.0), (20, 110, 200)):
        for height in range(1, 90, 4):
            r, g, b = at(clear(elevation), azimuth, height)
            assert g < 1.02 * max(r, b)


def test_haze_whitens_the_sky() -> None:
    zenith = [at(clear(40.0, turbidity), 200, 75) for turbidity in (1.0, 1.5, 2.0, 3.0, 5.0, 8.0)]

    assert (np.diff([z[0] / z[2] for z in zenith]) > 0).all()


def test_the_horizon_has_no_seam() -> None:
    table = clear(20.0)
    for azimuth in range(0, 360, 15):
        rise = np.array([at(table, azimuth, elevation) @ LUMINANCE for elevation in (0.0, 0.3, 0.6)])
        assert np.abs(np.diff(rise)).max() < 0.05 * rise[0]


def test_clouds_hide_more_of_the_sun_the_more_there_are() -> None:
    open_share = [baked(45.0, clouds=clouds)[..., 3].mean() for clouds in (0.0, 0.3, 1.0)]

    assert open_share[0] == 1
    assert (np.diff(open_share) < -0.1).all()
    assert open_share[-1] < 0.05


def test_the_seed_moves_the_clouds_and_nothing_else() -> None:
    first, other = baked(45.0, seed=5), baked(45.0, seed=6)
    sky_pass.cache_clear()  # a new one has nothing kept

    assert (baked(45.0, seed=5) == first).all()
    assert (first != other).mean() > 0.3
    assert (baked(45.0, seed=5, clouds=0.0) == baked(45.0, seed=6, clouds=0.0)).all()


def test_a_sky_without_sun_sends_the_ambient_light() -> None:
    np.testing.assert_allclose(mean_radiance(baked(None, clouds=0.0)), asked().ambient, rtol=2e-3)
