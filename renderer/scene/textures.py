"""Tiling detail textures, drawn with NumPy: ground, rock, wood and a forest's canopy.

Each is RGBA8, linear, and repeats. Red and green hold the slope of the surface (0.5 is level), blue a
factor on the colour (0.5 is neutral, and the mean), alpha a second factor or a neutral one. Low
frequencies are taken out, so that the eye finds no tile.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.scene.noise import Floats, grid_fbm, grid_noise, hashed, scattered, smoothstep

Bytes = NDArray[np.uint8]


def ground_detail(size: int, seed: int) -> Bytes:
    """Pebbles and coarse sand (slope, blue) and short grass (alpha), for the whole terrain."""
    height, shade = pebbles(size, seed, radii=((10.0, 60), (7.0, 260), (5.0, 800), (3.4, 2000), (2.3, 3600)))
    texel = _texels(size)
    grain = grid_fbm(texel, texel, size / 128, seed + 5, octaves=2, period=float(size))
    height = height + 0.5 * grain
    stone = 0.55 + 0.42 * (shade - 0.5) + 0.040 * np.minimum(height, 6) + 0.05 * grain
    clumps = grid_fbm(texel, texel, size / 16, seed + 11, octaves=2, period=float(size))
    return packed(height, 0.42, stone, second=_blades(size, seed + 9) + np.float32(0.09) * clumps)


def rock_detail(size: int, seed: int) -> Bytes:
    """Weathered stone: lumps, pits and a few cracks."""
    texel = _texels(size)
    period = float(size)
    lumps = grid_fbm(texel, texel, size / 8, seed, octaves=6, gain=0.62, period=period)
    veins = grid_fbm(texel, texel, size / 4, seed + 31, octaves=4, period=period)
    crack = smoothstep(0.045, 0.0, np.abs(veins))
    pits = smoothstep(0.35, 0.9, grid_noise(texel, texel, size / 64, seed + 47, period=period))
    speckle = grid_noise(texel, texel, size / 256, seed + 53, period=period)
    height = 11.0 * lumps - 5.0 * crack - 3.0 * pits + 0.7 * speckle
    shade = 0.5 + 0.17 * lumps - 0.16 * crack - 0.14 * pits + 0.10 * speckle
    return packed(height, 0.75, shade)


def wood_detail(size: int, seed: int) -> Bytes:
    """Weathered boards, grain along u: fibres, growth rings and checks; four boards lie across v."""
    texel = _texels(size)
    along, across = texel / 16, texel
    stretched = (size / 16, float(size))
    board = np.floor(texel * 4 / size)
    turn = hashed(seed, board.astype(np.int64)).astype(np.float32)[:, None]
    bend = grid_fbm(along * 2, across, size / 8, seed, octaves=2, period=(size / 8, float(size)))
    rings = (across * 44 / size)[:, None] + 1.5 * bend + 11 * turn
    late = np.abs(2 * (rings - np.floor(rings)) - 1).astype(np.float32)
    fibre = grid_fbm(along, across, size / 128, seed + 3, octaves=2, period=stretched)
    check = grid_noise(along, across, size / 64, seed + 7, period=stretched)
    check = smoothstep(0.72, 1.15, check)
    height = 1.2 * late + 1.5 * fibre - 5.0 * check
    shade = 0.5 + 0.10 * (late - 0.5) + 0.11 * fibre - 0.3 * check
    return packed(height, 0.4, shade)


def canopy_detail(size: int, seed: int) -> Bytes:
    """A wood seen from afar: rounded crowns, dark between them."""
    height, shade = pebbles(size, seed, radii=((20.0, 60), (15.0, 160), (11.0, 300), (7.0, 500)))
    texel = _texels(size)
    leaves = grid_fbm(texel, texel, size / 64, seed + 5, octaves=3, gain=0.7, period=float(size))
    height = height + 1.6 * leaves
    light = 0.28 + 0.034 * np.minimum(height, 12) + 0.30 * (shade - 0.5) + 0.10 * leaves
    return packed(height, 0.16, light)


def pebbles(
    size: int,
    seed: int,
    radii: tuple[tuple[float, int], ...],
) -> tuple[Floats, Floats]:
    """A bed of rounded stones as (height in texels, shade 0..1 of each stone), repeating.

    ``radii`` lists (radius in texels, count) from the largest down; where stones overlap the higher
    one is seen.
    """
    height = np.zeros(size * size, np.float32)
    shade = np.full(size * size, 0.5, np.float32)
    places, levels, tones = [], [], []
    for number, (radius, count) in enumerate(radii):
        table = scattered(seed + 17 * number, count, 7)
        reach = int(np.ceil(radius * 1.3))
        down, across = np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, indexing="ij")
        centre = table[:, :2] * size
        corner = np.floor(centre).astype(np.int64)
        offset_z = down[None] - (centre - corner)[:, 0, None, None]
        offset_x = across[None] - (centre - corner)[:, 1, None, None]
        # A turned ellipse, from a unit vector that is drawn in a square: no trigonometry to round.
        axis = table[:, 2:4] * 2 - 1
        axis /= np.sqrt((axis * axis).sum(axis=1, keepdims=True)) + 1e-9
        squeeze = 0.55 + 0.45 * table[:, 4, None, None]
        u = offset_x * axis[:, 0, None, None] + offset_z * axis[:, 1, None, None]
        v = (offset_z * axis[:, 0, None, None] - offset_x * axis[:, 1, None, None]) / squeeze
        scale = radius * (0.8 + 0.45 * table[:, 5, None, None])
        inside = 1 - (u * u + v * v) / (scale * scale)
        chosen = inside > 0
        row = (corner[:, 0, None, None] + down[None]) % size
        column = (corner[:, 1, None, None] + across[None]) % size
        places.append((row * size + column)[chosen])
        dome = 0.75 * scale * squeeze * np.sqrt(np.maximum(inside, 0))
        levels.append(dome[chosen])
        tones.append(np.broadcast_to(table[:, 6, None, None], chosen.shape)[chosen])
    place, level, tone = (np.concatenate(part) for part in (places, levels, tones))
    order = np.argsort(level, kind="stable")
    height[place[order]] = level[order]
    shade[place[order]] = tone[order]
    return height.reshape(size, size), shade.reshape(size, size)


def _blades(size: int, seed: int, count: int = 16000) -> Floats:
    """Short grass from above: strokes, dark at the root and light at the tip."""
    table = scattered(seed, count, 6)
    lean = table[:, 2:4] * 2 - 1
    length = (size / 512) * (9 + 15 * table[:, 4])
    step = np.linspace(0, 1, 20)
    bow = (table[:, 5] - 0.5)[:, None] * 0.8
    x = table[:, 0, None] * size + length[:, None] * (lean[:, 0, None] * step - bow * lean[:, 1, None] * step**2)
    z = table[:, 1, None] * size + length[:, None] * (lean[:, 1, None] * step + bow * lean[:, 0, None] * step**2)
    rise = step[None, :] * (0.6 + 0.8 * table[:, 4, None]) + 0.3 * table[:, 5, None]
    tone = 0.34 + 0.30 * step[None, :] + 0.28 * (hashed(seed + 1, np.arange(count))[:, None] - 0.5)
    place = (z.astype(np.int64) % size) * size + x.astype(np.int64) % size
    order = np.argsort(rise.ravel(), kind="stable")
    image = np.full(size * size, 0.22, np.float32)
    image[place.ravel()[order]] = tone.ravel()[order]
    square: Floats = image.reshape(size, size)
    return (square * 2 + np.roll(square, 1, 0) + np.roll(square, 1, 1)) / np.float32(4)


def packed(height: Floats, strength: float, shade: Floats, second: Floats | None = None) -> Bytes:
    """The four channels: the slopes of a height in texels, and its factors, their means made neutral."""
    slope_x = (np.roll(height, 1, axis=1) - np.roll(height, -1, axis=1)) / 2
    slope_z = (np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)) / 2
    steep = np.sqrt(1 + slope_x**2 + slope_z**2) / strength
    image = np.full((*height.shape, 4), 0.5, np.float32)
    image[..., 0] += 0.5 * slope_x / steep
    image[..., 1] += 0.5 * slope_z / steep
    image[..., 2] = _levelled(shade)
    if second is not None:
        image[..., 3] = _levelled(second)
    return (image * 255 + 0.5).clip(0, 255).astype(np.uint8)


def _levelled(shade: Floats) -> Floats:
    """A factor without its low frequencies, with a mean of one half."""
    size = len(shade)
    block = max(size // 8, 1)
    coarse = shade.reshape(8, block, 8, block).mean(axis=(1, 3))
    texel = (np.arange(size) + 0.5) / block - 0.5
    low = np.floor(texel).astype(np.int64)
    part = (texel - low).astype(np.float32)
    rows = coarse[low % 8] * (1 - part)[:, None] + coarse[(low + 1) % 8] * part[:, None]
    smooth = rows[:, low % 8] * (1 - part) + rows[:, (low + 1) % 8] * part
    level: Floats = shade - smooth
    return level + np.float32(0.5 - level.mean())


def _texels(size: int) -> NDArray[np.float64]:
    return np.arange(size, dtype=np.float64) + 0.5
