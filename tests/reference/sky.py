"""The clear sky. Written from the sources' integrals, in double precision: no closed form of the shaders is used here.

Lengths in kilometres. A spectrum is an array over wavelengths; ``four`` are those that the shaders carry.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

RADIUS, TOP = 6360.0, 6460.0
FOUR = np.array([640.0, 590.0, 520.0, 440.0])
"""The shaders' wavelengths, nm."""
ALL = np.arange(380.0, 781.0, 5.0)

_OZONE_AT = np.arange(380.0, 781.0, 20.0)
_OZONE = np.array(
    [
        0.05, 0.15, 0.55, 1.6, 3.7, 7.5, 14.8, 21.4, 30.9, 42.7, 44.0,
        50.2, 37.4, 26.6, 18.5, 12.1, 7.5, 5.1, 4.2, 2.5, 2.5,
    ],
)  # fmt: skip
"""Cross section at 233 K, 1e-26 m² (Serdyuchenko et al. 2014), every 20 nm."""
DOBSON = 2.687e20
"""Molecules in a column of one Dobson unit, per m²."""


def rayleigh(wavelength: ArrayLike) -> Floats:
    """Scattering at sea level, per km (Penndorf 1957, fitted by the fourth power)."""
    return np.asarray(1.24062e-3 * (np.asarray(wavelength) / 1000.0) ** -4.0)


def ozone(wavelength: ArrayLike) -> Floats:
    """Absorption in the middle of a 300-Dobson layer, a tent 15 km to each side (Bruneton 2017), per km."""
    return np.asarray(
        np.interp(np.asarray(wavelength, np.float64), _OZONE_AT, _OZONE) * 1e-26 * 300.0 * DOBSON / 15e3 * 1e3
    )


def aerosol(wavelength: ArrayLike, turbidity: float) -> Floats:
    """Extinction at sea level, per km: Preetham et al. 1999's turbidity at 550 nm, Ångström 1929's power of -1.3."""
    vertical = (turbidity - 1.0) * float(rayleigh(550.0)) * 8.0
    return np.asarray(vertical / 1.2 * (np.asarray(wavelength) / 550.0) ** -1.3)


def height(h: ArrayLike, mu: ArrayLike, t: ArrayLike) -> Floats:
    """Height at distance t along a ray, by the law of cosines."""
    r = RADIUS + np.asarray(h, np.float64)
    return np.asarray(np.sqrt(r * r + np.square(t) + 2.0 * r * np.asarray(mu) * t) - RADIUS)


def path(h: float, mu: float, points: int = 20000) -> tuple[Floats, Floats]:
    """Middles and lengths of steps up to the top of the air, fine near the ray's lowest point."""
    r = RADIUS + h
    lowest = max(-r * mu, 0.0)
    end = -r * mu + np.sqrt(r * r * (mu * mu - 1.0) + TOP * TOP)
    grid = np.linspace(0.0, 1.0, points + 1)
    after = lowest + (end - lowest) * grid**2
    edges = np.concatenate([lowest * (1.0 - grid[::-1] ** 2)[:-1], after]) if lowest > 0 else after
    return (edges[1:] + edges[:-1]) / 2.0, np.diff(edges)


def optical_depth(h: float, mu: float, turbidity: float, wavelength: ArrayLike = FOUR) -> Floats:
    """Optical depth to the top of the air, by quadrature."""
    t, dt = path(h, mu)
    heights = height(h, mu, t)
    tent = np.maximum(0.0, 1.0 - np.abs(heights - 25.0) / 15.0)
    return np.asarray(
        rayleigh(wavelength) * (np.exp(-heights / 8.0) * dt).sum()
        + aerosol(wavelength, turbidity) * (np.exp(-heights / 1.2) * dt).sum()
        + ozone(wavelength) * (tent * dt).sum(),
    )


def single_scattering(mu: float, azimuth: float, sun_mu: float, turbidity: float) -> tuple[Floats, Floats]:
    """Light scattered once by air and by aerosol (Hillaire 2020, equation 1 without phase functions), (4,) each.

    ``azimuth`` from the sun, radians; the sun's irradiance is 1. The eye is 50 m up.
    """
    h = 0.05
    t, dt = path(h, mu, 400)
    heights = height(h, mu, t)
    density = np.exp(-heights / 8.0)[:, None] * rayleigh(FOUR)
    haze = np.exp(-heights / 1.2)[:, None] * aerosol(FOUR, turbidity)
    tent = np.maximum(0.0, 1.0 - np.abs(heights - 25.0) / 15.0)[:, None] * ozone(FOUR)
    steps = (density + haze + tent) * dt[:, None]
    through = np.exp(-(np.cumsum(steps, 0) - steps / 2.0))
    cosine = mu * sun_mu + np.sqrt((1 - mu * mu) * (1 - sun_mu * sun_mu)) * np.cos(azimuth)
    local = ((RADIUS + h) * sun_mu + t * cosine) / (RADIUS + heights)
    sun = np.array([np.exp(-optical_depth(a, m, turbidity)) for a, m in zip(heights[::8], local[::8], strict=True)])
    lit = np.stack([np.interp(t, t[::8], sun[:, k]) for k in range(4)], -1)
    weight = through * lit * dt[:, None]
    return (density * weight).sum(0), 0.94 * (haze * weight).sum(0)


def henyey_greenstein(cosine: ArrayLike, g: float) -> Floats:
    """Henyey & Greenstein 1941, equation 2, per steradian."""
    return np.asarray((1 - g**2) / (4 * np.pi * (1 + g**2 - 2 * g * np.asarray(cosine)) ** 1.5))


def cornette_shanks(cosine: ArrayLike, g: float) -> Floats:
    """Cornette & Shanks 1992, equation 8, per steradian."""
    c = np.asarray(cosine)
    return np.asarray(1.5 * (1 - g**2) / (2 + g**2) * (1 + c**2) / (1 + g**2 - 2 * g * c) ** 1.5 / (4 * np.pi))


def color(spectrum: ArrayLike) -> Floats:
    """Linear sRGB of spectra (..., 81) over ``ALL``, relative to sunlight, which is white.

    The sun is Planck's at 5778 K, the colour matching functions those of Wyman et al. 2013, equation 4.
    """
    xyz = np.stack([_matching(lobes) for lobes in (X, Y, Z)])
    planck = 1.0 / (ALL**5 * (np.exp(1.4388e7 / (ALL * 5778.0)) - 1.0))
    srgb = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
    response = srgb @ xyz * planck
    response /= response.sum(1, keepdims=True)
    return np.asarray(np.asarray(spectrum, np.float64) @ response.T)


X = ((1.056, 599.8, 0.0264, 0.0323), (0.362, 442.0, 0.0624, 0.0374), (-0.065, 501.1, 0.0490, 0.0382))
Y = ((0.821, 568.8, 0.0213, 0.0247), (0.286, 530.9, 0.0613, 0.0322))
Z = ((1.217, 437.0, 0.0845, 0.0278), (0.681, 459.0, 0.0385, 0.0725))


def _matching(lobes: tuple[tuple[float, ...], ...]) -> Floats:
    parts = [w * np.exp(-0.5 * ((ALL - m) * np.where(m > ALL, below, above)) ** 2) for w, m, below, above in lobes]
    return np.asarray(np.sum(parts, axis=0))


def table_place(direction: ArrayLike) -> Floats:
    """Place in the sky table: Cigolle et al. 2014, section 3.4 (hemi-octahedron), with heights doubled."""
    d = np.asarray(direction, np.float64) * [1.0, 2.0, 1.0]
    p = d / np.abs(d).sum(-1, keepdims=True)
    return np.asarray(np.stack([p[..., 0] + p[..., 2], p[..., 0] - p[..., 2]], -1) / 2.0 + 0.5)


def gradient(direction: ArrayLike, horizon: ArrayLike, zenith: ArrayLike) -> Floats:
    """The contract's gradient: linear in sqrt(max(y, 0)) of the unit direction."""
    d = np.asarray(direction, np.float64)
    y = d[:, 1] / np.linalg.norm(d, axis=1)
    s = np.sqrt(np.maximum(y, 0.0))[:, None]
    return np.asarray((1 - s) * np.asarray(horizon) + s * np.asarray(zenith))
