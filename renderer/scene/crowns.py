"""How a tree grows: a trunk, boughs that lead to lobes, and leaf clusters on the lobes' outsides.

A crown is a set of lobes (rounded masses with gaps between them, through which the sky shows), spread
in an envelope that makes the species. Trees are grown at the origin and are meant to be seen from +z:
what is hidden from there is left out. Lengths in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray

from renderer.scene.species import SPECIES, Kind, Species

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
Detail = Literal["full", "map"]
Wood = tuple[tuple[Array, Array], ...]

GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
BOUGHS = 6
"""Boughs that are drawn: those to the lobes in front."""
FILL = 0.8
"""Share of a cluster's disc that hides what is behind it."""
PEEPING = {"full": 0.25, "map": 0.35}
"""A cluster of which less than this shows is left out, but for ``STRAYS`` of them."""
STRAYS = 0.12
SHARE = {"full": (1.0, 1.0), "map": (0.4, 1.4)}
FINE_SHARE = {"full": (1.0, 1.0), "map": (0.6, 1.15)}
"""Share of the clusters that a detail has, and the factor on their size that makes up for it: where the
clusters are leaves in all directions, and where their outlines are read one by one."""
TIERS = 13
"""Whorls of boughs of a spruce."""


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
    cell: Numbers
    wood: Wood


def grow(kind: Kind, seed: int, *, height: float | None = None, detail: Detail = "full") -> Crown:
    """Grow one tree; the same seed keeps its shape in both details. ``height`` in metres."""
    species = SPECIES[kind]
    rng = Generator(PCG64([seed, 17]))
    tall = species.height * rng.uniform(0.86, 1.14) if height is None else height
    lean = rng.normal(0, species.lean, 2) * tall
    card_rng = Generator(PCG64([seed, 29]))
    share, growth = (FINE_SHARE if species.hanging or species.upright else SHARE)[detail]
    if species.lobes:
        upright, radii = _lobes(species, tall, rng)
        lobes = upright + _leaning(upright[:, 1], tall, lean)
        wood = _wood(species, tall, lean, (lobes, radii), rng)
        at, out, lobe = _clusters(species, lobes, radii, share, card_rng)
    else:
        lobes = np.array([[0.0, tall * 0.45, 0.0]])
        wood = _trunk(species, tall, lean, rng)
        at, out = _whorls(species, tall, round(species.cards * share), card_rng)
        at += _leaning(at[:, 1], tall, lean)
        lobe = np.zeros(len(at), np.int64)
    side = species.card * tall / species.height * growth
    hues = np.clip(rng.normal(-0.01, 0.04), -0.07, 0.05) + rng.normal(0, 0.03, len(lobes))
    crown = _dressed(species, tall, side, (at, out, lobe), (lobes, hues), wood, card_rng)
    seen = ~_hidden(crown, PEEPING[detail]) | (card_rng.uniform(size=len(at)) < STRAYS)
    seen &= ~_lonely(crown.centre, crown.side, seen)
    per_cluster = ("centre", "side", "facing", "normal", "shade", "roll", "cell")
    return Crown(species=species, wood=wood, **{name: getattr(crown, name)[seen] for name in per_cluster})


def _envelope(species: Species, t: float) -> float:
    """Relative crown radius at relative crown height ``t``: 1 at ``widest``, closing at both ends."""
    power = np.log(0.5) / np.log(species.widest)
    return float(np.sin(np.pi * np.clip(t, 0.001, 0.999) ** power) ** 0.75)


def _lobes(species: Species, tall: float, rng: Generator) -> tuple[Array, Array]:
    """Centres (m, 3) and radii (m,) of the lobes, spread by best candidates in the envelope."""
    crown, spread = tall * (1 - species.base), species.spread * tall
    centres, radii = np.zeros((0, 3)), np.zeros(0)
    for _ in range(species.lobes):
        size = species.lobe * spread * rng.uniform(0.75, 1.15)
        candidates = []
        for _ in range(24):
            t, turn = rng.uniform(0.1, 0.9), rng.uniform(0, 2 * np.pi)
            reach = max(0.0, _envelope(species, t) * spread - 0.7 * size) * np.sqrt(rng.uniform(0.25, 1.0))
            y = min(species.base * tall + t * crown, tall - species.flat * size)
            candidates.append([reach * np.cos(turn), y, reach * np.sin(turn)])
        points = np.array(candidates)
        gaps = np.linalg.norm(points[:, None] - centres, axis=2) / (size + radii)
        best = points[int(np.argmax(gaps.min(axis=1)))] if len(radii) else points[0]
        centres, radii = np.concatenate([centres, best[None]]), np.append(radii, size)
    return centres, radii * (1.1 - 0.35 * (centres[:, 1] / tall - species.base))


def _whorls(species: Species, tall: float, count: int, rng: Generator) -> tuple[Array, Array]:
    """Places and outward directions of a spruce's boughs: tier over tier on a cone."""
    t = 1 - ((np.arange(count) + 0.5) / count) ** 0.62
    t = (np.floor(t * TIERS) + 0.5 + 0.45 * (t * TIERS % 1 - 0.5)) / TIERS
    turn = np.arange(count) * GOLDEN_ANGLE + rng.normal(0, 0.25, count)
    reach = species.spread * tall * (1 - t) ** 0.9 * rng.uniform(0.6, 0.98, count)
    out = np.stack([np.cos(turn), np.full(count, 0.25), np.sin(turn)], axis=1)
    low = species.base * tall
    at = np.stack([reach * np.cos(turn), low + t * (tall * 0.97 - low), reach * np.sin(turn)], axis=1)
    return at, _unit(out)


def _clusters(
    species: Species, lobes: Array, radii: Array, share: float, rng: Generator
) -> tuple[Array, Array, Numbers]:
    """Cluster centres, outward directions and lobe numbers: on the lobes' shells, few within or behind."""
    squash = np.array([1.0, species.flat, 1.0])
    depth = lobes[:, 2] / np.abs(lobes[:, 2]).max()
    at, out, number = [], [], []
    for k, (centre, radius) in enumerate(zip(lobes, radii, strict=True)):
        count = max(3, round(species.cards * share * (0.75 + 0.25 * depth[k])))
        y = np.clip(np.linspace(0.98, -0.6, count) + rng.normal(0, 0.05, count), -0.95, 0.99)
        turn = np.arange(count) * GOLDEN_ANGLE + rng.uniform(0, 2 * np.pi)
        ring = np.sqrt(1 - y * y)
        direction = np.stack([ring * np.cos(turn), y, ring * np.sin(turn)], axis=1)
        direction = _unit(direction + rng.normal(0, 0.15, (count, 3)))
        keep = (direction[:, 2] > -0.55) | (rng.uniform(size=count) < 0.35)
        shell = rng.uniform(0.6, 0.95, count)[:, None]
        at.append((centre + direction * squash * radius * shell)[keep])
        out.append(direction[keep])
        number.append(np.full(int(keep.sum()), k))
    position, lobe = np.concatenate(at), np.concatenate(number)
    inside = np.linalg.norm((position[:, None] - lobes) / squash, axis=2) / radii
    inside[np.arange(len(lobe)), lobe] = 1.0
    kept = inside.min(axis=1) > 0.5
    return position[kept], np.concatenate(out)[kept], lobe[kept]


def _dressed(  # noqa: PLR0917 - all that a crown is made of
    species: Species,
    tall: float,
    card: float,
    clusters: tuple[Array, Array, Numbers],
    lobes: tuple[Array, Array],
    wood: Wood,
    rng: Generator,
) -> Crown:
    """Give each cluster its size, soft normal, occlusion and colour."""
    at, out, lobe = clusters
    centres, hues = lobes
    count = len(at)
    middle = centres.mean(axis=0)
    middle[1] = tall * (0.6 * species.base + 0.2)
    normal = _unit(0.75 * out + 0.5 * _unit(at - middle) + [0.0, 0.2, 0.0])
    facing = _unit(0.55 * out + [0.0, 0.0, 0.8] + rng.normal(0, 0.25, (count, 3)))
    if species.hanging:
        facing = _unit(facing * [1.0, 0.25, 1.0])
    reach = np.hypot(at[:, 0] - middle[0], at[:, 2] - middle[2]) / (species.spread * tall)
    above = (at[:, 1] / tall - species.base) / (1 - species.base)
    if species.lobes:
        depth = np.clip(np.maximum(reach, np.abs(above - 0.45) * 1.5), 0, 1)
    else:
        depth = np.clip(reach / np.maximum(1 - above, 0.1), 0, 1)
    occlusion = (0.6 + 0.45 * depth**1.3) * (0.88 + 0.2 * out[:, 1]) * (0.86 + 0.2 * above)
    occlusion *= 1 + 0.04 * rng.normal(size=count)
    hue = hues[lobe] + rng.normal(0, 0.025, count)
    tint = np.stack([1 + 1.5 * hue, 1 + 0.3 * hue, 1 - 0.9 * hue], axis=1)
    spread = 0.12 if species.hanging else 0.35 if species.upright else 9.0
    side = card * rng.uniform(0.8, 1.2, count)
    if species.hanging and species.lobes:
        side *= 1.2 - 0.35 * out[:, 1]
    if not species.lobes:
        side *= 0.42 + 0.75 * (1 - at[:, 1] / tall)
    return Crown(
        species=species,
        centre=at,
        side=side,
        facing=facing,
        normal=normal,
        shade=np.clip(1.05 * occlusion, 0.45, 1.2)[:, None] * tint,
        roll=rng.normal(0, spread, count),
        cell=rng.integers(0, len(species.cells), count),
        wood=wood,
    )


def _hidden(crown: Crown, peeping: float) -> NDArray[np.bool_]:
    """Which clusters lie behind others, seen from +z and from 30 degrees to both sides of it."""
    at, reach = crown.centre, (0.3 if crown.species.hanging else 0.4) * crown.side
    is_hidden = np.ones(len(at), bool)
    for bearing in np.radians([-30.0, 0.0, 30.0]):
        across = at[:, 0] * np.cos(bearing) - at[:, 2] * np.sin(bearing)
        depth = at[:, 0] * np.sin(bearing) + at[:, 2] * np.cos(bearing)
        gap = np.hypot(across[:, None] - across, (at[:, None, 1] - at[:, 1]) / crown.species.tall)
        overlap = np.clip((reach[:, None] + reach - gap) / (2 * reach[:, None]), 0, 1)
        in_front = depth > depth[:, None] + 0.02
        is_hidden &= np.prod(np.where(in_front, 1 - FILL * overlap, 1.0), axis=1) < peeping
    return is_hidden


def _lonely(at: Array, side: Array, seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which clusters hang in the air: no other that is seen comes near."""
    gap = np.linalg.norm(at[:, None] - at, axis=2)
    gap[:, ~seen] = np.inf
    np.fill_diagonal(gap, np.inf)
    return np.asarray(gap.min(axis=1) > 0.62 * side)


def _leaning(y: Array, tall: float, lean: Array) -> Array:
    """How far the trunk's line has moved sideways at height ``y``: (n, 3)."""
    share = np.clip(y / tall, 0, 1) ** 1.5
    return np.stack([lean[0] * share, np.zeros_like(share), lean[1] * share], axis=-1)


def _trunk(species: Species, tall: float, lean: Array, rng: Generator) -> Wood:
    """The trunk's path (6, 3) and radii: thick at the foot, slightly crooked."""
    t = np.linspace(0, 1, 6)
    y = t * species.top * tall
    line = np.stack([np.zeros_like(y), y, np.zeros_like(y)], axis=1) + _leaning(y, tall, lean)
    line[1:-1, [0, 2]] += rng.normal(0, 0.006 * tall, (4, 2))
    girth = species.trunk * tall * (1 - 0.8 * t) * (1 + 0.5 * np.exp(-t * 14))
    return ((line, girth),)


def _wood(species: Species, tall: float, lean: Array, lobes: tuple[Array, Array], rng: Generator) -> Wood:
    """The trunk, then one curved bough to the heart of each lobe in front."""
    ((line, girth),) = _trunk(species, tall, lean, rng)
    wood = [(line, girth)]
    centres, radii = lobes
    for k in np.argsort(-centres[:, 2] - radii)[:BOUGHS]:
        centre = centres[k]
        away = np.hypot(centre[0], centre[2])
        low = centre[1] - rng.uniform(0.5, 0.9) * away - 0.05 * tall
        start = np.clip(low, species.base * tall * 0.7, line[-1, 1] * 0.97)
        root = np.array([np.interp(start, line[:, 1], line[:, axis]) for axis in range(3)])
        handle = root + (centre - root) * [0.55, 0.35, 0.55] + rng.normal(0, 0.02 * tall, 3)
        s = np.linspace(0, 1, 4)[:, None]
        end = np.array([centre[0], centre[1] + 0.3 * radii[k], centre[2]])
        path = (1 - s) ** 2 * root + 2 * s * (1 - s) * handle + s**2 * end
        wood.append((path, 0.6 * np.interp(start, line[:, 1], girth) * (1 - 0.85 * s[:, 0])))
    return tuple(wood)


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))
