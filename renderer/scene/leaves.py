"""The foliage atlas, the bark, and the materials that wear them.

    atlas() -> Texture      name "foliage": 1280 by 1024, sRGB, coverage in alpha, mipmaps keep coverage
    bark() -> Texture       name "bark": left half furrowed, right half birch; repeats upwards
    LEAVES, BLADES, BARK    materials: alpha-tested cards, solid blades and pads, wood

``CELLS`` names the atlas's cells; ``at(cell, st)`` turns cell coordinates (0..1, t up) into uv, and
``hull(cell)`` is the tight octagon round what is drawn there, so that cards shade few empty pixels.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, lru_cache
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from renderer.scene import leaf_drawing as draw
from renderer.scene import plant_drawing as plant
from renderer.scene.material import Material, Texture
from renderer.scene.portraits import portrait, thicket

TEXELS = 256
"""Side of a cell."""
COLUMNS, ROWS = 5, 4
"""Cells of the atlas."""
CUTOFF = 0.5
SPARED = 0.004

LEAVES = Material("leaves", "foliage", albedo_map="foliage", alpha_cutoff=CUTOFF, is_two_sided=True, translucency=0.5)
BLADES = Material("blades", "foliage", albedo_map="foliage", is_two_sided=True, translucency=0.4)
BARK = Material("bark", "surface", albedo_map="bark")

Texels = NDArray[np.float32]
Drawing = Callable[[], Texels]
Portrait = Callable[[Mapping[str, Texels]], Texels]

DRAWINGS: Mapping[str, Drawing] = MappingProxyType(
    {
        "oak0": lambda: draw.cluster(1, TEXELS, draw.OAK),
        "oak1": lambda: draw.cluster(2, TEXELS, draw.OAK),
        "alder": lambda: draw.cluster(3, TEXELS, draw.ALDER),
        "birch": lambda: draw.cluster(4, TEXELS, draw.BIRCH),
        "shrub": lambda: draw.cluster(5, TEXELS, draw.SHRUB),
        "willow": lambda: draw.willow(6, TEXELS),
        "pine": lambda: draw.pine(7, TEXELS),
        "spruce": lambda: draw.spruce(8, TEXELS),
        "pad": lambda: plant.pad(9, TEXELS),
        "strips": lambda: plant.strips(10, TEXELS),
    }
)
PORTRAITS: Mapping[str, Portrait] = MappingProxyType(
    {
        "far_oak": lambda cells: portrait("oak", 31, TEXELS, cells),
        "far_alder": lambda cells: portrait("alder", 35, TEXELS, cells),
        "far_birch": lambda cells: portrait("birch", 36, TEXELS, cells),
        "far_willow": lambda cells: portrait("willow", 37, TEXELS, cells),
        "far_spruce": lambda cells: portrait("spruce", 32, TEXELS, cells),
        "far_pine": lambda cells: portrait("pine", 33, TEXELS, cells),
        "thicket0": lambda cells: thicket(("alder", "oak", "birch", "oak", "alder"), 34, TEXELS, cells),
        "thicket1": lambda cells: thicket(("birch", "alder", "spruce", "oak", "birch"), 44, TEXELS, cells),
    }
)
"""Whole trees, painted from the cells above."""
CELLS: Mapping[str, int] = MappingProxyType({name: number for number, name in enumerate([*DRAWINGS, *PORTRAITS])})


def at(cell: str, st: NDArray[np.floating]) -> NDArray[np.float64]:
    """Texture coordinates (…, 2) of points of a cell, ``st`` (…, 2) in 0..1 with t up."""
    row, column = divmod(CELLS[cell], COLUMNS)
    inset = np.clip(np.asarray(st, np.float64), 0.5 / TEXELS, 1 - 0.5 / TEXELS)
    return np.stack([(column + inset[..., 0]) / COLUMNS, (row + 1 - inset[..., 1]) / ROWS], axis=-1)


@lru_cache(maxsize=1)
def atlas() -> Texture:
    """The foliage atlas; its transparent texels carry the colour of the nearest leaf."""
    image = np.zeros((ROWS * TEXELS, COLUMNS * TEXELS, 4), np.uint8)
    for name, texels in _painted().items():
        row, column = divmod(CELLS[name], COLUMNS)
        window = np.s_[row * TEXELS : (row + 1) * TEXELS, column * TEXELS : (column + 1) * TEXELS]
        image[window] = np.round(np.clip(texels, 0, 1) * 255)
    image.flags.writeable = False
    return Texture("foliage", image, is_srgb=True, wrap="clamp", mipmaps="coverage", blends_mipmaps=False)


@lru_cache(maxsize=1)
def bark() -> Texture:
    """Bark for all trunks, grey enough to be tinted by the vertex colours."""
    return Texture("bark", plant.bark(11), is_srgb=True, blends_mipmaps=False)


@cache
def hull(cell: str) -> NDArray[np.float64]:
    """The octagon round a cell's drawing: (8, 2) cell coordinates, counter-clockwise."""
    return octagon(_painted()[cell])


def octagon(image: Texels) -> NDArray[np.float64]:
    """The octagon round what is drawn on a square image with coverage: (8, 2) in 0..1, counter-clockwise, t up.

    A few outermost tips are cut off (``SPARED`` of the texels a side): the corners they would open are
    empty, and empty pixels cost as much as leaves.
    """
    size = len(image)
    rows, columns = np.nonzero(image[..., 3] > 0.25)
    s, t = (columns + 0.5) / size, 1 - (rows + 0.5) / size
    turns = np.arange(8) * np.pi / 4
    axes = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    reach = np.quantile(np.stack([s, t], axis=1) @ axes.T, 1 - SPARED, axis=0) + 1.0 / size
    # A side beyond the corner of its neighbours would fold the outline: it is moved to that corner.
    reach = np.minimum(reach, (np.roll(reach, 1) + np.roll(reach, -1)) / np.sqrt(2))
    corners = [np.linalg.solve(axes[[k, (k + 1) % 8]], reach[[k, (k + 1) % 8]]) for k in range(8)]
    return np.asarray(np.clip(np.array(corners), 0, 1))


@lru_cache(maxsize=1)
def _painted() -> Mapping[str, NDArray[np.float32]]:
    cells = {name: drawing() for name, drawing in DRAWINGS.items()}
    far = {name: paint(cells) for name, paint in PORTRAITS.items()}
    return {name: bled(texels) for name, texels in {**cells, **far}.items()}


def clusters() -> Mapping[str, Texels]:
    """The drawn cells, of which portraits are painted."""
    return {name: _painted()[name] for name in DRAWINGS}


def bled(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Spread the colour of the covered texels over the empty ones; alpha stays.

    ``image`` (n, n, 4) with n a power of two, straight colour. Averages over ever larger blocks fill
    what the finer ones leave open, so that no mipmap mixes a leaf with black.
    """
    alpha = image[..., 3:]
    levels = [np.concatenate([image[..., :3] * alpha, alpha], axis=2)]
    while len(levels[-1]) > 1:
        side = len(levels[-1]) // 2
        levels.append(levels[-1].reshape(side, 2, side, 2, 4).mean(axis=(1, 3)))
    filled = levels[-1][..., :3] / np.maximum(levels[-1][..., 3:], 1e-6)
    for level in reversed(levels[:-1]):
        weight = level[..., 3:]
        coarse = filled.repeat(2, axis=0).repeat(2, axis=1)
        share = np.minimum(weight * 4, 1)
        filled = coarse + share * (level[..., :3] / np.maximum(weight, 1e-6) - coarse)
    return np.concatenate([filled, alpha], axis=2).astype(np.float32)
