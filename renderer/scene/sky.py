"""The sky models of a request, and the light of the analytic one.

The sky's light is the sun's, scattered: ``sky_light`` turns the request's sun into the few numbers that the shaders
need. Three decisions are art, not optics, and stand here: how strong the sun outside the air is (its colour in a
request may already be a low sun's, so its strongest channel counts and the air does the reddening), how far an eye
adapts as the sun sinks, and how much brighter the air is drawn than it is.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from renderer.blocks import Block
from renderer.scene.air import sunlight
from renderer.units import Color, Number, Unit, Vec3, Whole

Floats = NDArray[np.float64]

TABLE_SIZE = 960
"""Side of the table of the finished sky, texels."""
SCATTERING_SIZE = (128, 128)
"""Columns, and rows of each of the three blocks, of the table of scattered light."""
MULTIPLE_SIZE = (64, 32)
"""Columns and rows of the table of light scattered twice or more."""
EYE_HEIGHT = 0.05
"""Height of the camera over the sea, km: the sky is one for all cameras."""
DEFINES = (
    f"SKY_TABLE_SIZE {TABLE_SIZE}",
    f"SKY_SCATTERING_COLUMNS {SCATTERING_SIZE[0]}",
    f"SKY_SCATTERING_ROWS {SCATTERING_SIZE[1]}",
    f"SKY_MULTIPLE_SIZE ivec2({MULTIPLE_SIZE[0]}, {MULTIPLE_SIZE[1]})",
    f"SKY_EYE_HEIGHT {EYE_HEIGHT}",
)
"""What the three baking programs are compiled with."""

AIR_GAIN = 2.8
"""Air is drawn so much brighter than it is: with it the sky of the default sun sends what the default ambient says."""
CLOUD_GAIN = 1.3
"""Clouds and glare are drawn so much brighter: a sunlit cloud is then a bit brighter than sunlit white paper."""
ADAPTATION = 0.55
"""Share of the sky's darkening (in stops) that an eye makes good as the sun sinks."""
LOW_TINT = (1.15, 0.88, 0.98)
"""White balance of a low sun: without it the air between orange and blue is green, which no one remembers."""
LOW_ELEVATION = 18.0
"""Elevation under which that white balance sets in, degrees."""
DISC = 60.0
"""Radiance of the sun's disc for a sun of strength 1: a thousandth of the truth, so that half floats hold it."""
STRONGEST = 300.0
"""Strength of the sun past which the sky grows no brighter: half floats end at 65504."""
GROUND = (0.16, 0.165, 0.13)
"""Albedo of the country beyond the scene: grass and soil."""
NIGHT = (0.010, 0.015, 0.027)
"""Radiance that is left in the zenith when the sun is far down."""

_ELEVATIONS = np.array([-6.0, -5.0, -4.0, -3.0, -2.0, -1.0, 0.0, 3.0, 6.0, 10.0, 20.0, 38.0, 60.0, 90.0])
_MEAN_SKY = np.array(
    [
        [9.92e-05, 0.000144, 0.000235],
        [0.000323, 0.00045, 0.000708],
        [0.000992, 0.00129, 0.00193],
        [0.0027, 0.00333, 0.00458],
        [0.00595, 0.00726, 0.00936],
        [0.0107, 0.0132, 0.0167],
        [0.0163, 0.0208, 0.0268],
        [0.0382, 0.0511, 0.0686],
        [0.0601, 0.0843, 0.117],
        [0.0831, 0.12, 0.177],
        [0.122, 0.18, 0.286],
        [0.164, 0.244, 0.406],
        [0.192, 0.288, 0.489],
        [0.206, 0.309, 0.53],
    ],
)
"""Mean radiance of the clear default sky, weighted by the cosine, over ``_ELEVATIONS``, without adaptation and tint."""
_FULL_SKY = 0.282
"""Luminance of that sky under a sun 60 degrees high, to which an eye is adapted."""


class ConstantSky(Block):
    """One radiance from everywhere."""

    model: Literal["constant"] = "constant"
    color: Color = (0.45, 0.60, 0.80)
    """Radiance of every direction."""


class GradientSky(Block):
    """A gradient between horizon and zenith, linear in the square root of the direction's height."""

    model: Literal["gradient"] = "gradient"
    horizon: Color = (0.70, 0.80, 0.90)
    """Radiance at and under the horizon."""
    zenith: Color = (0.16, 0.32, 0.62)
    """Radiance straight up."""


class AnalyticSky(Block):
    """Air that scatters the sun's light, with clouds and the sun's disc (Hillaire 2020)."""

    model: Literal["analytic"] = "analytic"
    turbidity: Number = Field(1.8, ge=1.0, le=10.0)
    """Haze: optical depth of the air with it over that without; 1 is none, 2 a clear day, 6 a hazy one."""
    clouds: Unit = 0.35
    """Share of the sky that clouds cover: 0 is clear, 1 overcast."""


class SkyLight(Block):
    """The light of one analytic sky, as the shaders read it."""

    sun_direction: Vec3 = (0.0, 1.0, 0.0)
    """Unit vector towards the sun."""
    airlight: Vec3 = (0.0, 0.0, 0.0)
    """Irradiance of the sunlight that the air scatters."""
    sunlight: Vec3 = (0.0, 0.0, 0.0)
    """Irradiance of the sunlight that clouds and haze scatter."""
    sun_disc: Vec3 = (0.0, 0.0, 0.0)
    """Radiance of the middle of the sun's disc."""
    dome: Vec3 = (0.0, 0.0, 0.0)
    """Radiance of the zenith that does not come from the sun."""
    ground: Vec3 = (0.0, 0.0, 0.0)
    """Radiance of the country far below the horizon."""
    seed: Whole = 0
    """Seed of the clouds, 0 to 2^31 - 1."""


def sky_light(
    sky: AnalyticSky,
    *,
    sun_direction: ArrayLike | None,
    sun_radiance: ArrayLike,
    ambient: ArrayLike,
    seed: int,
) -> SkyLight:
    """The light of a sky under the request's sun.

    ``sun_direction`` is the unit vector towards the sun, None for none; ``sun_radiance`` its colour times intensity;
    ``ambient`` the scene's own, which is all that a sky without sun has: where it is clear its irradiance over pi
    is just that.
    """
    strength = min(float(np.max(sun_radiance)), STRONGEST)
    if sun_direction is None or strength <= 0.0:
        dome = np.asarray(ambient, np.float64) * 9.0 / 7.0
        return SkyLight(dome=_color(dome), ground=_color(np.multiply(GROUND, ambient)), seed=seed)
    towards = np.asarray(sun_direction, np.float64)
    elevation = float(np.degrees(np.arcsin(np.clip(towards[1], -1.0, 1.0))))
    light = strength * adaptation(elevation) * _tint(elevation)
    direct = sunlight(elevation, sky.turbidity)
    night = strength * _smooth((2.0 - elevation) / 10.0)
    around = (1.0 + 2.0 * _low(elevation)) * np.array(ambient_color(elevation))
    ground = np.array(GROUND) * strength * (max(towards[1], 0.0) * direct + around)
    return SkyLight(
        sun_direction=_color(towards),
        airlight=_color(np.pi * AIR_GAIN * light),
        sunlight=_color(np.pi * CLOUD_GAIN * light),
        sun_disc=_color(DISC * strength * direct),
        dome=_color(night * np.array(NIGHT)),
        ground=_color(ground + night * np.array(NIGHT) * GROUND),
        seed=seed,
    )


def mean_sky(elevation: float) -> Floats:
    """Mean radiance of the clear default sky for a sun of strength 1 at this elevation, degrees, before adaptation."""
    logs = [np.interp(elevation, _ELEVATIONS, np.log(channel)) for channel in _MEAN_SKY.T]
    return np.exp(logs)


def adaptation(elevation: float) -> float:
    """How much an eye, or a camera, opens as the sun sinks: 1 under a sun 60 degrees high."""
    luminance = mean_sky(elevation) @ (0.2126, 0.7152, 0.0722)
    return float((luminance / _FULL_SKY) ** -ADAPTATION)


def sun_color(elevation: float, turbidity: float = 1.8) -> tuple[float, float, float]:
    """Hue of sunlight at an elevation in degrees, its strongest channel 1: a ``sun.color`` that suits the sky."""
    light = sunlight(elevation, turbidity)
    return _color(light / light.max())


def ambient_color(elevation: float) -> tuple[float, float, float]:
    """Ambient light that suits the clear sky of a sun of strength 1: its mean radiance, adapted, half of its hue gone.

    Half, because what stands round a place sends back the sun's light, too.
    """
    light = mean_sky(elevation) * adaptation(elevation) * _tint(elevation)
    return _color(0.5 * light + 0.5 * light.mean())


def _tint(elevation: float) -> Floats:
    return 1.0 + _low(elevation) * (np.array(LOW_TINT) - 1.0)


def _low(elevation: float) -> float:
    return _smooth((LOW_ELEVATION - elevation) / LOW_ELEVATION)


def _smooth(x: float) -> float:
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


def _color(values: ArrayLike) -> tuple[float, float, float]:
    r, g, b = (float(value) for value in np.asarray(values, np.float64))
    return r, g, b
