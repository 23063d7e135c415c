"""Draws leaf clusters, needles, pads and blades: the cells of the foliage atlas.

Everything is drawn at ``SUPERSAMPLE`` times the size with hard edges and reduced by a box weighted
with coverage. Coordinates are cell units, 0..1 with y up. Colours are sRGB 0..255: this is
paint, the light comes later.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray
from PIL import Image, ImageDraw

SUPERSAMPLE = 4
"""Drawn pixels per texel and axis."""

Paint = tuple[float, float, float]


@dataclass(frozen=True)
class Foliage:
    """How one species' cluster of leaves is painted."""

    paint: Paint
    """Mean colour of a lit leaf, sRGB 0..255."""
    leaf: float
    """Length of a leaf, cell units."""
    slim: float
    """Width of a leaf over its length."""
    twigs: int
    leaves: int
    """Leaves along one twig."""
    droop: float = 0.1
    """How much leaves turn downwards, 0..1."""
    lobes: float = 0.0
    """Depth of the lobes of the margin, 0 (smooth) to 0.4 (oak)."""


OAK = Foliage((122, 138, 74), 0.112, 0.6, 40, 7, 0.12, 0.22)
ALDER = Foliage((114, 130, 70), 0.098, 0.84, 38, 7, 0.1)
BIRCH = Foliage((146, 158, 90), 0.076, 0.78, 40, 9, 0.35)
SHRUB = Foliage((126, 138, 76), 0.09, 0.55, 42, 8, 0.0)


class Canvas:
    """A supersampled square to draw on; ``texture`` reduces it to texels."""

    def __init__(self, texels: int) -> None:
        self.texels = texels
        self.side = texels * SUPERSAMPLE
        self.image = Image.new("RGBA", (self.side, self.side))
        self._draw = ImageDraw.Draw(self.image)

    def polygon(self, points: NDArray[np.float64], paint: Paint) -> None:
        """Fill a polygon, (n, 2) cell units."""
        self._draw.polygon(self._pixels(points), fill=_rgba(paint))

    def line(self, points: NDArray[np.float64], paint: Paint, width: float) -> None:
        """Draw a polyline of ``width`` cell units."""
        pixels = max(1, round(width * self.side))
        self._draw.line(self._pixels(points), fill=_rgba(paint), width=pixels, joint="curve")

    def texture(self) -> NDArray[np.float32]:
        """The drawing, (texels, texels, 4) float32 0..1: straight colour, and coverage in alpha."""
        reduced = self.image.reduce(SUPERSAMPLE)
        return np.asarray(reduced, np.float32) / np.float32(255)

    def _pixels(self, points: NDArray[np.float64]) -> list[tuple[float, float]]:
        scaled = points * self.side
        return list(zip(scaled[:, 0].tolist(), (self.side - scaled[:, 1]).tolist(), strict=True))


def cluster(seed: int, texels: int, look: Foliage) -> NDArray[np.float32]:
    """A spray of leaves on twigs seen from outside the crown, dark within and light on top."""
    rng = Generator(PCG64(seed))
    canvas = Canvas(texels)
    twig_paint: Paint = (70, 60, 44)
    paths: list[NDArray[np.float64]] = []
    leaves: list[tuple[float, NDArray[np.float64], float, float]] = []
    turns = (np.arange(look.twigs) + rng.uniform(-0.3, 0.3, look.twigs)) * 2 * np.pi / look.twigs
    for turn in turns:
        reach = rng.uniform(0.14, 0.33)
        bend = rng.uniform(-0.7, 0.7)
        start = 0.5 + np.clip(rng.normal(0, 0.12, 2), -0.25, 0.25)
        along = np.linspace(0, 1, look.leaves + 1)
        heading = turn + bend * along
        steps = np.stack([np.cos(heading), np.sin(heading)], axis=1) * reach / look.leaves
        path = start + np.cumsum(steps, axis=0)
        path[:, 1] -= look.droop * 0.1 * along**2
        paths.append(path)
        for k, node in enumerate(path):
            side = (-1) ** k if k < look.leaves else 0
            angle = heading[k] + side * rng.uniform(0.5, 1.2) + rng.normal(0, 0.15)
            angle -= look.droop * np.cos(angle) * 0.9
            leaves.append((rng.uniform(), node, angle, look.leaf * rng.uniform(0.7, 1.15)))
    for path in paths:
        canvas.line(0.5 + np.clip(path - 0.5, -0.45, 0.45), twig_paint, 0.006)
    for depth, node, angle, length in sorted(leaves, key=lambda leaf: leaf[0]):
        tip = node + length * np.array([np.cos(angle), np.sin(angle)])
        if np.abs(tip - 0.5).max() > 0.475:
            continue
        shade = 0.5 + 0.55 * depth + 0.12 * (node[1] - 0.5) + rng.normal(0, 0.04)
        hue = rng.normal(0, 0.035)
        paint = tinted(look.paint, shade, hue)
        foreshortened = look.slim * rng.uniform(0.55, 1.0)
        bend = rng.normal(0, 0.25)
        draw_leaf(canvas, node, angle, length, foreshortened, paint, look.lobes, bend)
    return canvas.texture()


def draw_leaf(  # noqa: PLR0917 - a leaf has that many properties
    canvas: Canvas,
    base: NDArray[np.float64],
    angle: float,
    length: float,
    slim: float,
    paint: Paint,
    lobes: float = 0.0,
    bend: float = 0.0,
) -> None:
    """One leaf from its base along ``angle`` (radians): two halves that catch different light."""
    t = np.linspace(0, 1, 13)
    half = 0.5 * slim * np.sin(np.pi * t**0.8) ** 0.8 * (1 + lobes * np.sin(t * 22.0))
    heading = angle + bend * t
    spine = np.cumsum(np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    spine = base + (spine - spine[0]) * length / (len(t) - 1)
    across = np.stack([-np.sin(heading), np.cos(heading)], axis=1) * (half * length)[:, None]
    light, dark = (1.08, 0.86) if np.cos(angle) > 0 else (0.86, 1.08)
    for sign, shade in ((1.0, light), (-1.0, dark)):
        outline = np.concatenate([spine, (spine + sign * across)[::-1]])
        canvas.polygon(outline, tinted(paint, shade, 0.0))


def willow(seed: int, texels: int) -> NDArray[np.float32]:
    """Hanging strands of narrow leaves; the cell is stretched to a tall card."""
    rng = Generator(PCG64(seed))
    canvas = Canvas(texels)
    strands = 17
    order = rng.permutation(strands)
    for rank, strand in enumerate(order):
        depth = rank / (strands - 1)
        x = 0.1 + 0.8 * (strand + rng.uniform(0.2, 0.8)) / strands
        bottom = rng.uniform(0.03, 0.4)
        top = 0.97 - 0.9 * (x - 0.5) ** 2 - rng.uniform(0, 0.22) * (rank % 3 > 0)
        t = np.linspace(0, 1, 24)
        sway = 0.05 * np.sin(t * rng.uniform(2, 4) + rng.uniform(0, 6)) * t
        path = np.stack([0.5 + (x - 0.5) * (0.6 + 0.4 * np.sqrt(t)) + sway, top - t * (top - bottom)], axis=1)
        canvas.line(path, (96, 88, 48), 0.004)
        for k, node in enumerate(path):
            for side in (-1, 1):
                shade = 0.58 + 0.5 * depth + rng.normal(0, 0.06)
                angle = -np.pi / 2 + side * rng.uniform(0.15, 0.7)
                size = rng.uniform(0.07, 0.11) * (1.1 - 0.5 * k / len(path))
                draw_leaf(canvas, node, angle, size, 0.26, tinted((152, 160, 100), shade, rng.normal(0, 0.05)))
    return canvas.texture()


def pine(seed: int, texels: int) -> NDArray[np.float32]:
    """Tufts of long needles at the ends of a fan of twigs."""
    rng = Generator(PCG64(seed))
    canvas = Canvas(texels)
    tufts = []
    for _ in range(30):
        turn, reach = rng.uniform(0, 2 * np.pi), 0.36 * np.sqrt(rng.uniform(0.02, 1))
        tufts.append((rng.uniform(), 0.5 + reach * np.cos(turn), 0.46 + 0.8 * reach * np.sin(turn)))
    for depth, x, y in sorted(tufts):
        centre = np.array([x, y])
        canvas.line(np.array([[0.5, 0.4], [x, y]]), (84, 80, 58), 0.004)
        for _ in range(46):
            angle = np.pi / 2 + rng.normal(0, 0.95)
            length = rng.uniform(0.07, 0.13)
            shade = 0.48 + 0.5 * depth + 0.12 * np.sin(angle) + rng.normal(0, 0.06)
            end = centre + length * np.array([np.cos(angle), np.sin(angle)])
            canvas.line(np.stack([centre, end]), tinted((110, 130, 98), shade, rng.normal(0, 0.04)), 0.0085)
    return canvas.texture()


def spruce(seed: int, texels: int) -> NDArray[np.float32]:
    """A bough from outside: a fan of hanging twigs with short needles, lighter at their tips."""
    rng = Generator(PCG64(seed))
    canvas = Canvas(texels)
    twigs = []
    for _ in range(64):
        x = rng.uniform(-1, 1)
        top = 0.86 - 0.3 * abs(x) ** 1.5 - rng.uniform(0, 0.34)
        twigs.append(
            (rng.uniform() * 0.7 + 0.3 * (1 - top), 0.5 + 0.34 * x, top, -np.pi / 2 + 0.75 * x + rng.normal(0, 0.2))
        )
    for depth, x, y, angle in sorted(twigs):
        length = rng.uniform(0.1, 0.2)
        t = np.linspace(0, 1, 12)
        path = np.stack([x + np.cos(angle) * length * t, y + np.sin(angle) * length * t], axis=1)
        canvas.line(path, (70, 58, 44), 0.008)
        for node, share in zip(path, t, strict=True):
            for turn in (-1, -1, 1, 1):
                shade = 0.36 + 0.5 * depth + 0.22 * share + rng.normal(0, 0.06)
                lean = angle + turn * rng.uniform(0.35, 1.1)
                end = node + rng.uniform(0.028, 0.045) * np.array([np.cos(lean), np.sin(lean)])
                canvas.line(np.stack([node, end]), tinted((98, 118, 84), shade, rng.normal(0, 0.03)), 0.0075)
    return canvas.texture()


def tinted(paint: Paint, shade: float, hue: float) -> Paint:
    """Darken or lighten, and turn a green towards yellow (hue > 0) or blue (hue < 0)."""
    red, green, blue = paint
    return red * shade * (1 + 1.6 * hue), green * shade * (1 + 0.3 * hue), blue * shade * (1 - 1.4 * hue)


def _rgba(paint: Paint) -> tuple[int, int, int, int]:
    red, green, blue = (min(255, max(0, round(float(c)))) for c in paint)
    return red, green, blue, 255


Drawing = Callable[[int, int], NDArray[np.float32]]
"""``drawing(seed, texels) -> straight RGBA, 0..1``."""
