"""The clear air's closed forms: how much sunlight is left where.

What ``shaders/lib/atmosphere.glsl`` does per texel, for the few numbers that a frame needs once. Lengths in kilometres,
light at four wavelengths; the constants are the shader's, and a test compares the two.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Spectrum = NDArray[np.float64]
"""(4,) light at 640, 590, 520 and 440 nm."""

PLANET_RADIUS = 6360.0
"""Bruneton & Neyret 2008, section 2."""
RAYLEIGH = np.array([7.3946e-3, 10.2384e-3, 16.9677e-3, 33.0998e-3])
"""Scattering at sea level, per km (Penndorf 1957)."""
RAYLEIGH_SCALE = 8.0
AEROSOL_COLOR = np.array([0.8212, 0.9127, 1.0756, 1.3366])
"""(wavelength / 550 nm)^-1.3 (Ångström 1929)."""
AEROSOL_SCALE = 1.2
AIR_DEPTH = 0.10846
"""Vertical Rayleigh optical depth at 550 nm."""
OZONE = np.array([1.430e-3, 2.531e-3, 1.150e-3, 0.086e-3])
"""Absorption in the middle of the layer, per km (Serdyuchenko et al. 2014), 300 Dobson units."""
OZONE_HEIGHT = 25.0
OZONE_HALF_WIDTH = 15.0
COLOR_FROM_SPECTRUM = np.array(
    [
        [0.4858, 0.8787, -0.4099, 0.0454],
        [-0.0715, 0.3806, 0.7713, -0.0804],
        [0.0127, -0.1575, 0.2317, 0.9131],
    ],
)
"""Linear sRGB of the four wavelengths; sunlight outside the air is white."""


_ERFCX = (0.17087277, -0.82215223, 1.48851587, -1.13520398, 0.27886807, -0.18628806, 0.09678418, 0.37409196, 1.00002368)


def erfcx(z: float) -> float:
    """exp(z²) erfc(z) for z of 0 or more, to a relative 1.2e-7 (Press et al. 1992, section 6.2)."""
    t = 1.0 / (1.0 + 0.5 * z)
    polynomial = 0.0
    for coefficient in _ERFCX:
        polynomial = coefficient + t * polynomial
    return float(t * np.exp(-1.26551223 + t * polynomial))


def exponential_length(mu: float, scale: float) -> float:
    """Kilometres of sea-level density from sea level to infinity (Chapman 1931; Fitzmaurice 1964).

    ``mu`` is the cosine of the zenith angle, ``scale`` the scale height in km. Downward rays count as if
    the planet were transparent.
    """
    up = float(np.sqrt(0.5 * np.pi * PLANET_RADIUS * scale) * erfcx(np.sqrt(0.5 * PLANET_RADIUS / scale) * abs(mu)))
    if mu >= 0.0:
        return up
    drop = PLANET_RADIUS * mu * mu / (1.0 + np.sqrt(1.0 - mu * mu))
    perigee = 2.0 * np.exp(drop / scale) * np.sqrt(0.5 * np.pi * (PLANET_RADIUS - drop) * scale)
    return float(perigee - up)


def ozone_length(mu: float) -> float:
    """Kilometres of the ozone layer's middle from sea level to infinity: a shell at its height."""
    sine = PLANET_RADIUS / (PLANET_RADIUS + OZONE_HEIGHT)
    return float(OZONE_HALF_WIDTH / np.sqrt(1.0 - (1.0 - mu * mu) * sine * sine))


def aerosol_extinction(turbidity: float) -> Spectrum:
    """Extinction at sea level, per km, from Preetham et al. 1999's turbidity (section 2)."""
    return np.asarray(AEROSOL_COLOR * ((turbidity - 1.0) * AIR_DEPTH / AEROSOL_SCALE))


def optical_depth(mu: float, turbidity: float) -> Spectrum:
    """Optical depth from sea level to infinity; ``mu`` as in ``exponential_length``."""
    return np.asarray(
        RAYLEIGH * exponential_length(mu, RAYLEIGH_SCALE)
        + aerosol_extinction(turbidity) * exponential_length(mu, AEROSOL_SCALE)
        + OZONE * ozone_length(mu),
    )


def sunlight(elevation: float, turbidity: float) -> NDArray[np.float64]:
    """Linear RGB of sunlight at sea level, over what it is outside the air.

    ``elevation`` in degrees; under the horizon the light of the horizon stands in, so that dusk has a hue.
    """
    mu = np.sin(np.radians(max(elevation, 0.0)))
    return np.asarray(np.maximum(COLOR_FROM_SPECTRUM @ np.exp(-optical_depth(float(mu), turbidity)), 0.0))
