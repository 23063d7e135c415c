"""Paints whole trees, seen from afar, from the same crowns and clusters as the near ones.

One card with such a portrait stands for a far tree, or for a thicket of several.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from renderer.scene.crowns import Crown, grow
from renderer.scene.species import Kind

FILL = 0.95
"""Height of the tallest tree over the cell's side."""
FINENESS = 2
"""Drawn pixels per texel and axis."""
STRETCH = 1.7
"""Width over height of a thicket's card: its cell is drawn narrower by that."""

GAMMA = 1.5
"""Brings a factor on light to one on sRGB paint, with the contrast that many small shadows add."""
TRUNK = np.array([72, 65, 57])
"""Paint of the wood, sRGB 0..255."""

Sprites = Mapping[str, NDArray[np.float32]]


def portrait(kind: Kind, seed: int, texels: int, sprites: Sprites) -> NDArray[np.float32]:
    """One tree in the middle of its cell, its foot on the lower edge; straight RGBA 0..1."""
    crown = grow(kind, seed)
    tall = float(crown.centre[:, 1].max()) + 0.35 * crown.species.card
    return _painted([(crown, 0.0, 1.0)], tall, 1.0, texels, sprites)


def thicket(kinds: Sequence[Kind], seed: int, texels: int, sprites: Sprites) -> NDArray[np.float32]:
    """Trees and undergrowth shoulder to shoulder, lower towards both ends, in a squeezed cell."""
    rng = Generator(PCG64([seed, 41]))
    crowns = [grow(kind, seed + k) for k, kind in enumerate(kinds)]
    tall = max(float(crown.centre[:, 1].max()) + 0.35 * crown.species.card for crown in crowns)
    places = (np.arange(len(kinds)) + 0.5) / len(kinds) - 0.5
    order = rng.permutation(len(kinds))
    trees = []
    for place in order:
        x = places[place] * STRETCH * tall * 0.78 + rng.normal(0, 0.2)
        trees.append((crowns[place], x, 1 - 0.5 * (2 * places[place]) ** 2))
    bushes = [grow("shrub", seed + 50 + k, height=rng.uniform(1.2, 3.4)) for k in range(7)]
    low = [(bush, (k / 6 - 0.5 + 0.1 * (-1) ** k / 3) * STRETCH * tall * 0.78, 1.0) for k, bush in enumerate(bushes)]
    return _painted(trees + low, tall, STRETCH, texels, sprites)


def _painted(
    trees: Sequence[tuple[Crown, float, float]], tall: float, stretch: float, texels: int, sprites: Sprites
) -> NDArray[np.float32]:
    """Paint trees back to front; ``tall`` metres fill the cell, x is squeezed by ``stretch``."""
    side = texels * FINENESS
    scale = FILL * side / tall
    canvas = Image.new("RGBA", (round(side * stretch), side))
    pen = ImageDraw.Draw(canvas)
    sheets = {name: Image.fromarray(np.round(cell * 255).astype(np.uint8)).reduce(2) for name, cell in sprites.items()}
    for crown, x, size in trees:
        unit = scale * size
        middle = np.array([canvas.width / 2 + x * scale, side - 1.0])
        for path, radii in crown.wood:
            points = [tuple(p) for p in (middle + path[:, :2] * [unit, -unit]).tolist()]
            width = max(1, round(float(radii[:-1].mean()) * 1.7 * unit))
            paint = np.clip(TRUNK * np.sqrt(crown.species.bark), 0, 255).astype(int)
            pen.line(points, fill=(*paint.tolist(), 255), width=width)
        for k in np.argsort(crown.centre[:, 2]):
            name = crown.species.cells[crown.cell[k]]
            wide = max(4, round(float(crown.side[k]) * unit))
            sprite = sheets[name].resize((wide, max(4, round(wide * crown.species.tall))), Image.Resampling.BOX)
            sprite = sprite.rotate(np.degrees(crown.roll[k]), Image.Resampling.BILINEAR)
            factor = (crown.shade[k] * (0.74 + 0.26 * crown.normal[k, 1])) ** (1 / GAMMA)
            table = np.minimum(np.append(factor, 1.0)[:, None] * np.arange(256), 255)
            sprite = sprite.point(table.astype(np.uint8).ravel().tolist())
            drop = 0.25 * wide * crown.species.tall if crown.species.hanging else 0.0
            at = middle + crown.centre[k, :2] * [unit, -unit] + [0, drop]
            _stamp(canvas, sprite, at)
    reduced = canvas.resize((texels, texels), Image.Resampling.BOX)
    image = np.array(reduced, np.float32) / np.float32(255)
    # Half-covered texels are thinned out, or the far mipmaps would round every leafy edge.
    image[..., 3] = np.clip((image[..., 3] - 0.4) / 0.5, 0, 1)
    return image


def _stamp(canvas: Image.Image, sprite: Image.Image, at: NDArray[np.float64]) -> None:
    """Lay a sprite over the canvas, centred, cut at its borders."""
    left, top = round(at[0] - sprite.width / 2), round(at[1] - sprite.height / 2)
    crop = (max(0, -left), max(0, -top))
    right = min(sprite.width, canvas.width - left)
    bottom = min(sprite.height, canvas.height - top)
    if right > crop[0] and bottom > crop[1]:
        canvas.alpha_composite(sprite, (max(0, left), max(0, top)), (*crop, right, bottom))
