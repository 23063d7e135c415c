"""The lake's forest, and all that grows there.

Trees near the default camera are grown, those farther off are portraits on crossed cards, and high on the
slopes one card shows a group. Everything is sorted from the camera's point at the origin outwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderer.scene import impostors, leaves, scatter, trees
from renderer.scene.blades import Array
from renderer.scene.lake_banks import banks, plant_object
from renderer.scene.lake_shore import MIDDLE, RING
from renderer.scene.material import Material
from renderer.scene.noise import point_fbm, scattered
from renderer.scene.portraits import STRETCH, portrait, thicket
from renderer.scene.scatter import Field
from renderer.scene.scene import SceneObject
from renderer.scene.species import Kind

TEXELS = 256
"""Side of a portrait."""
WOODS = Material(
    "lake woods",
    "foliage",
    albedo_map="lake_woods",
    alpha_cutoff=0.5,
    is_two_sided=True,
    translucency=0.3,
    albedo=(0.88, 0.88, 0.76),
)

SINGLE: Sequence[tuple[str, Kind, int, float]] = (
    ("spruce0", "spruce", 81, 0.19), ("spruce1", "spruce", 82, 0.19), ("spruce2", "spruce", 83, 0.16),
    ("spruce3", "spruce", 84, 0.12), ("pine0", "pine", 85, 0.09), ("pine1", "pine", 86, 0.07),
    ("birch0", "birch", 87, 0.045), ("birch1", "birch", 88, 0.03), ("alder0", "alder", 89, 0.05),
    ("oak0", "oak", 90, 0.02),
)  # fmt: skip
"""Name, kind, seed and share of the single trees; the broadleaved ones keep to the low ground."""
BROADLEAVED = 6
"""Where they begin."""
GROUPS: Sequence[tuple[str, tuple[Kind, ...], int]] = (
    ("group0", ("spruce", "spruce", "pine", "spruce", "spruce"), 91),
    ("group1", ("spruce", "pine", "spruce", "spruce", "pine"), 92),
    ("group2", ("pine", "spruce", "spruce", "spruce", "alder"), 93),
    ("group3", ("spruce", "spruce", "spruce", "birch", "spruce"), 94),
)

HEROES: Sequence[tuple[Kind, float, float, float]] = (
    ("spruce", 15.6, -15.6, 12.5), ("birch", 17.0, -19.2, 9.5), ("pine", 20.5, -15.5, 12.0),
    ("alder", 22.6, -18.2, 7.5), ("spruce", 19.5, -10.5, 14.5), ("spruce", 26.0, -13.5, 15.0),
    ("birch", 28.5, -16.5, 10.5), ("spruce", 45.5, -13.0, 15.0), ("spruce", 49.5, -20.0, 12.5),
    ("pine", 50.0, -28.0, 13.5), ("birch", 50.0, -40.5, 10.5), ("spruce", 52.0, -36.0, 14.5),
    ("spruce", 56.0, -46.0, 15.5), ("birch", -14.5, 13.5, 10.0), ("spruce", -18.5, 19.0, 13.0),
    ("pine", 9.5, 17.5, 12.0), ("spruce", 19.5, 12.5, 13.0), ("alder", -31.0, 5.5, 8.0), ("birch", -38.5, -3.0, 10.0),
    ("spruce", -46.0, -8.0, 14.0), ("spruce", 26.0, 9.0, 12.0), ("birch", 31.0, 4.0, 10.0),
    ("spruce", -24.5, 12.5, 12.5), ("spruce", 1.5, 24.5, 13.5),
)  # fmt: skip
"""(kind, x, z, height) of the grown trees."""
OPEN = ((0.0, 3.0, 13.0), (-20.0, 10.0, 12.0), (-6.0, 12.0, 9.0), (8.0, 2.0, 8.0))
"""Meadows without trees: (x, z, radius) metres."""
ISLET = (
    ("spruce0", -33.0, -143.0, 13.5), ("spruce1", -36.5, -145.0, 11.5), ("spruce2", -30.0, -144.5, 9.5),
    ("pine0", -39.5, -143.5, 12.5), ("birch0", -27.5, -142.0, 8.0), ("spruce3", -34.5, -147.5, 12.0),
    ("pine1", -42.0, -146.5, 10.0), ("spruce0", -28.5, -147.0, 11.0), ("alder0", -44.0, -143.0, 6.0),
    ("spruce2", -38.0, -149.0, 9.0), ("spruce1", -31.5, -149.5, 10.0), ("alder0", -24.0, -144.5, 5.5),
    ("birch1", -36.0, -140.0, 7.5), ("spruce3", -25.5, -146.5, 5.0), ("spruce3", -40.8, -140.6, 4.5),
)  # fmt: skip
"""(portrait, x, z, height) of the island's trees."""
SINGLE_CELL, GROUP_CELL = 4.6, 15.0
"""Sides of the squares in each of which one tree, or one group, may stand, metres."""
EYES = (
    (0.0, 5.0, 5.0),
    (0.0, 5.0, -160.0),
    (75.0, 5.0, -200.0),
    (-75.0, 5.0, -200.0),
    (0.0, 5.0, -300.0),
    (0.0, 60.0, 60.0),
)
"""From where the woods are looked at, metres."""
GROWN_END = 34.0
"""Metres from the origin within which all trees are grown: a portrait does not bear so close a look."""
SINGLES_END = 52.0
"""Metres from the water at which groups take over."""


@dataclass(frozen=True, eq=False)
class Stand:
    """Where trees stand and what they are; all (n, …), nearest to the origin first."""

    places: Array
    names: NDArray[np.str_]
    heights: Array
    facing: Array

    def part(self, chosen: NDArray[np.integer]) -> Stand:
        """Some of them."""
        return Stand(self.places[chosen], self.names[chosen], self.heights[chosen], self.facing[chosen])


@lru_cache(maxsize=1)
def album() -> impostors.Album:
    """The portraits of the forest's trees."""
    clusters = leaves.clusters()
    painted = {name: portrait(kind, seed, TEXELS, clusters) for name, kind, seed, _ in SINGLE}
    painted |= {name: thicket(kinds, seed, TEXELS, clusters) for name, kinds, seed in GROUPS}
    return impostors.bound("lake_woods", painted, {name: STRETCH for name, *_ in GROUPS}, 4)


def cover(seed: int, x: Array, z: Array, distance: Array, height: Array) -> Array:
    """How closely trees stand, 0 to 1, at points of any one shape."""
    points = np.stack([np.ravel(x), np.ravel(z)], axis=1).astype(np.float64)
    edge = point_fbm(points, 26.0, seed + 31, octaves=3).reshape(np.shape(x))
    glade = point_fbm(points, 74.0, seed + 32, octaves=2).reshape(np.shape(x))
    share = np.clip((distance - 1.4 - 2.8 * edge) / 2.4, 0, 1)
    share *= 1 - np.clip((glade - 0.90) * 5, 0, 1) * np.clip((distance - 4) / 8, 0, 1)
    for centre_x, centre_z, radius in OPEN:
        away = np.hypot(x - centre_x, z - centre_z) + 2.5 * edge
        share *= np.clip((away - radius) / 4 + 0.5, 0, 1)
    off = np.hypot(x - RING[0], z - RING[1])
    share *= (off < RING[2]) | (off > RING[3])
    return np.asarray(share * (height > 0.25))


def planting(seed: int, height: Field, distance: Field, meadow: Field) -> list[SceneObject]:
    """Everything that grows, from the water's edge outwards."""
    return [*banks(seed, height, meadow), *_grown(seed, height), *_forest(seed, height, distance)]


def stands(seed: int, height: Field, distance: Field) -> tuple[Stand, Stand]:
    """The single trees and the groups on the slopes."""
    single = _jittered(seed + 1, height, distance, cell=SINGLE_CELL, band=(1.6, SINGLES_END), reach=520.0)
    group = _jittered(seed + 2, height, distance, cell=GROUP_CELL, band=(SINGLES_END - 10, 1e3), reach=590.0)
    heroes = np.array([[x, z] for _, x, z, _ in HEROES])
    gap = np.linalg.norm(single[:, None, [0, 2]] - heroes, axis=2).min(axis=1)
    wild = _dressed(
        seed + 3, single[(gap > 3.4) & (np.hypot(single[:, 0], single[:, 2]) > GROWN_END)], distance, is_group=False
    )
    group = group[_seen(height, group)]
    return _joined(_islet(height), wild), _dressed(seed + 4, group, distance, is_group=True)


def _seen(height: Field, places: Array) -> NDArray[np.bool_]:
    """Which of the groups (n, 3) some eye over the lake sees past the ground: the others would be drawn in vain."""
    tops = places + np.array([0.0, 15.0, 0.0])
    seen = np.zeros(len(places), bool)
    for eye in EYES:
        along = np.linspace(0.25, 0.96, 24)[:, None]
        ray_x, ray_y, ray_z = ((eye[k] + along * (tops[:, k] - eye[k])) for k in range(3))
        seen |= (ray_y > np.asarray(height(ray_x, ray_z))).all(axis=0)
    return seen


def _islet(height: Field) -> Stand:
    """The island's trees, which look at the default camera."""
    spots = np.array([[x, z] for _, x, z, _ in ISLET])
    places = np.stack([spots[:, 0], height(spots[:, 0], spots[:, 1]) - 0.2, spots[:, 1]], axis=1)
    facing = -places * [1.0, 0.0, 1.0]
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    return Stand(places, np.array([name for name, *_ in ISLET]), np.array([tall for *_, tall in ISLET]), facing)


def _joined(one: Stand, other: Stand) -> Stand:
    """Two stands in one, nearest to the origin first."""
    every = Stand(
        np.concatenate([one.places, other.places]),
        np.concatenate([one.names, other.names]),
        np.concatenate([one.heights, other.heights]),
        np.concatenate([one.facing, other.facing]),
    )
    return every.part(np.argsort(np.hypot(every.places[:, 0], every.places[:, 2]), kind="stable"))


def _jittered(
    seed: int, height: Field, distance: Field, *, cell: float, band: tuple[float, float], reach: float
) -> Array:
    """Ground points (n, 3), one at most in each square, ``band`` metres from the water, by the forest's cover."""
    count = int(2 * reach / cell)
    chance = scattered(seed, count * count, 3)
    row, column = np.divmod(np.arange(count * count), count)
    x = (column + 0.04 + 0.92 * chance[:, 0]) * cell - reach
    z = (row + 0.04 + 0.92 * chance[:, 1]) * cell - reach + 0.4 * MIDDLE[1]
    off = np.asarray(distance(x, z), np.float64)
    is_near = (off > band[0]) & (off < band[1])
    x, z, off, pick = x[is_near], z[is_near], off[is_near], chance[is_near, 2]
    y = np.asarray(height(x, z), np.float64)
    kept = cover(seed, x, z, off, y) > pick
    places = np.stack([x, y, z], axis=1)[kept]
    return np.asarray(places[np.argsort(np.hypot(places[:, 0], places[:, 2]), kind="stable")])


def _dressed(seed: int, places: Array, distance: Field, *, is_group: bool) -> Stand:
    """Choose kinds and heights; broadleaved trees stand low, and the wood's edge is lower than its heart."""
    count = len(places)
    chance = scattered(seed, count, 4)
    flat = places[:, [0, 2]]
    off = np.asarray(distance(flat[:, 0], flat[:, 1]), np.float64)
    patch = point_fbm(flat, 31.0, seed + 5, octaves=2)
    if is_group:
        names = np.array([name for name, *_ in GROUPS])[(chance[:, 0] * len(GROUPS)).astype(np.int64)]
        heights = 13.5 * (0.8 + 0.45 * chance[:, 1]) * (1 + 0.18 * patch)
        sink = 1.2
    else:
        share = np.array([part for *_, part in SINGLE])
        low = np.clip(1.6 - off / 14 + 1.6 * patch, 0.1, 3.0)[:, None]
        weight = np.cumsum(np.where(np.arange(len(SINGLE)) < BROADLEAVED, share, share * low), axis=1)
        number = (weight / weight[:, -1:] < chance[:, :1]).sum(axis=1)
        names = np.array([name for name, *_ in SINGLE])[np.minimum(number, len(SINGLE) - 1)]
        heights = (8.0 + 3.5 * np.clip(off / 20, 0, 1)) * (0.62 + 0.85 * chance[:, 1] ** 1.4) * (1 + 0.18 * patch)
        heights *= np.where(number < BROADLEAVED, 1.12, 0.82)
        heights = np.where(chance[:, 2] < 0.13, 0.45 * heights, heights)
        sink = 0.25
    # The front looks at the lake's long middle.
    towards = np.stack([-flat[:, 0], 0 * off, np.clip(flat[:, 1], -270.0, -50.0) - flat[:, 1]], axis=1)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True) + 1e-9
    return Stand(places - [0.0, sink, 0.0], names, heights, towards)


def _forest(seed: int, height: Field, distance: Field) -> Iterator[SceneObject]:
    tags = frozenset({"plant", "tree"})
    for kind, stand in zip(("trees", "woods"), stands(seed, height, distance), strict=True):
        for number, chosen in enumerate(_blocks(stand.places)):
            part = stand.part(chosen)
            trees_here = (part.places, part.names.tolist(), part.heights, part.facing)
            plain = impostors.cards(seed + number, album(), *trees_here, are_boxes=kind == "woods")
            full = plain if kind == "woods" else impostors.cards(seed + number, album(), *trees_here, crossed=True)
            yield SceneObject(
                f"{kind} {number}", full, WOODS, tags, casts_shadow=False, map_mesh=plain, detail_distance=230.0
            )


def _blocks(places: Array) -> list[NDArray[np.int64]]:
    """Indices of the places in blocks by distance from the origin and by bearing, so that few are drawn in vain."""
    away = np.hypot(places[:, 0], places[:, 2])
    ring = np.searchsorted([60.0, 140.0, 260.0, 400.0], away)
    sector = (np.arctan2(places[:, 2], places[:, 0]) / (2 * np.pi) % 1.0 * 16).astype(np.int64)
    number = ring * 16 + sector
    return [np.flatnonzero(number == block) for block in np.unique(number)]


def _grown(seed: int, height: Field) -> Iterator[SceneObject]:
    spots = np.array([[x, z] for _, x, z, _ in HEROES])
    places = np.stack([spots[:, 0], height(spots[:, 0], spots[:, 1]), spots[:, 1]], axis=1)
    kinds, heights = [kind for kind, *_ in HEROES], np.array([tall for *_, tall in HEROES])
    for k, part in enumerate(scatter.sectors(places, 10)):
        wood = trees.forest(seed + k, places[part], [kinds[i] for i in part], heights[part])
        yield plant_object(f"grown {k}", (wood.leaves, wood.leaves_far), leaves.LEAVES, "tree", seen=60.0)
        yield plant_object(f"trunks {k}", (wood.trunk, wood.trunk_far), leaves.BARK, "tree", seen=60.0)
