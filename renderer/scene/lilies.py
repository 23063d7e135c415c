"""Water lilies: notched, slightly curling pads that float, and a few flowers among them.

    lily_pads(seed, places, *, radius=0.14, blooming=0.1, detail="full") -> Mesh
    floating_pads(...), blossoms(...)                                       the two apart

``places`` (n, 3) with y at the water's level; pads lie 1 to 2 cm above it. ``float_pads`` spreads the
places of one group without too much overlap. Wears ``leaves.BLADES``.
"""

from __future__ import annotations

import numpy as np
from numpy.random import PCG64, Generator

from renderer.scene import leaves
from renderer.scene.blades import Array, Blades, ribbons
from renderer.scene.crowns import Detail
from renderer.scene.mesh import Mesh

LIFT = 0.012
"""Mean height of a pad over the water, metres."""


def float_pads(seed: int, centre: tuple[float, float], spread: float, count: int) -> Array:
    """Places (count, 3) of a group of pads, dense in the middle, at water level 0."""
    rng = Generator(PCG64([seed, 31]))
    placed: list[Array] = []
    for _ in range(count):
        reach = spread * np.sqrt(rng.uniform(0, 1, 12)) * rng.uniform(0.3, 1.1, 12)
        turn = rng.uniform(0, 2 * np.pi, 12)
        candidates = np.stack([reach * np.cos(turn), 0.7 * reach * np.sin(turn)], axis=1)
        if placed:
            gap = np.linalg.norm(candidates[:, None] - np.array(placed), axis=2).min(axis=1)
            score = np.minimum(gap, 0.27) - 0.05 * reach / spread
        else:
            score = -reach
        placed.append(candidates[int(np.argmax(score))])
    flat = np.array(placed).reshape(-1, 2) + np.array(centre)
    return np.stack([flat[:, 0], np.zeros(count), flat[:, 1]], axis=1)


def lily_pads(
    seed: int, places: Array, *, radius: float = 0.14, blooming: float = 0.1, detail: Detail = "full"
) -> Mesh:
    """Pads at all places and flowers between some of them."""
    pads = floating_pads(seed, places, radius=radius, detail=detail)
    return Mesh.merge([pads, blossoms(seed, places, radius=radius, blooming=blooming, detail=detail)])


def floating_pads(seed: int, places: Array, *, radius: float = 0.14, detail: Detail = "full") -> Mesh:
    """The pads alone: they lie so low that a reflection need not show them."""
    rng = Generator(PCG64([seed, 32]))
    return _pads(rng, places, _sizes(rng, places, radius), detail)


def blossoms(seed: int, places: Array, *, radius: float = 0.14, blooming: float = 0.1, detail: Detail = "full") -> Mesh:
    """The flowers alone, beside the share ``blooming`` of the pads."""
    size = _sizes(Generator(PCG64([seed, 32])), places, radius)
    rng = Generator(PCG64([seed, 33]))
    chosen = rng.uniform(size=len(places)) < blooming
    aside = np.stack([size * 0.9, np.full(len(places), 0.03), size * 0.5], axis=1)
    return _blossoms(rng, (places + aside)[chosen], detail)


def _sizes(rng: Generator, places: Array, radius: float) -> Array:
    return np.asarray(radius * np.clip(rng.lognormal(0, 0.25, len(places)), 0.55, 1.5))


def _pads(rng: Generator, places: Array, size: Array, detail: Detail) -> Mesh:
    n = len(places)
    spokes = 17 if detail == "full" else 8
    rings = np.array([0.55, 1.0]) if detail == "full" else np.array([1.0])
    notch = rng.uniform(0.16, 0.34, n)[:, None]
    heading = rng.uniform(0, 2 * np.pi, n)[:, None]
    around = np.linspace(0, 1, spokes)
    turn = notch + (2 * np.pi - 2 * notch) * around
    edge = 1 + 0.035 * np.sin(turn * 3 + heading * 5) + 0.02 * np.sin(turn * 7 + heading * 9)
    edge[:, [0, -1]] *= 0.96
    curl = (
        np.maximum(0, np.sin(turn + heading * 3)) ** 4
        * rng.choice([0.0, 0.02, 0.05, 0.12], n, p=[0.4, 0.3, 0.2, 0.1])[:, None]
    )
    tilt = rng.normal(0, 0.02, (n, 2))
    radial = edge[:, None] * rings[:, None]
    x, z = (radial * f(turn + heading)[:, None] for f in (np.cos, np.sin))
    wave = 0.012 * np.sin(turn * 4 + heading * 7)[:, None] * rings[:, None] ** 2
    y = curl[:, None] * rings[:, None] ** 3 + wave + x * tilt[:, :1, None] + z * tilt[:, 1:, None]
    flat = np.stack([x, y, z], axis=-1).reshape(n, len(rings) * spokes, 3)
    hub = np.zeros((n, 1, 3)) - [0.0, 0.012, 0.0]
    local = np.concatenate([hub, flat], axis=1)
    lift = LIFT + 0.0022 * (np.arange(n) % 5)
    position = places[:, None] + local * size[:, None, None] + lift[:, None, None] * [0.0, 1.0, 0.0]
    position[..., 1] = np.maximum(position[..., 1], places[:, None, 1] + 0.004)
    c, s = np.cos(-heading), np.sin(-heading)
    u = local[..., 0] * c - local[..., 2] * s
    v = local[..., 0] * s + local[..., 2] * c
    uv = leaves.at("pad", 0.5 + 0.47 * np.stack([u, v], axis=-1))
    hue = rng.normal(0, 0.07, n)
    bronze = rng.uniform(size=n) < 0.14
    tint = np.stack([1 + 1.4 * hue, 1 + 0.4 * hue, 1 - hue], axis=1) * rng.uniform(0.82, 1.18, (n, 1))
    tint[bronze] *= [1.4, 0.92, 0.85]
    color = np.concatenate([np.repeat(tint[:, None], local.shape[1], axis=1), np.zeros((n, local.shape[1], 1))], axis=2)
    color[:, 0, :3] *= 1.1
    triangles = _pad_triangles(spokes, len(rings))
    index = (np.arange(n) * local.shape[1])[:, None, None] + triangles
    return Mesh.build(position.reshape(-1, 3), index.reshape(-1, 3), uv=uv.reshape(-1, 2), color=color.reshape(-1, 4))


def _pad_triangles(spokes: int, rings: int) -> Array:
    k = np.arange(spokes - 1)
    inner = np.stack([np.zeros_like(k), k + 2, k + 1], axis=1)
    parts = [inner]
    for ring in range(rings - 1):
        a, b = 1 + ring * spokes + k, 1 + (ring + 1) * spokes + k
        parts += [np.stack([a, a + 1, b], axis=1), np.stack([a + 1, b + 1, b], axis=1)]
    return np.concatenate(parts)


def _blossoms(rng: Generator, at: Array, detail: Detail) -> Mesh:
    """White or pink cups of three whorls of petals round yellow stamens."""
    n = len(at)
    pink = rng.uniform(size=n) < 0.35
    whorls = (
        ((8, 0.085, (0.95, 1.25)), (7, 0.075, (0.5, 0.85)), (5, 0.06, (0.15, 0.45)))
        if detail == "full"
        else ((6, 0.08, (0.7, 1.0)),)
    )
    parts = []
    for rank, (count, length, tilt) in enumerate(whorls):
        for paint, chosen in (("petal", ~pink), ("blossom", pink)):
            m = int(chosen.sum())
            k = m * count
            azimuth = np.tile(np.arange(count) + 0.5 * rank, m) * 2 * np.pi / count + rng.normal(0, 0.08, k)
            root = np.repeat(at[chosen], count, axis=0) + np.stack(
                [0.008 * np.cos(azimuth), np.full(k, -0.014), 0.008 * np.sin(azimuth)], axis=1
            )
            lean = np.array([tilt[1] + 0.15, tilt[0] - 0.25]) + rng.normal(0, 0.06, (k, 1))
            shade = (0.92 + 0.05 * rank) * rng.uniform(0.95, 1.03, (k, 1)) * np.ones(3)
            width = np.full(k, 0.034 if detail == "full" else 0.06)
            petals = Blades(root, azimuth, lean, length * rng.uniform(0.9, 1.1, k), width, shade)
            parts.append(ribbons(petals, paint=paint, profile=(0.55, 1.0), gradient=(0.8, 1.08), lift=0.8, sway=0))
    if detail == "full":
        k = n * 7
        azimuth = np.tile(np.arange(7), n) * 2 * np.pi / 7
        stamens = Blades(
            np.repeat(at, 7, axis=0),
            azimuth,
            np.tile([0.5, 0.1], (k, 1)),
            np.full(k, 0.024),
            np.full(k, 0.012),
            np.ones((k, 3)),
        )
        parts.append(ribbons(stamens, paint="yolk", profile=(1.0,), gradient=(0.9, 1.1), lift=1.0, sway=0))
    return Mesh.merge(parts)
