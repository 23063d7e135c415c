"""The ground's one colour texture: grass, sand, gravel, path, mud and shade, baked once.

Colours are stored as square roots of linear values in rgb; alpha says how much of which of the detail
texture's two patterns shows there: 0 pebbles, 1 grass, plain halfway.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from renderer.scene.noise import Floats, grid_fbm, grid_noise, resolved_fbm, smoothstep
from renderer.scene.shore import Shore
from renderer.scene.terrain import Axis

Polyline = Sequence[tuple[float, float]]

_LUSH = np.array((0.090, 0.120, 0.040), np.float32)
_FRESH = np.array((0.148, 0.172, 0.060), np.float32)
_DEEP = np.array((0.055, 0.088, 0.030), np.float32)
_DRY = np.array((0.235, 0.210, 0.100), np.float32)
_SOIL = np.array((0.128, 0.104, 0.074), np.float32)
_SAND = np.array((0.400, 0.325, 0.215), np.float32)
_GRAVEL = np.array((0.265, 0.245, 0.210), np.float32)
_PALE = np.array((0.400, 0.375, 0.330), np.float32)
_MUD = np.array((0.165, 0.138, 0.082), np.float32)
_SILT = np.array((0.070, 0.070, 0.038), np.float32)
_ALGAE = np.array((0.066, 0.095, 0.024), np.float32)
_ROCK = np.array((0.205, 0.195, 0.180), np.float32)
_LITTER = np.array((0.120, 0.082, 0.042), np.float32)


REACH = 7.0
"""Metres from the waterline within which the shore's colours are drawn."""


@dataclass(frozen=True, eq=False)
class Noises:
    """The noises that all of the ground's patterns share; wavelengths 0.42, 2.6, 13, 0.21 and 0.1 m."""

    fine: Floats
    medium: Floats
    broad: Floats
    stain: Floats
    speck: Floats
    """Near the shore only."""


@dataclass(frozen=True)
class Shade:
    """A round patch of shade on the ground: (x, z), radius in metres, strength 0 to 1."""

    x: float
    z: float
    radius: float
    strength: float


@dataclass(frozen=True)
class Bed:
    """How the ground under water changes with depth, metres."""

    bare: tuple[float, float] = (0.4, 1.15)
    """Where the shore's sand and stones begin and cease to give way to mud."""
    algae: float = 0.65
    """Share of the mud that weed covers in its patches."""
    silt: tuple[float, float] = (0.5, 1.7)
    """Where silt begins, and where it lies closed."""
    absorption: tuple[float, float, float] = (0.30, 0.16, 0.22)
    """Per metre, for red, green and blue."""


@dataclass(frozen=True)
class Floor:
    """The ground under close trees, as shares."""

    gloom: float = 0.34
    """How much of the light they take."""
    litter: float = 0.38
    """How much of the ground dead leaves cover."""


POND_BED = Bed()
POND_FLOOR = Floor()


def ground_colors(
    axis: Axis,
    shore: Shore,
    size: int,
    seed: int,
    *,
    paths: Sequence[Polyline],
    shades: Sequence[Shade],
    woods: Floats,
    bed: Bed = POND_BED,
    rock: Floats | None = None,
    is_wide: bool = False,
    floor: Floor = POND_FLOOR,
) -> NDArray[np.uint8]:
    """The texture, (size, size, 4), over the reach of ``axis``; ``woods`` is 1 where trees stand close.

    ``rock`` is 1 where bare rock shows. ``is_wide`` says that far texels are too coarse for the fine noises.
    """
    texels = axis.texels(size)
    x = texels.world
    noise = _resolved_noises(x, seed) if is_wide else _noises(x, seed)
    color, grass = _meadow(noise, _resampled(woods, size), path_share(texels, paths), floor)
    if rock is not None:
        _outcrop(color, grass, _resampled(rock, size), noise)
    rough = (1 - grass) * np.float32(0.35)
    window = _window(axis, shore, size)
    inside = Shore(
        *(_resampled(part, size)[window] for part in (shore.distance, shore.sand, shore.stones, shore.height))
    )
    speck = noise.speck[window] if is_wide else grid_noise(x[window[1]], x[window[0]], 0.10, seed + 5)
    near = Noises(noise.fine[window], noise.medium[window], noise.broad[window], noise.stain[window], speck)
    color[window], grass[window], rough[window] = _banks(color[window], grass[window], inside, near, bed)
    color *= _light_share(texels, shades)[..., None]
    image = np.empty((size, size, 4), np.uint8)
    image[..., :3] = np.sqrt(np.clip(color, 0, 1)) * 255 + 0.5
    image[..., 3] = np.clip(0.5 + 0.5 * grass - 0.5 * rough, 0, 1) * 255 + 0.5
    return image


def _noises(x: NDArray[np.float64], seed: int) -> Noises:
    return Noises(
        fine=grid_fbm(x, x, 0.42, seed + 1, octaves=3, gain=0.8),
        medium=grid_fbm(x, x, 2.6, seed + 2, octaves=4, gain=0.7),
        broad=grid_fbm(x, x, 13.0, seed + 3, octaves=2),
        stain=grid_noise(x, x, 0.21, seed + 4),
        speck=np.zeros((0, 0), np.float32),
    )


def _resolved_noises(x: NDArray[np.float64], seed: int) -> Noises:
    return Noises(
        fine=resolved_fbm(x, 0.42, seed + 1, octaves=3, gain=0.8),
        medium=resolved_fbm(x, 2.6, seed + 2, octaves=4, gain=0.7),
        broad=resolved_fbm(x, 13.0, seed + 3, octaves=2),
        stain=resolved_fbm(x, 0.21, seed + 4, octaves=1),
        speck=resolved_fbm(x, 0.10, seed + 5, octaves=1),
    )


def _meadow(noise: Noises, woods: Floats, path: Floats, floor: Floor) -> tuple[Floats, Floats]:
    """Grass in its tones, leaf litter under trees, and trodden paths: (colour, share of grass)."""
    fine, medium, broad = noise.fine, noise.medium, noise.broad
    color = np.full((*fine.shape, 3), _LUSH, np.float32)
    _mix(color, _FRESH, _ramp(-0.5, 0.9, broad + 0.5 * medium))
    _mix(color, _DEEP, 0.8 * _ramp(0.1, 0.7, 0.9 * medium - 0.5 * broad))
    _mix(color, _DRY, 0.65 * _ramp(0.3, 1.1, 0.8 * medium + 0.7 * broad + 0.45 * fine))
    litter = _ramp(0.35, 0.9, woods + 0.35 * medium + 0.15 * fine) * _ramp(0.0, 0.15, woods)
    _mix(color, _LITTER, floor.litter * litter)
    color *= (1 - np.float32(floor.gloom) * woods)[..., None]
    # Tussocks: round bright crests with narrow dark hollows between them.
    tussock: Floats = np.minimum(np.abs(noise.stain + 0.9 * fine), 0.9)
    color *= (np.float32(0.66) + np.float32(0.72) * tussock + np.float32(0.12) * fine)[..., None]
    worn = _ramp(0.50, 0.66, path + 0.22 * fine + 0.16 * medium)
    soil = _SOIL * (1 + np.float32(0.15) * fine + np.float32(0.12) * noise.stain)[..., None]
    color += (soil - color) * worn[..., None]
    return color, (1 - 0.6 * litter) * (1 - 0.9 * worn)


def _outcrop(color: Floats, grass: Floats, rock: Floats, noise: Noises) -> None:
    """Let bare rock show: in place."""
    shown = _ramp(0.42, 0.62, rock + 0.22 * noise.medium + 0.10 * noise.fine)
    stone = _ROCK * (1 + np.float32(0.16) * noise.fine + np.float32(0.14) * noise.medium)[..., None]
    color += (stone - color) * shown[..., None]
    grass *= 1 - shown


def _banks(color: Floats, grass: Floats, shore: Shore, noise: Noises, kind: Bed) -> tuple[Floats, Floats, Floats]:
    """The shore and the bed: (colour, share of grass, share of pebbles). Edges fray with the fine noise."""
    fine, medium, stain = noise.fine, noise.medium, noise.stain
    distance = shore.distance
    fray = 0.16 * fine + 0.12 * medium + 0.08 * stain + 0.13 * noise.speck
    bare = _ramp(0.30, 0.12, distance + fray) * (distance > -1)
    _mix(color, _SOIL, 0.9 * bare)
    grass = grass * (1 - bare)
    sandy = shore.sand * _ramp(2.3, 1.3, distance + 0.9 * medium) + 0.8 * fray
    stony = shore.stones * _ramp(1.9, 1.0, distance + 0.7 * medium) + 0.8 * fray
    # Earth shows in a narrow band where turf ends.
    _mix(color, _SOIL, 0.75 * _ramp(0.30, 0.44, np.maximum(sandy, stony)))
    sandy, stony = _ramp(0.45, 0.55, sandy), _ramp(0.45, 0.55, stony)
    sand = _SAND * (1 + np.float32(0.09) * fine + np.float32(0.07) * medium)[..., None]
    color = color + (sand - color) * sandy[..., None]
    far: Floats = np.abs(distance)
    drift = 0.85 * sandy * _ramp(0.05, 0.45, fine - 0.6 * medium - 0.35 * far)
    shingle: Floats = np.maximum(stony, drift)
    gravel = _GRAVEL * (1 + np.float32(0.30) * stain + np.float32(0.14) * fine)[..., None]
    gravel += (_PALE - gravel) * (0.5 * _ramp(0.45, 0.8, stain))[..., None]
    color = color + (gravel - color) * shingle[..., None]
    grass = grass * (1 - np.maximum(sandy, stony))
    rough = (1 - grass) * (0.30 + 0.70 * np.maximum(shingle, _ramp(0.1, 0.9, 0.5 * stain + 0.5 * fine)))

    depth = -shore.height
    is_wet = _ramp(-0.03, 0.06, depth + 0.01 * fine)
    bed = _bed(color, np.maximum(sandy, stony), depth, noise, kind)
    color = color + (bed - color) * is_wet[..., None]
    grass = grass * (1 - is_wet) * (distance > -0.6)
    wet = _ramp(0.13, 0.035, shore.height + 0.018 * fine + 0.012 * medium) * _ramp(0.35, 0.0, depth)
    color *= (1 - np.float32(0.5) * wet)[..., None]
    return color, grass, rough.astype(np.float32, copy=False)


def _bed(color: Floats, bare: Floats, depth: Floats, noise: Noises, kind: Bed) -> Floats:
    """The shore's sand and stones run out under water into mud, silt and weed, darker as it deepens."""
    fine, medium, broad, stain = noise.fine, noise.medium, noise.broad, noise.stain
    bed = np.full(color.shape, _MUD, np.float32)
    _mix(bed, _GRAVEL, 0.4 * _ramp(0.1, 1.0, stain + 0.6 * fine))
    bed *= (1 + np.float32(0.22) * fine + np.float32(0.12) * stain)[..., None]
    bed += (color - bed) * (bare * _ramp(kind.bare[1], kind.bare[0], depth + 0.25 * medium))[..., None]
    _mix(bed, _ALGAE, kind.algae * _ramp(0.1, 0.9, medium + 0.5 * fine + 0.25 * broad) * _ramp(0.08, 0.5, depth))
    _mix(bed, _SILT, 0.9 * _ramp(*kind.silt, depth + 0.2 * medium))
    # Water takes red first: a hint of it, for techniques that know no absorption.
    deep = np.maximum(depth, 0)
    for channel, rate in enumerate(kind.absorption):
        bed[..., channel] *= np.exp(np.float32(-rate) * deep)
    return bed


def _window(axis: Axis, shore: Shore, size: int) -> tuple[slice, slice]:
    """The rows and columns of texels that the shore's colours reach."""
    is_near = shore.distance < REACH
    spans = []
    for flat in (is_near.any(axis=1), is_near.any(axis=0)):
        touched = np.flatnonzero(flat) / (axis.count - 1) * size
        spans.append(slice(int(touched[0]), min(int(touched[-1]) + 2, size)))
    return spans[0], spans[1]


def path_share(axis: Axis, paths: Sequence[Polyline]) -> Floats:
    """1 in the middle of a trodden path, 0 from a metre off it; drawn coarsely and enlarged."""
    coarse = axis.texels(max(axis.count // 4, 1))
    x, z = coarse.world[None, :], coarse.world[:, None]
    nearest = np.full((coarse.count, coarse.count), 9.0)
    for path in paths:
        for start, end in pairwise(path):
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


def _mix(color: Floats, other: Floats, share: Floats) -> None:
    """Change a colour by a share of another."""
    for channel in range(3):
        part = color[..., channel]
        part += (other[channel] - part) * share


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
    smooth = rows[low] * (1 - part)[:, None] + rows[high] * part[:, None]
    return smooth.astype(np.float32, copy=False)
