"""Tiling ripple maps: random waves on a torus, stored as slopes.

Each map is a sum of plane waves whose wave vectors are whole numbers of waves a tile, with random
phases and a power-law amplitude within a band (the recipe of Tessendorf 2001, section 3.2, with a flat
spectrum in place of a wind sea). Slopes instead of normals keep a flat map exactly flat and need no
renormalising.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderer.scene.material import Texture

SIZE = 512
"""Texels a side."""
LONGEST, SHORTEST = 6.0, 96.0
"""Waves a tile of the longest and the shortest ripple."""
FALL = 1.55
"""Exponent by which a wave's slope falls with its wave number."""
SLOPE = 0.12
"""Root mean square of each slope component."""
SPREAD = 2.0
"""Exponent of the cosine by which waves gather about the map's main direction."""


@lru_cache(maxsize=8)
def ripple_slopes(seed: int) -> Texture:
    """The slopes (dy/dx, dy/dz) of a tile of random ripples, float32 (SIZE, SIZE, 2), mean exactly 0."""
    waves = _waves(seed)
    image = np.stack([waves.slope_x, waves.slope_z], axis=-1)
    return Texture(f"ripples_{seed}", image.astype(np.float32), wrap="repeat", blends_mipmaps=False)


@lru_cache(maxsize=8)
def ripple_heights(seed: int) -> Texture:
    """The heights whose slopes those are, in sides of the tile, float32 (SIZE, SIZE, 1), mean exactly 0."""
    image = _waves(seed).height[..., None]
    return Texture(f"ripple_heights_{seed}", image.astype(np.float32), wrap="repeat", blends_mipmaps=False)


@dataclass(frozen=True, eq=False)
class _Waves:
    """One tile, (SIZE, SIZE) each: heights in sides of the tile, slopes of themselves."""

    height: NDArray[np.float64]
    slope_x: NDArray[np.float64]
    slope_z: NDArray[np.float64]


def _waves(seed: int) -> _Waves:
    rng = np.random.Generator(np.random.PCG64(0x6D696C6C + seed))
    k = np.fft.fftfreq(SIZE, 1 / SIZE)
    kx, kz = np.meshgrid(k, k)
    number = np.hypot(kx, kz)
    band = _smooth_step(LONGEST * 0.6, LONGEST, number) * (1 - _smooth_step(SHORTEST * 0.6, SHORTEST, number))
    heading = rng.uniform(0, 2 * np.pi)
    along = np.abs(np.cos(np.arctan2(kz, kx) - heading))
    directional = 0.35 + 0.65 * along**SPREAD
    with np.errstate(divide="ignore"):
        amplitude = np.where(number > 0, number ** -(FALL + 1), 0.0) * band * directional
    noise = rng.standard_normal((SIZE, SIZE)) + 1j * rng.standard_normal((SIZE, SIZE))
    height = amplitude * noise
    slope_x = np.fft.ifft2(1j * kx * height).real
    slope_z = np.fft.ifft2(1j * kz * height).real
    scale = SLOPE / np.sqrt(0.5 * np.mean(slope_x**2 + slope_z**2))
    # The wave numbers are waves a side: between them and the slope along a side stands a turn of phase.
    lifted = np.fft.ifft2(height).real * (scale / (2 * np.pi))
    slopes = (slope * scale for slope in (slope_x, slope_z))
    return _Waves(*(field - field.mean() for field in (lifted, *slopes)))


def _smooth_step(low: float, high: float, x: NDArray[np.float64]) -> NDArray[np.float64]:
    t = np.clip((x - low) / (high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))
