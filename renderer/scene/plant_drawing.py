"""Paints what is not a leaf cluster: lily pads, strips for blades and petals, bark."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray

from renderer.scene.leaf_drawing import Paint

STRIPS: Mapping[str, Paint] = MappingProxyType(
    {
        "grass": (118, 140, 62),
        "sedge": (104, 130, 60),
        "reed": (122, 142, 72),
        "cattail": (98, 130, 72),
        "straw": (168, 150, 98),
        "plume": (128, 104, 84),
        "spike": (88, 64, 46),
        "wood": (110, 92, 72),
        "blossom": (236, 150, 160),
        "petal": (244, 240, 232),
        "yolk": (232, 178, 40),
        "flag": (240, 204, 52),
    }
)
"""Upright strips of the cell ``strips``, from left to right: neighbours are alike, since far mipmaps mix them."""


def strip(name: str) -> tuple[float, float]:
    """Middle and half width of a strip in cell coordinates; the margin to its neighbours is left out."""
    pitch = 1 / len(STRIPS)
    return (list(STRIPS).index(name) + 0.5) * pitch, 0.28 * pitch


def strips(seed: int, texels: int) -> NDArray[np.float32]:
    """The strips: fine veins along, a light rib in the middle, paler towards the tip (t = 1)."""
    rng = Generator(PCG64(seed))
    count = len(STRIPS)
    x = (np.arange(texels) + 0.5) / texels * count
    index = np.minimum(x.astype(int), count - 1)
    across = np.abs(x - index - 0.5) * 2
    paint = np.array(list(STRIPS.values()))[index] / 255
    veins = 1 + 0.06 * rng.normal(size=texels) + 0.10 * np.exp(-((across / 0.16) ** 2)) - 0.1 * across**2
    t = 1 - (np.arange(texels)[:, None] + 0.5) / texels
    shade = (0.94 + 0.1 * t) * (1 + 0.05 * smooth_noise(rng, texels, 16))
    color = paint[None] * (veins * shade)[..., None]
    return np.concatenate([np.clip(color, 0, 1), np.ones((texels, texels, 1))], axis=2).astype(np.float32)


def pad(seed: int, texels: int) -> NDArray[np.float32]:
    """A water lily's pad from above: veins that fork from the middle, mottled, with a reddish margin."""
    rng = Generator(PCG64(seed))
    axis = (np.arange(texels) + 0.5) / texels * 2 - 1
    x, y = np.meshgrid(axis, -axis)
    radius, turn = np.hypot(x, y), np.arctan2(y, x)
    wander = turn + 0.10 * smooth_noise(rng, texels, 6) * radius
    main = np.abs(np.sin(wander * 8))
    fork = np.abs(np.sin(wander * 16 + 1.57 * np.sign(np.sin(wander * 16))))
    width = 0.05 / np.maximum(radius, 0.08)
    veins = np.exp(-((main / (0.7 * width + 0.03)) ** 2)) * np.clip(1.15 - radius, 0, 1)
    veins += 0.5 * np.exp(-((fork / (width + 0.08)) ** 2)) * np.clip((radius - 0.45) * 3, 0, 1)
    mottle = smooth_noise(rng, texels, 8) * 0.6 + smooth_noise(rng, texels, 32) * 0.4
    green = np.array([84, 112, 62]) / 255
    pale = np.array([158, 172, 112]) / 255
    rust = np.array([132, 100, 62]) / 255
    color = green * (1 + 0.16 * mottle[..., None]) * (0.92 + 0.16 * radius[..., None])
    color = color + (pale - color) * (0.75 * np.clip(veins, 0, 1) + 0.4 * np.exp(-((radius / 0.12) ** 2)))[..., None]
    margin = np.clip((radius - 0.9) * 9, 0, 1) * np.clip(0.55 + mottle, 0, 1)
    spots = np.clip((smooth_noise(rng, texels, 24) - 0.55) * 4, 0, 1) * 0.6
    color = color + (rust - color) * np.clip(0.7 * margin + spots, 0, 1)[..., None]
    return np.concatenate([np.clip(color, 0, 1), np.ones((texels, texels, 1))], axis=2).astype(np.float32)


def bark(seed: int, width: int = 256, rows: int = 512) -> NDArray[np.uint8]:
    """Two barks side by side, (rows, width, 4): furrowed on the left, birch on the right; periodic upwards."""
    rng = Generator(PCG64(seed))
    half = width // 2
    noise = smooth_noise(rng, half, 12, rows, 5)
    fine = smooth_noise(rng, half, 40, rows, 24)
    ridges = np.abs(smooth_noise(rng, half, 16, rows, 7) + 0.35 * fine)
    shade = 0.5 + 0.62 * np.clip(ridges * 1.6, 0, 1) + 0.12 * noise + 0.1 * fine
    furrowed = np.array([118, 104, 86]) * shade[..., None]
    lichen = np.clip(smooth_noise(rng, half, 5, rows, 6) - 0.35, 0, 1)[..., None]
    furrowed = furrowed + (np.array([128, 138, 104]) - furrowed) * lichen
    bands = smooth_noise(rng, half, 3, rows, 60) + 0.6 * smooth_noise(rng, half, 2, rows, 14)
    marks = np.clip((bands - 0.75) * 3, 0, 1)[..., None]
    white = np.array([226, 220, 208]) * (0.93 + 0.08 * smooth_noise(rng, half, 4, rows, 30))[..., None]
    birch = white + (np.array([58, 50, 46]) - white) * marks
    color = np.clip(np.concatenate([furrowed, birch], axis=1), 0, 255)
    return np.concatenate([color, np.full((rows, width, 1), 255)], axis=2).astype(np.uint8)


def smooth_noise(
    rng: Generator, columns: int, across: int, rows: int | None = None, down: int | None = None
) -> NDArray[np.float64]:
    """Periodic value noise of about -1..1, (rows, columns), with ``across`` by ``down`` cells."""
    rows, down = rows or columns, down or across
    grid = rng.uniform(-1, 1, (down, across))
    u, v = np.arange(columns) / columns * across, np.arange(rows) / rows * down
    i, j = v.astype(int), u.astype(int)
    a, b = _eased(v - i)[:, None], _eased(u - j)[None]
    i1, j1 = (i + 1) % down, (j + 1) % across
    top = grid[np.ix_(i, j)] * (1 - b) + grid[np.ix_(i, j1)] * b
    bottom = grid[np.ix_(i1, j)] * (1 - b) + grid[np.ix_(i1, j1)] * b
    return np.asarray(top * (1 - a) + bottom * a)


def _eased(t: NDArray[np.float64]) -> NDArray[np.float64]:
    return t * t * (3 - 2 * t)
