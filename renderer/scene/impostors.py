"""Far trees as painted cards: one for a tree that is seen from one side, two that cross for one seen from any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray

from renderer.scene import leaves
from renderer.scene.material import Texture
from renderer.scene.mesh import Mesh
from renderer.scene.trees import FAN, FOOT, joined_cards

Array = NDArray[np.float64]

FOOT_SHADE, TOP_SHADE = 0.62, 1.10
"""Factors on the colour at a tree's foot, where its neighbours take the light, and at its top."""


@dataclass(frozen=True, eq=False)
class Album:
    """Portraits in one texture: square cells in rows."""

    texture: Texture
    columns: int
    cells: Mapping[str, int]
    hulls: Mapping[str, Array]
    """The octagon round each portrait, (8, 2) cell coordinates, t up."""
    wide: Mapping[str, float]
    """Width of each card over its height."""

    def outline(self, name: str, *, is_box: bool) -> Array:
        """The octagon (8, 2) round a portrait, or the box (4, 2) round that."""
        hull = self.hulls[name]
        if not is_box:
            return hull
        (low_s, low_t), (high_s, high_t) = hull.min(axis=0), hull.max(axis=0)
        return np.array([[low_s, low_t], [high_s, low_t], [high_s, high_t], [low_s, high_t]])

    def at(self, name: str, outline: Array) -> Array:
        """Texture coordinates (k, 2) of cell coordinates."""
        rows = self.texture.image.shape[0] * self.columns // self.texture.image.shape[1]
        row, column = divmod(self.cells[name], self.columns)
        inset = 0.5 * self.columns / self.texture.image.shape[1]
        s, t = np.clip(outline, inset, 1 - inset).T
        return np.stack([(column + s) / self.columns, (row + 1 - t) / rows], axis=-1)


def bound(name: str, portraits: Mapping[str, NDArray[np.float32]], wide: Mapping[str, float], columns: int) -> Album:
    """Bind portraits (n, n, 4), straight colour 0..1, into an album; ``wide`` names those that are not square."""
    texels = len(next(iter(portraits.values())))
    rows = -(-len(portraits) // columns)
    image = np.zeros((rows * texels, columns * texels, 4), np.uint8)
    for number, portrait in enumerate(portraits.values()):
        row, column = divmod(number, columns)
        window = np.s_[row * texels : (row + 1) * texels, column * texels : (column + 1) * texels]
        image[window] = np.round(np.clip(leaves.bled(portrait), 0, 1) * 255)
    return Album(
        Texture(name, image, is_srgb=True, wrap="clamp", mipmaps="coverage", blends_mipmaps=False),
        columns,
        {part: number for number, part in enumerate(portraits)},
        {part: leaves.octagon(portrait) for part, portrait in portraits.items()},
        {part: wide.get(part, 1.0) for part in portraits},
    )


def cards(  # noqa: PLR0917 - a tree is a place, a name, a height and a front
    seed: int,
    album: Album,
    places: Array,
    names: Sequence[str],
    heights: Array,
    facing: Array,
    *,
    crossed: bool = False,
    are_boxes: bool = False,
) -> Mesh:
    """Trees on ground points ``places`` (n, 3), ``heights`` (n,) metres, in the order given.

    ``facing`` (n, 3), unit and level, is where each is seen from most; light falls on a card as on a
    crown's front. With ``crossed`` a second card stands across the first; ``are_boxes`` spares
    triangles where portraits fill their cells.
    """
    rng = Generator(PCG64([seed, 71]))
    count = len(places)
    mirrored = rng.choice([-1.0, 1.0], count)
    turn = rng.normal(0, 0.35, count) if crossed else np.zeros(count)
    outlines = {name: album.outline(name, is_box=are_boxes) for name in album.cells}
    hulls = np.stack([outlines[name] for name in names])
    uv = np.stack([album.at(name, outlines[name]) for name in names])
    corners = hulls.shape[1]
    fan = FAN[: corners - 2]
    tall = heights / (hulls[..., 1].max(axis=1) - FOOT)
    local = (hulls - [0.5, FOOT]) * tall[:, None, None]
    wide = np.array([album.wide[name] for name in names]) * mirrored
    hue, shade = rng.normal(0, 0.045, count), rng.uniform(0.84, 1.14, count)
    tint = np.stack([1 + 1.5 * hue, 1 + 0.3 * hue, 1 - hue], axis=1) * shade[:, None]
    c, s = np.cos(turn), np.sin(turn)
    front = np.stack([c * facing[:, 0] + s * facing[:, 2], 0 * c, c * facing[:, 2] - s * facing[:, 0]], axis=1)
    right = np.stack([front[:, 2], 0 * c, -front[:, 0]], axis=1)
    gradient = FOOT_SHADE + (TOP_SHADE - FOOT_SHADE) * np.clip(local[..., 1:] / heights[:, None, None], 0, 1) ** 0.7
    color = np.concatenate([tint[:, None] * gradient, np.zeros((count, corners, 1))], axis=2)
    triangles = np.where(mirrored[:, None, None] > 0, fan, fan[:, ::-1])
    parts = []
    for across in (right, front) if crossed else (right,):
        side = (across * wide[:, None])[:, None]
        position = places[:, None] + local[..., :1] * side + local[..., 1:] * [0.0, 1.0, 0.0]
        outward = (position - places[:, None]) / tall[:, None, None] - [0, 0.45, 0]
        normal = facing[:, None] * 0.8 + 1.3 * outward + [0.0, 0.25, 0.0]
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        parts.append((position, normal))
    position, normal = (np.stack(part, axis=1).reshape(-1, corners, 3) for part in zip(*parts, strict=True))
    repeats = len(parts)
    return joined_cards(
        position,
        normal,
        np.repeat(uv, repeats, axis=0),
        np.repeat(color, repeats, axis=0),
        np.repeat(triangles, repeats, axis=0),
    )
