"""How a tree grows: a trunk, boughs that lead to lobes, and leaf clusters on the lobes' outsides.

A crown is a set of lobes (rounded masses with gaps between them, through which the sky shows), spread
in an envelope that makes the species. Trees are grown at the origin and are meant to be seen from +z:
what faces away is thinner. Lengths in metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]
Detail = Literal["full", "map"]
Kind = Literal["oak", "alder", "birch", "willow", "pine", "spruce", "shrub"]

FILL = 0.72
"""Share of a cluster's disc that hides what is behind it."""
PEEPING = 0.16
"""A cluster of which less than this shows is left out, but for ``STRAYS`` of them."""
STRAYS = 0.12
BOUGHS = 8
"""Boughs that are drawn: those to the lobes in front."""
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


@dataclass(frozen=True)
class Species:
    """What makes a kind of tree; fractions are of the height."""

    height: float
    spread: float
    """Crown radius at its widest."""
    base: float
    """Where the crown begins."""
    top: float
    """Where the leader ends; the lobes stand round it."""
    widest: float
    """Where the crown is widest, 0 (its base) to 1 (its top)."""
    lobes: int
    lobe: float
    """Radius of a lobe over the crown's radius."""
    flat: float
    """Height of a lobe over its width."""
    cards: int
    """Leaf clusters on one lobe."""
    card: float
    """Side of a leaf cluster's card, metres."""
    cells: tuple[str, ...]
    trunk: float
    """Radius of the trunk at its foot."""
    tall: float = 1.0
    """Height of a card over its width."""
    hanging: bool = False
    """Cards stay upright and hang down."""
    lean: float = 0.06
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    bark: tuple[float, float, float] = (1.0, 1.0, 1.0)


SPECIES: Mapping[Kind, Species] = {
    "oak": Species(9.0, 0.44, 0.24, 0.72, 0.42, 15, 0.43, 0.78, 17, 1.75, ("oak0", "oak1"), 0.034),
    "alder": Species(
        9.5, 0.27, 0.18, 0.86, 0.36, 14, 0.5, 0.85, 14, 1.5, ("alder", "oak1"), 0.02
    ),
    "birch": Species(
        10.0, 0.21, 0.26, 0.92, 0.34, 15, 0.48, 1.05, 11, 1.35, ("birch",), 0.013, lean=0.1
    ),
    "willow": Species(
        7.5, 0.52, 0.4, 0.7, 0.4, 15, 0.4, 0.7, 13, 1.55, ("willow",), 0.045, 1.8, hanging=True
    ),
    "pine": Species(
        11.0, 0.26, 0.52, 0.92, 0.45, 11, 0.5, 0.5, 13, 1.6, ("pine",), 0.021, 0.8, lean=0.1,
        bark=(1.35, 0.95, 0.7),
    ),
    "spruce": Species(
        12.0, 0.19, 0.05, 0.93, 0.04, 1, 1.0, 1.0, 120, 1.75, ("spruce",), 0.016, 0.85, hanging=True, lean=0.02
    ),
    "shrub": Species(1.5, 0.62, 0.05, 0.5, 0.3, 6, 0.5, 0.85, 11, 0.72, ("shrub",), 0.014, lean=0.2),
}


@dataclass(frozen=True, eq=False)
class Crown:
    """A grown tree: its leaf clusters and its wood.

    Per cluster: ``centre`` (n, 3), ``side`` (n,) metres, ``facing`` (n, 3) the card's own normal, ``normal``
    (n, 3) the soft normal that light sees, ``shade`` (n, 3) factor on the colour, ``roll`` (n,) radians,
    ``cell`` (n,) index into the species' cells. ``wood``: paths (k, 3) with radii (k,), trunk first.
    """

    species: Species
    centre: Array
    side: Array
    facing: Array
    normal: Array
    shade: Array
    roll: Array
    cell: NDArray[np.int64]
    wood: tuple[tuple[Array, Array], ...]


def grow(kind: Kind, seed: int, *, height: float | None = None, detail: Detail = "full") -> Crown:
    """Grow one tree; the same seed keeps its shape in both details. ``height`` in metres."""
    species = SPECIES[kind]
    rng = Generator(PCG64([seed, 17]))
    tall = species.height * rng.uniform(0.86, 1.14) if height is None else height
    scale = tall / species.height
    lean = rng.normal(0, species.lean, 2) * tall
    lobes, radii = _cone(species, tall) if kind == "spruce" else _lobes(species, tall, rng)
    bent = lobes + _leaning(lobes[:, 1], tall, lean)
    wood = _wood(species, tall, lean, bent, radii, rng)
    card_rng = Generator(PCG64([seed, 29]))
    share, growth = (1.0, 1.0) if detail == "full" else (0.38, 1.4)
    if kind == "spruce":
        at, out = _whorls(species, tall, round(species.cards * share), card_rng)
        at += _leaning(at[:, 1], tall, lean)
        lobe = np.zeros(len(at), np.int64)
    else:
        at, out, lobe = _clusters(species, bent, radii, share, card_rng)
    return _dress(species, tall, scale * growth, (at, out, lobe), (bent, wood), card_rng)


def _envelope(species: Species, t: Array) -> Array:
    """Relative crown radius at relative crown height ``t``: 1 at ``widest``, closing at both ends."""
    power = np.log(0.5) / np.log(species.widest)
    return np.sin(np.pi * np.clip(t, 0.001, 0.999) ** power) ** 0.75


def _lobes(species: Species, tall: float, rng: Generator) -> tuple[Array, Array]:
    """Centres (m, 3) and radii (m,) of the lobes, spread by best candidates in the envelope."""
    crown = tall * (1 - species.base)
    spread = species.spread * tall
    centres: list[Array] = []
    radii: list[float] = []
    for _ in range(species.lobes):
        best, best_gap = np.zeros(3), -np.inf
        size = species.lobe * spread * rng.uniform(0.75, 1.15)
        for _ in range(24):
            t = rng.uniform(0.1, 0.9)
            turn = rng.uniform(0, 2 * np.pi)
            reach = max(0.0, _envelope(species, np.array([t]))[0] * spread - 0.7 * size)
            reach *= np.sqrt(rng.uniform(0.25, 1.0))
            point = np.array([reach * np.cos(turn), species.base * tall + t * crown, reach * np.sin(turn)])
            point[1] = min(point[1], tall - species.flat * size)
            gap = min((float(np.linalg.norm(point - c) / (size + r)) for c, r in zip(centres, radii, strict=True)), default=9.0)
            if gap > best_gap:
                best, best_gap = point, gap
        centres.append(best)
        radii.append(size * (1.1 - 0.35 * (best[1] / tall - species.base)))
    return np.array(centres), np.array(radii)


def _cone(species: Species, tall: float) -> tuple[Array, Array]:
    return np.array([[0.0, tall * 0.45, 0.0]]), np.array([species.spread * tall])


def _whorls(species: Species, tall: float, count: int, rng: Generator) -> tuple[Array, Array]:
    """Boughs of a spruce: on a cone, denser at the top, drooping outwards."""
    t = 1 - ((np.arange(count) + 0.5) / count) ** 0.62
    tiers = 13
    t = (np.floor(t * tiers) + 0.5 + 0.45 * (t * tiers % 1 - 0.5)) / tiers
    turn = np.arange(count) * GOLDEN_ANGLE + rng.normal(0, 0.25, count)
    reach = species.spread * tall * (1 - t) ** 0.9 * rng.uniform(0.6, 0.98, count)
    out = np.stack([np.cos(turn), np.full(count, 0.25), np.sin(turn)], axis=1)
    low = species.base * tall
    at = np.stack([reach * np.cos(turn), low + t * (tall * 0.97 - low) , reach * np.sin(turn)], axis=1)
    return at, _unit(out)


def _clusters(
    species: Species, lobes: Array, radii: Array, share: float, rng: Generator
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Cluster centres, outward directions and lobe numbers: on the lobes' shells, few within or behind."""
    squash = np.array([1.0, species.flat, 1.0])
    depth = lobes[:, 2] / np.abs(lobes[:, 2]).max()
    at, out, number = [], [], []
    for k, (centre, radius) in enumerate(zip(lobes, radii, strict=True)):
        count = max(3, round(species.cards * share * (0.75 + 0.25 * depth[k])))
        y = np.linspace(0.98, -0.6, count) + rng.normal(0, 0.05, count)
        y = np.clip(y, -0.95, 0.99)
        turn = np.arange(count) * GOLDEN_ANGLE + rng.uniform(0, 2 * np.pi)
        ring = np.sqrt(1 - y * y)
        direction = np.stack([ring * np.cos(turn), y, ring * np.sin(turn)], axis=1)
        direction = _unit(direction + rng.normal(0, 0.15, (count, 3)))
        keep = direction[:, 2] > -0.55
        keep |= rng.uniform(size=count) < 0.35
        shell = rng.uniform(0.6, 0.95, count)[:, None]
        at.append((centre + direction * squash * radius * shell)[keep])
        out.append(direction[keep])
        number.append(np.full(int(keep.sum()), k))
    position, lobe = np.concatenate(at), np.concatenate(number)
    inside = np.linalg.norm((position[:, None] - lobes) / squash, axis=2) / radii
    inside[np.arange(len(lobe)), lobe] = 1.0
    kept = inside.min(axis=1) > 0.5
    return position[kept], np.concatenate(out)[kept], lobe[kept]


def _dress(
    species: Species,
    tall: float,
    scale: float,
    clusters: tuple[Array, Array, NDArray[np.int64]],
    frame: tuple[Array, tuple[tuple[Array, Array], ...]],
    rng: Generator,
) -> Crown:
    """Give each cluster its size, soft normal, occlusion and colour."""
    at, out, lobe = clusters
    lobes, wood = frame
    count = len(at)
    middle = np.array([*lobes.mean(axis=0)])
    middle[1] = tall * (0.6 * species.base + 0.4 * 0.5)
    crown = _unit(at - middle)
    normal = _unit(0.75 * out + 0.5 * crown + [0.0, 0.2, 0.0])
    facing = _unit(0.55 * out + [0.0, 0.0, 0.8] + rng.normal(0, 0.25, (count, 3)))
    if species.hanging:
        facing = _unit(facing * [1.0, 0.25, 1.0])
    reach = np.hypot(at[:, 0] - middle[0], at[:, 2] - middle[2]) / (species.spread * tall)
    above = (at[:, 1] / tall - species.base) / (1 - species.base)
    depth = np.clip(np.maximum(reach, np.abs(above - 0.45) * 1.5), 0, 1)
    occlusion = (0.6 + 0.45 * depth**1.3) * (0.88 + 0.2 * out[:, 1]) * (0.86 + 0.2 * above)
    occlusion *= 1 + 0.04 * rng.normal(size=count)
    whole, per_lobe = np.clip(rng.normal(-0.01, 0.04), -0.07, 0.05), rng.normal(0, 0.03, len(lobes))
    hue = whole + per_lobe[lobe] + rng.normal(0, 0.025, count)
    tint = np.stack([1 + 1.5 * hue, 1 + 0.3 * hue, 1 - 0.9 * hue], axis=1) * np.array(species.tint)
    roll = np.zeros(count) + rng.normal(0, 0.12, count) if species.hanging else rng.uniform(0, 2 * np.pi, count)
    if "pine" in species.cells:
        roll = rng.normal(0, 0.35, count)
    side = species.card * scale * rng.uniform(0.8, 1.2, count)
    if "spruce" in species.cells:
        side *= 0.42 + 0.75 * (1 - at[:, 1] / tall)
    seen = ~_hidden(at, side, species.tall) | (rng.uniform(size=count) < STRAYS)
    return Crown(
        species=species,
        centre=at[seen],
        side=side[seen],
        facing=facing[seen],
        normal=normal[seen],
        shade=(np.clip(occlusion, 0.35, 1.2)[:, None] * tint)[seen],
        roll=roll[seen],
        cell=rng.integers(0, len(species.cells), count)[seen],
        wood=wood,
    )


def _hidden(at: Array, side: Array, tall: float) -> NDArray[np.bool_]:
    """Which clusters lie behind others, seen from +z and from 30 degrees to both sides of it."""
    is_hidden = np.ones(len(at), bool)
    reach = 0.4 * side
    for bearing in np.radians([-30.0, 0.0, 30.0]):
        across = at[:, 0] * np.cos(bearing) - at[:, 2] * np.sin(bearing)
        depth = at[:, 0] * np.sin(bearing) + at[:, 2] * np.cos(bearing)
        gap = np.hypot(across[:, None] - across, (at[:, None, 1] - at[:, 1]) / tall)
        overlap = np.clip((reach[:, None] + reach - gap) / (2 * reach[:, None]), 0, 1)
        in_front = depth[None, :] > depth[:, None] + 0.02
        open_share = np.prod(np.where(in_front, 1 - FILL * overlap, 1.0), axis=1)
        is_hidden &= open_share < PEEPING
    return is_hidden


def _leaning(y: Array, tall: float, lean: Array) -> Array:
    """How far the trunk's line has moved sideways at height ``y``: (n, 3)."""
    share = np.clip(np.asarray(y) / tall, 0, 1) ** 1.5
    return np.stack([lean[0] * share, np.zeros_like(share), lean[1] * share], axis=-1)


def _wood(
    species: Species, tall: float, lean: Array, lobes: Array, radii: Array, rng: Generator
) -> tuple[tuple[Array, Array], ...]:
    """The trunk, then one curved bough to the heart of each lobe: paths and radii."""
    t = np.linspace(0, 1, 6)
    y = t * species.top * tall
    line = np.stack([np.zeros_like(y), y, np.zeros_like(y)], axis=1) + _leaning(y, tall, lean)
    line[1:-1, [0, 2]] += rng.normal(0, 0.006 * tall, (4, 2))
    foot = species.trunk * tall
    girth = foot * (1 - 0.8 * t) * (1 + 0.5 * np.exp(-t * 14))
    wood = [(line, girth)]
    if len(lobes) == 1:
        return tuple(wood)
    order = np.argsort(-lobes[:, 2] - radii)[:BOUGHS]
    for centre, radius in zip(lobes[order], radii[order], strict=True):
        away = np.hypot(centre[0], centre[2])
        start = np.clip(centre[1] - rng.uniform(0.5, 0.9) * away - 0.05 * tall, species.base * tall * 0.7, y[-1] * 0.97)
        root = np.array([np.interp(start, line[:, 1], line[:, axis]) for axis in range(3)])
        handle = root + (centre - root) * [0.55, 0.35, 0.55] + rng.normal(0, 0.02 * tall, 3)
        s = np.linspace(0, 1, 4)[:, None]
        path = (1 - s) ** 2 * root + 2 * s * (1 - s) * handle + s**2 * (centre + [0, 0.3 * radius, 0])
        thick = 0.6 * np.interp(start, line[:, 1], girth)
        wood.append((path, thick * (1 - 0.85 * s[:, 0])))
    return tuple(wood)


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))
