"""The ground's one colour texture: grass, sand, gravel, path, mud and shade, baked once.

Colours are stored as square roots of linear values in rgb; alpha says how much of which of the detail
texture's two patterns shows there: 0 pebbles, 1 grass, plain halfway.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene.noise import Floats, grid_fbm, grid_noise, smoothstep
from renderer.scene.shore import Shore
from renderer.scene.terrain import Axis

Polyline = Sequence[tuple[float, float]]

_LUSH = (0.078, 0.108, 0.034)
_FRESH = (0.128, 0.150, 0.050)
_DEEP = (0.044, 0.070, 0.026)
_DRY = (0.205, 0.180, 0.090)
_SOIL = (0.128, 0.104, 0.074)
_SAND = (0.400, 0.325, 0.215)
_GRAVEL = (0.265, 0.245, 0.210)
_PALE = (0.400, 0.375, 0.330)
_MUD = (0.105, 0.088, 0.050)
_SILT = (0.062, 0.062, 0.034)
_ALGAE = (0.052, 0.078, 0.018)
_LITTER = (0.120, 0.082, 0.042)


@dataclass(frozen=True)
class Shade:
    """A round patch of shade on the ground: (x, z), radius in metres, strength 0 to 1."""

    x: float
    z: float
    radius: float
    strength: float


def ground_colors(
    axis: Axis,
    shore: Shore,
    size: int,
    seed: int,
    *,
    paths: Sequence[Polyline],
    shades: Sequence[Shade],
    woods: Floats,
) -> NDArray[np.uint8]:
    """The texture, (size, size, 4), over the reach of ``axis``; ``woods`` is 1 where trees stand close."""
    texels = axis.texels(size)
    x = texels.world
    distance, sand, stones, height, woods = (
        _resampled(part, size) for part in (shore.distance, shore.sand, shore.stones, shore.height, woods)
    )
    fine = grid_fbm(x, x, 0.42, seed + 1, octaves=3, gain=0.7)
    medium = grid_fbm(x, x, 2.6, seed + 2, octaves=3, gain=0.6)
    broad = grid_fbm(x, x, 13.0, seed + 3, octaves=2)
    stain = grid_noise(x, x, 0.21, seed + 4)

    color = _mixed(np.empty((size, size, 3), np.float32) + np.float32(_LUSH), _FRESH, _ramp(-0.5, 0.9, broad + 0.5 * medium))
    color = _mixed(color, _DEEP, 0.75 * _ramp(0.15, 0.9, 0.8 * medium - 0.6 * broad))
    color = _mixed(color, _DRY, 0.55 * _ramp(0.45, 1.25, 0.7 * medium + 0.8 * broad + 0.3 * fine))
    color = _mixed(color, _LITTER, 0.75 * _ramp(0.35, 0.9, woods + 0.3 * medium + 0.1 * fine))
    color *= (1 + np.float32(0.30) * fine + np.float32(0.12) * stain)[..., None]
    grass = 1 - 0.6 * _ramp(0.4, 0.9, woods + 0.3 * medium)

    worn = _path_share(texels, paths) + 0.28 * fine + 0.16 * medium
    worn = _ramp(0.42, 0.78, worn)
    color = _mixed(color, _SOIL, worn)
    grass = grass * (1 - 0.85 * worn)

    # The shore: bare earth under the grass's edge, sand, stones. Edges fray with the fine noise.
    edge = distance + 0.22 * fine + 0.12 * medium
    bare = _ramp(0.34, 0.02, edge) * (distance > -1)
    color = _mixed(color, _SOIL, 0.85 * bare)
    grass = grass * (1 - bare)
    beach = sand * _ramp(3.6, 2.2, distance + 0.8 * medium + 0.35 * fine)
    sandy = _ramp(0.40, 0.62, beach + 0.12 * fine)
    tone = np.float32(_SAND) * (1 + 0.10 * fine + 0.06 * medium)[..., None]
    color = color + (tone - color) * sandy[..., None]
    stony = stones * _ramp(2.4, 1.2, distance + 0.6 * medium + 0.3 * fine)
    stony = _ramp(0.40, 0.62, stony + 0.15 * fine)
    shingle = np.maximum(stony, 0.75 * sandy * _ramp(0.1, 0.75, fine - 0.5 * medium - 0.4 * np.abs(distance)))
    gravel = np.float32(_GRAVEL) * (1 + 0.34 * stain + 0.1 * fine)[..., None]
    gravel += (np.float32(_PALE) - gravel) * (0.5 * _ramp(0.45, 0.8, stain))[..., None]
    color = color + (gravel - color) * shingle[..., None]
    grass = grass * (1 - np.maximum(sandy, stony))

    color, grass = _under_water(color, grass, height, distance, (sandy, stony), (fine, medium, broad, stain))
    line = height + 0.018 * fine + 0.012 * medium
    wet = _ramp(0.13, 0.035, line)
    color *= (1 - np.float32(0.50) * wet * _ramp(-0.35, 0.0, height))[..., None]
    color *= _light_share(texels, shades)[..., None]
    image = np.empty((size, size, 4), np.uint8)
    image[..., :3] = np.sqrt(np.clip(color, 0, 1)) * 255 + 0.5
    rough = (1 - grass) * (0.3 + 0.7 * np.maximum(shingle, _ramp(0.1, 0.9, 0.5 * stain + 0.5 * fine)))
    image[..., 3] = np.clip(0.5 + 0.5 * grass - 0.5 * rough, 0, 1) * 255 + 0.5
    return image


def _under_water(
    color: Floats,
    grass: Floats,
    height: Floats,
    distance: Floats,
    shores: tuple[Floats, Floats],
    noises: tuple[Floats, Floats, Floats, Floats],
) -> tuple[Floats, Floats]:
    """The bed: the shore's stones and sand run out into mud, silt and weed, darker as it deepens."""
    fine, medium, broad, stain = noises
    sandy, stony = shores
    depth = -height
    is_wet = _ramp(-0.03, 0.06, depth + 0.01 * fine)
    cover = np.maximum(sandy, stony) * _ramp(1.05, 0.35, depth + 0.25 * medium)
    bed = _mixed(np.empty_like(color) + np.float32(_MUD), _GRAVEL, 0.55 * _ramp(0.5, 1.0, stain + 0.3 * medium))
    bed *= (1 + np.float32(0.16) * fine)[..., None]
    bed = bed + (color - bed) * cover[..., None]
    bed = _mixed(bed, _ALGAE, 0.65 * _ramp(0.1, 0.9, medium + 0.5 * fine + 0.25 * broad) * _ramp(0.08, 0.5, depth))
    bed = _mixed(bed, _SILT, 0.9 * _ramp(0.5, 1.7, depth + 0.2 * medium))
    # Water takes red first: a hint of it, for techniques that know no absorption.
    deep = np.maximum(depth, 0)
    for channel, rate in enumerate((0.30, 0.16, 0.22)):
        bed[..., channel] *= np.exp(np.float32(-rate) * deep)
    return color + (bed - color) * is_wet[..., None], grass * (1 - is_wet) * (distance > -0.6)


def _path_share(axis: Axis, paths: Sequence[Polyline]) -> Floats:
    """1 in the middle of a trodden path, 0 from a metre off it; drawn coarsely and enlarged."""
    coarse = axis.texels(max(axis.count // 4, 1))
    x, z = coarse.world[None, :], coarse.world[:, None]
    nearest = np.full((coarse.count, coarse.count), 9.0)
    for path in paths:
        for start, end in zip(path[:-1], path[1:], strict=True):
            low_x, high_x = sorted((start[0], end[0]))
            low_z, high_z = sorted((start[1], end[1]))
            columns = slice(*np.searchsorted(coarse.world, (low_x - 2, high_x + 2)))
            rows = slice(*np.searchsorted(coarse.world, (low_z - 2, high_z + 2)))
            step = (end[0] - start[0], end[1] - start[1])
            off_x, off_z = x[:, columns] - start[0], z[rows] - start[1]
            share = np.clip((off_x * step[0] + off_z * step[1]) / (step[0] ** 2 + step[1] ** 2), 0, 1)
            gap = np.sqrt((off_x - share * step[0]) ** 2 + (off_z - share * step[1]) ** 2)
            nearest[rows, columns] = np.minimum(nearest[rows, columns], gap)
    return _enlarged(smoothstep(1.05, 0.1, nearest).astype(np.float32), axis.count)


def _light_share(axis: Axis, shades: Sequence[Shade]) -> Floats:
    light = np.ones((axis.count, axis.count), np.float32)
    for shade in shades:
        columns = slice(*np.searchsorted(axis.world, (shade.x - shade.radius, shade.x + shade.radius)))
        rows = slice(*np.searchsorted(axis.world, (shade.z - shade.radius, shade.z + shade.radius)))
        off_x = (axis.world[columns] - shade.x)[None, :] / shade.radius
        off_z = (axis.world[rows] - shade.z)[:, None] / shade.radius
        near = np.maximum(1 - off_x**2 - off_z**2, 0) ** 2
        light[rows, columns] *= (1 - shade.strength * near).astype(np.float32)
    return light


def _mixed(color: Floats, other: tuple[float, float, float], share: Floats) -> Floats:
    """The colour, changed in place, with a share of another."""
    for channel in range(3):
        part = color[..., channel]
        part += (np.float32(other[channel]) - part) * share
    return color


def _ramp(low: float, high: float, value: Floats) -> Floats:
    return smoothstep(low, high, value).astype(np.float32, copy=False)


def _resampled(grid: Floats, size: int) -> Floats:
    """A vertex grid at the texel centres of the same square, bilinear."""
    last = len(grid) - 1
    place = (np.arange(size) + 0.5) / size * last
    cell = np.minimum(place.astype(np.int64), last - 1)
    return _bilinear(grid, cell, cell + 1, (place - cell).astype(np.float32))


def _enlarged(image: Floats, size: int) -> Floats:
    """An image of texels at more texels, bilinear."""
    place = np.clip((np.arange(size) + 0.5) / size * len(image) - 0.5, 0, len(image) - 1)
    cell = np.minimum(place.astype(np.int64), len(image) - 2)
    return _bilinear(image, cell, cell + 1, (place - cell).astype(np.float32))


def _bilinear(grid: Floats, low: NDArray[np.int64], high: NDArray[np.int64], part: Floats) -> Floats:
    rows = grid[:, low] * (1 - part) + grid[:, high] * part
    return rows[low] * (1 - part)[:, None] + rows[high] * part[:, None]
