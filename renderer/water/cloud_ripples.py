"""A tiling ripple map drawn as Rastertek n.d. describes it: clouds, an ocean ripple, a normal filter.

The document makes its 256 x 256 map in a paint program. Here the three steps are: octaves of gradient noise (Perlin
2002) on a torus; a displacement of each texel by a second noise, which bends the clouds into ripples; and central
differences of the height, 0 to 1, times a scale of 10. Slopes instead of encoded normals keep a flat map exactly flat.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderer.scene.material import Texture

SIZE = 256
"""Texels a side."""
SCALE = 10.0
"""What the normal filter multiplies the height's differences by: 1 is a rise of the whole range in one texel."""
CLOUDS = (4, 8, 16)
"""Cells a tile of the clouds' octaves, each half as strong as the one before; the last is 16 texels long."""
RIPPLES = 12
"""Cells a tile of the noise that displaces the clouds."""
DISPLACEMENT = 7.0
"""Root mean square of that displacement along each axis, texels."""
STEPS = 65535
"""Steps of the height's whole range. Sixteen bits: eight would show as terraces, and sums of slopes stay exact."""

Floats = NDArray[np.float64]


@lru_cache(maxsize=8)
def cloud_ripple_slopes(seed: int) -> Texture:
    """The slopes (dy/dx, dy/dz) of a tile of rippled clouds, float32 (SIZE, SIZE, 2), mean exactly 0."""
    image = filtered(rippled_clouds(seed))
    return Texture(f"cloud_ripples_{seed}", image.astype(np.float32), wrap="repeat", blends_mipmaps=False)


def rippled_clouds(seed: int) -> NDArray[np.int64]:
    """The height of the tile, (SIZE, SIZE) whole steps from 0 to ``STEPS``; rows along z."""
    rng = np.random.Generator(np.random.PCG64(0x636C6F75 + seed))
    texel = np.arange(SIZE, dtype=np.float64)
    z, x = np.meshgrid(texel, texel, indexing="ij")
    shift = [gradient_noise(rng, RIPPLES, x, z) for _ in range(2)]
    x, z = (place + DISPLACEMENT * part / part.std() for place, part in zip((x, z), shift, strict=True))
    clouds = sum((gradient_noise(rng, cells, x, z) * CLOUDS[0] / cells for cells in CLOUDS), np.zeros_like(x))
    level = (clouds - clouds.min()) / np.ptp(clouds)
    return np.asarray(np.rint(level * STEPS).astype(np.int64))


def filtered(height: NDArray[np.int64]) -> Floats:
    """The normal filter: central differences along x and z of a tiling height in steps, times ``SCALE``.

    They are taken between whole numbers and scaled by a power of two and five, so that their sum is exactly zero; the
    whole range is ``STEPS`` + 1 there, which is 1.5e-5 more than the steps in it.
    """
    rise = [np.roll(height, -1, axis) - np.roll(height, 1, axis) for axis in (1, 0)]
    return np.stack(rise, axis=-1) * (SCALE / 2 / (STEPS + 1))


def gradient_noise(rng: np.random.Generator, cells: int, x: Floats, z: Floats) -> Floats:
    """Gradient noise (Perlin 2002) at texels of a torus of ``SIZE`` texels and ``cells`` cells a side."""
    turn = rng.uniform(0, 2 * np.pi, (cells, cells))
    gradient = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    u, v = x * cells / SIZE, z * cells / SIZE
    column, row = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    u, v = u - column, v - row
    total = np.zeros_like(u)
    for down in (0, 1):
        for right in (0, 1):
            at = gradient[(row + down) % cells, (column + right) % cells]
            weight = _fade(u if right else 1 - u) * _fade(v if down else 1 - v)
            total += weight * (at[..., 0] * (u - right) + at[..., 1] * (v - down))
    return total


def _fade(t: Floats) -> Floats:
    return t * t * t * (t * (t * 6 - 15) + 10)
