"""Seeded noise from integer hashes: the same values on every machine.

Only IEEE additions, multiplications and table look-ups stand between a seed and a value. The hash is
the 32-bit ``lowbias`` mixer (Wellons 2018, "Prospecting for hash functions").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

_NORM = 1.8
"""Brings a cubic B-spline of uniform lattice values to a standard deviation of one half."""


def hashed(seed: int, *cells: NDArray[np.integer]) -> Floats:
    """Uniform values in [0, 1), one for each cell of broadcast integer coordinates."""
    state = np.asarray(np.uint32((seed * 0x9E3779B1 + 0x7F4A7C15) & 0xFFFFFFFF))
    for cell in cells:
        state = _mixed(state ^ (np.asarray(cell).astype(np.int64) & 0xFFFFFFFF).astype(np.uint32))
    return (state >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)


def scattered(seed: int, count: int, width: int) -> NDArray[np.float64]:
    """A (count, width) table of uniform values in [0, 1)."""
    table = hashed(seed, np.arange(count)[:, None], np.arange(width)[None, :])
    return table.astype(np.float64)


def grid_noise(
    x: NDArray[np.floating],
    z: NDArray[np.floating],
    wavelength: float,
    seed: int,
    *,
    period: float | tuple[float, float] | None = None,
) -> Floats:
    """Smooth noise on the grid of two axes, as (len(z), len(x)); mean 0, standard deviation 0.5.

    ``wavelength`` is the lattice spacing in the axes' unit. With ``period`` (along x and z, whole
    numbers of wavelengths) the noise repeats. A cubic B-spline of the lattice is separable, so a grid costs four
    taps along each axis.
    """
    cell_x, weight_x = _taps(x, wavelength)
    cell_z, weight_z = _taps(z, wavelength)
    wide = np.arange(cell_x.min() - 1, cell_x.max() + 3)
    deep = np.arange(cell_z.min() - 1, cell_z.max() + 3)
    column, row = wide, deep
    if period is not None:
        periods = period if isinstance(period, tuple) else (period, period)
        column, row = wide % round(periods[0] / wavelength), deep % round(periods[1] / wavelength)
    lattice = hashed(seed, column[None, :], row[:, None])
    lattice = (lattice * np.float32(2) - np.float32(1)) * np.float32(_NORM)
    rows = np.zeros((len(deep), len(x)), np.float32)
    for tap in range(4):
        rows += lattice[:, cell_x - wide[0] + tap - 1] * weight_x[tap]
    noise: Floats = rows[cell_z - deep[0] - 1]
    noise *= weight_z[0][:, None]
    for tap in range(1, 4):
        part = rows[cell_z - deep[0] + tap - 1]
        part *= weight_z[tap][:, None]
        noise += part
    return noise


def grid_fbm(
    x: NDArray[np.floating],
    z: NDArray[np.floating],
    wavelength: float,
    seed: int,
    *,
    octaves: int = 4,
    gain: float = 0.5,
    period: float | tuple[float, float] | None = None,
) -> Floats:
    """Octaves of :func:`grid_noise`, each half as long and ``gain`` as strong; deviation about 0.5."""
    total = grid_noise(x, z, wavelength, seed, period=period)
    amplitude, power = 1.0, 1.0
    for octave in range(1, octaves):
        amplitude *= gain
        power += amplitude**2
        part = grid_noise(x, z, wavelength / 2**octave, seed + 101 * octave, period=period)
        part *= np.float32(amplitude)
        total += part
    total *= np.float32(power**-0.5)
    return total


def resolved_fbm(
    x: NDArray[np.floating], wavelength: float, seed: int, *, octaves: int = 4, gain: float = 0.5
) -> Floats:
    """:func:`grid_fbm` on the square grid of one axis, without what the grid is too coarse to carry.

    Each octave fades where the samples lie farther apart than a third to a half of its wavelength: on a
    warped axis the far samples stay smooth, and only the near part of a fine octave is worked out.
    """
    spacing = np.gradient(np.asarray(x, np.float64))
    total = np.zeros((len(x), len(x)), np.float32)
    power = 0.0
    for octave in range(octaves):
        length, amplitude = wavelength / 2**octave, gain**octave
        power += amplitude**2
        carried = np.flatnonzero(spacing < 0.5 * length)
        if not len(carried):
            continue
        inner = slice(int(carried[0]), int(carried[-1]) + 1)
        fade = np.clip((0.5 - spacing[inner] / length) / 0.17, 0, 1).astype(np.float32) * np.float32(amplitude)
        part = grid_noise(x[inner], x[inner], length, seed + 101 * octave)
        part *= np.minimum(fade[:, None], fade[None, :])
        total[inner, inner] += part
    total *= np.float32(power**-0.5)
    return total


def point_noise(
    points: NDArray[np.floating],
    wavelength: float,
    seed: int,
) -> NDArray[np.float64]:
    """Smooth noise in [-1, 1] at (n, d) points of any dimension: hashed lattice, quintic blend."""
    scaled = np.asarray(points, np.float64) / wavelength
    cell = np.floor(scaled)
    part = scaled - cell
    blend = part**3 * (part * (part * 6 - 15) + 10)
    corner = cell.astype(np.int64)
    dimension = scaled.shape[1]
    total = np.zeros(len(scaled))
    for code in range(2**dimension):
        bits = [(code >> axis) & 1 for axis in range(dimension)]
        weight = np.ones(len(scaled))
        for axis, bit in enumerate(bits):
            weight = weight * (blend[:, axis] if bit else 1 - blend[:, axis])
        cells = [corner[:, axis] + bit for axis, bit in enumerate(bits)]
        total += weight * (hashed(seed, *cells) * 2.0 - 1.0)
    return total


def point_fbm(
    points: NDArray[np.floating],
    wavelength: float,
    seed: int,
    *,
    octaves: int = 4,
) -> NDArray[np.float64]:
    """Octaves of :func:`point_noise`, each half as long and half as strong."""
    total = np.zeros(len(points))
    for octave in range(octaves):
        total += point_noise(points, wavelength / 2**octave, seed + 101 * octave) / 2**octave
    return total


def smoothstep(low: float, high: float, value: Floats) -> Floats:
    """0 below ``low``, 1 above ``high``, a cubic between; ``low`` may be the greater."""
    ramp: Floats = np.clip((value - np.float32(low)) * np.float32(1 / (high - low)), 0, 1)
    return ramp * ramp * (3 - 2 * ramp)


def _mixed(state: NDArray[np.uint32]) -> NDArray[np.uint32]:
    state = state ^ (state >> np.uint32(16))
    state = state * np.uint32(0x7FEB352D)
    state = state ^ (state >> np.uint32(15))
    state = state * np.uint32(0x846CA68B)
    return state ^ (state >> np.uint32(16))


def _taps(axis: NDArray[np.floating], wavelength: float) -> tuple[NDArray[np.int64], list[Floats]]:
    scaled = np.asarray(axis, np.float64) / wavelength
    cell = np.floor(scaled)
    t = scaled - cell
    weights = [(1 - t) ** 3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6]
    return cell.astype(np.int64), [weight.astype(np.float32) for weight in weights]
