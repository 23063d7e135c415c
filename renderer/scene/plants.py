"""Plants of the bank and of the shallow water, as solid geometry (no alpha: blades are triangles).

Every builder is pure and seeded: ``builder(seed, places, ...) -> Mesh`` with ``places`` (n, 3) ground
points in metres, one plant (or tuft) each. ``detail="map"`` gives the cheaper level of detail with
the same silhouettes, for ``SceneObject.map_mesh``. All of them wear ``leaves.BLADES``; they read the
texture ``foliage`` (``leaves.atlas()``).

    reeds(seed, places, *, height=1.56, detail="full")     common reed with plumes, in shallow water
    cattails(seed, places, *, height=1.45, detail="full")  straps and brown spikes
    sedge(seed, places, *, height=0.55, detail="full")     arching tussocks of the waterline
    grass(seed, places, *, height=0.28, detail="full")     tufts of the bank
    irises(seed, places, *, detail="full")                 yellow flags at the waterline
    flowers(seed, places, *, hue="white", detail="full")   daisies, buttercups, clover ("white", "yellow", "violet")

Lily pads are in ``lilies``, shrubs and trees (leaf cards) in ``trees``, places in ``scatter``, and a
whole planting for a given ground, ready for ``Scene.objects``, in ``planting``:

    objects = planting.planting(seed, height)      # height(x, z) -> y, arrays of one shape
    textures = {t.name: t for t in (leaves.atlas(), leaves.bark())}
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.random import PCG64, Generator

from renderer.scene.blades import Array, Blades, ribbons, spindles, swaying
from renderer.scene.crowns import Detail
from renderer.scene.mesh import Mesh
from renderer.scene.tufts import petals_round, tints, tuft, wrapped

Hue = Literal["white", "yellow", "violet"]
HEADS: Mapping[Hue, tuple[str, float, int]] = MappingProxyType(
    {"white": ("petal", 0.026, 7), "yellow": ("flag", 0.02, 5), "violet": ("blossom", 0.022, 6)},
)
"""Strip of the atlas, length in metres and number of a flower's petals."""


def reeds(seed: int, places: Array, *, height: float = 1.56, detail: Detail = "full") -> Mesh:
    """Common reed: a leaning culm, long arching leaves most of which point downwind, a drooping plume."""
    rng = Generator(PCG64([seed, 1]))
    n = len(places)
    tall = height * np.clip(rng.normal(0.92, 0.12, n), 0.55, 1.08)
    wind = rng.uniform(0, 2 * np.pi)
    azimuth = wind + rng.normal(0, 0.9, n)
    tilt = np.abs(rng.normal(0.03, 0.05, n))[:, None] + np.stack([np.zeros(n), rng.uniform(0.03, 0.25, n)], axis=1)
    tint = tints(rng, n, 0.05)
    tint[rng.uniform(size=n) < 0.12] *= [1.5, 1.15, 0.95]
    culm = Blades(places, azimuth, tilt, tall, np.full(n, 0.015), tint, rng.uniform(0, 3, n))
    crossed = replace(culm, twist=culm.twist + np.pi / 2)
    parts = [
        ribbons(side, paint="reed", profile=(1, 0.85), gradient=(0.7, 1.0), sway=0.35)
        for side in ((culm, crossed) if detail == "full" else (culm,))
    ]
    per_culm, nodes = (6, (0.8, 0.95)) if detail == "full" else (4, (1.0,))
    share = np.linspace(0.3, 0.93, per_culm) + rng.uniform(-0.04, 0.04, (n, per_culm))
    root = culm.along(share)
    leaf_azimuth = azimuth[:, None] + np.arange(per_culm) * np.pi + rng.normal(0, 0.55, (n, per_culm))
    leaf_azimuth = wind + 0.62 * wrapped(leaf_azimuth - wind)
    droop = rng.uniform(0.2, 1.35, (n, per_culm)) + 0.35 * (1 - share)
    start = rng.uniform(0.25, 0.6, (n, per_culm))
    length = tall[:, None] * rng.uniform(0.2, 0.33, (n, per_culm)) * (1.1 - 0.45 * share**4)
    wide = rng.uniform(0.026, 0.04, (n, per_culm)) * (1 if detail == "full" else 1.6)
    leaf_tint = np.repeat(tint[:, None], per_culm, axis=1) * (0.72 + 0.42 * share)[..., None]
    blades = Blades(
        root.reshape(-1, 3),
        leaf_azimuth.ravel(),
        np.stack([start, start + droop], axis=-1).reshape(-1, 2),
        length.ravel(),
        wide.ravel(),
        leaf_tint.reshape(-1, 3),
        rng.normal(0, 0.3, n * per_culm),
    )
    leaves_mesh = ribbons(blades, paint="reed", profile=nodes, gradient=(0.85, 1.1), lift=0.45, sway=0)
    parts.append(swaying(leaves_mesh, places, 0.35))
    parts.append(_plumes(rng, culm, detail))
    return Mesh.merge(parts)


def _plumes(rng: Generator, culm: Blades, detail: Detail) -> Mesh:
    """Feathery heads on the taller half of the culms, nodding to the side to which the culm bends."""
    chosen = np.flatnonzero(culm.length > np.quantile(culm.length, 0.45)) if len(culm.length) else np.zeros(0, int)
    spikes = 5 if detail == "full" else 2
    share = np.linspace(0.9, 1.0, spikes)
    tip = culm.along(np.tile(share, (len(chosen), 1)), chosen)
    k = len(chosen) * spikes
    azimuth = np.repeat(culm.azimuth[chosen], spikes) + rng.normal(0, 0.55, k)
    start = rng.uniform(0.05, 0.5, k)
    blades = Blades(
        tip.reshape(-1, 3),
        azimuth,
        np.stack([start, start + rng.uniform(0.3, 0.9, k)], axis=1),
        rng.uniform(0.13, 0.24, k),
        rng.uniform(0.022, 0.036, k) * (1 if detail == "full" else 1.7),
        np.repeat(tints(rng, len(chosen), 0.04), spikes, axis=0),
        rng.uniform(0, 3, k),
    )
    mesh = ribbons(blades, paint="plume", profile=(0.5, 1.0), gradient=(0.8, 1.25), lift=0.7, sway=0)
    return swaying(mesh, culm.root, 0.35)


def cattails(seed: int, places: Array, *, height: float = 1.45, detail: Detail = "full") -> Mesh:
    """Cattail: a fan of erect straps, some of them kinked, and on most plants a brown spike."""
    rng = Generator(PCG64([seed, 2]))
    n = len(places)
    stalk, spikes = _spikes(rng, places, height, detail)
    straps = 9 if detail == "full" else 4
    k = n * straps
    near = np.repeat(places, straps, axis=0) + rng.normal(0, 0.045, (k, 3)) * [1, 0, 1]
    tall = height * np.repeat(rng.uniform(0.85, 1.1, n), straps) * rng.uniform(0.6, 1.05, k)
    start = np.abs(rng.normal(0.05, 0.07, k))
    bend = np.where(rng.uniform(size=k) < 0.22, rng.uniform(0.8, 1.6, k), rng.uniform(0.05, 0.4, k))
    tint = tints(rng, k, 0.06)
    tint[rng.uniform(size=k) < 0.08] *= [1.45, 1.1, 0.75]
    blades = Blades(
        near,
        rng.uniform(0, 2 * np.pi, k),
        np.stack([start, start + bend], axis=1),
        tall,
        rng.uniform(0.017, 0.026, k) * (1 if detail == "full" else 1.5),
        tint,
        rng.uniform(-0.8, 0.8, k),
    )
    profile = (0.95, 1.0, 0.75) if detail == "full" else (1.0, 0.8)
    leaves_mesh = ribbons(blades, paint="cattail", profile=profile, gradient=(0.55, 1.15), lift=0.45, sway=0.3)
    return Mesh.merge([leaves_mesh, stalk, spikes])


def _spikes(rng: Generator, places: Array, height: float, detail: Detail) -> tuple[Mesh, Mesh]:
    """The stalks that most plants bear, and the brown spikes on them."""
    n = len(places)
    bearing = np.flatnonzero(rng.uniform(size=n) < 0.75)
    m = len(bearing)
    stalk = Blades(
        places[bearing],
        rng.uniform(0, 2 * np.pi, m),
        np.abs(rng.normal(0.02, 0.05, (m, 2))),
        height * rng.uniform(0.92, 1.12, m),
        np.full(m, 0.015),
        tints(rng, m, 0.04),
        rng.uniform(0, 3, m),
    )
    stalks = ribbons(stalk, paint="cattail", profile=(1, 0.8), gradient=(0.7, 1.2), sway=0.3)
    low, high = stalk.along(np.full((m, 1), 0.8))[:, 0], stalk.along(np.full((m, 1), 0.925))[:, 0]
    axis = (high - low) * rng.uniform(0.85, 1.25, m)[:, None]
    weight = np.minimum(0.3 * (low[:, 1] - places[bearing, 1]) ** 2, 1)
    radius = rng.uniform(0.014, 0.018, m)
    sides = 4 if detail == "full" else 3
    return stalks, spindles(low, axis, radius, tints(rng, m, 0.03), paint="spike", sway=weight, sides=sides)


def sedge(seed: int, places: Array, *, height: float = 0.55, detail: Detail = "full") -> Mesh:
    """Tussocks of narrow leaves that arch over to all sides."""
    rng = Generator(PCG64([seed, 3]))
    blades = 15 if detail == "full" else 6
    tussocks = tuft(rng, places, blades, height, spread=0.06, tilt=(0.08, 0.5), bend=(0.5, 1.5))
    profile = (0.9, 0.85) if detail == "full" else (1.0,)
    wide = 0.015 if detail == "full" else 0.026
    return ribbons(tussocks.wide(wide), paint="sedge", profile=profile, gradient=(0.42, 1.15), lift=0.8, sway=0.5)


def grass(seed: int, places: Array, *, height: float = 0.28, detail: Detail = "full") -> Mesh:
    """Tufts of grass: a few bent blades, more short straight ones, now and then a dry stalk."""
    rng = Generator(PCG64([seed, 4]))
    bent, short = (4, 5) if detail == "full" else (0, 3)
    wide = 0.014 if detail == "full" else 0.03
    long = tuft(rng, places, bent, height, spread=0.05, tilt=(0.05, 0.45), bend=(0.3, 1.2))
    low = tuft(rng, places, short, height * 0.72, spread=0.08, tilt=(0.05, 0.7), bend=(0.0, 0.1))
    parts = [
        ribbons(long.wide(wide), paint="grass", profile=(1.0, 0.75), gradient=(0.5, 1.15), lift=1.1),
        ribbons(low.wide(wide * 1.15), paint="grass", profile=(1.0,), gradient=(0.55, 1.05), lift=1.1),
    ]
    if detail == "full":
        dry = places[rng.uniform(size=len(places)) < 0.12]
        stalks = tuft(rng, dry, 1, height * 1.6, spread=0.03, tilt=(0.0, 0.2), bend=(0.1, 0.4))
        parts.append(ribbons(stalks.wide(0.008), paint="straw", gradient=(0.7, 1.05), lift=1.0))
    return Mesh.merge(parts)


def irises(seed: int, places: Array, *, detail: Detail = "full") -> Mesh:
    """Yellow flag: a flat fan of swords and a stem with one or two flowers."""
    rng = Generator(PCG64([seed, 5]))
    n = len(places)
    swords = tuft(rng, places, 8 if detail == "full" else 4, 0.75, spread=0.05, tilt=(0.02, 0.3), bend=(0.0, 0.45))
    parts = [
        ribbons(
            swords.wide(0.026),
            paint="cattail",
            profile=(1, 0.95, 0.6)[: 3 if detail == "full" else 2],
            gradient=(0.55, 1.15),
            sway=0.4,
        )
    ]
    stem = Blades(
        places,
        rng.uniform(0, 2 * np.pi, n),
        np.abs(rng.normal(0.05, 0.06, (n, 2))),
        rng.uniform(0.68, 0.85, n),
        np.full(n, 0.012),
        tints(rng, n, 0.03),
    )
    parts.append(ribbons(stem, paint="cattail", sway=0.4))
    head = stem.along(np.full((n, 1), 1.0))[:, 0]
    falls = petals_round(rng, head, 3, 0.085, 0.05, tilt=(0.9, 2.5))
    standards = petals_round(rng, head, 3, 0.05, 0.022, tilt=(0.15, 0.4))
    for petals in (falls, standards):
        mesh = ribbons(petals, paint="flag", profile=(0.45, 1.0), gradient=(0.85, 1.1), lift=0.9, sway=0)
        parts.append(swaying(mesh, places, 0.4))
    return Mesh.merge(parts)


def flowers(seed: int, places: Array, *, hue: Hue = "white", detail: Detail = "full") -> Mesh:
    """Small wild flowers on thin stems, a head of five to eight petals round a yellow middle."""
    rng = Generator(PCG64([seed, 6]))
    n = len(places)
    paint, size, count = HEADS[hue]
    stem = Blades(
        places,
        rng.uniform(0, 2 * np.pi, n),
        np.abs(rng.normal(0.08, 0.12, (n, 2))),
        rng.uniform(0.16, 0.36, n),
        np.full(n, 0.006),
        tints(rng, n, 0.04),
    )
    head = stem.along(np.full((n, 1), 1.0))[:, 0]
    petals = petals_round(
        rng, head, count if detail == "full" else 3, size, size * (0.85 if detail == "full" else 1.8), tilt=(1.1, 1.6)
    )
    tint = (0.75, 0.62, 1.35) if hue == "violet" else (1.0, 1.0, 1.0)
    petals = replace(petals, tint=petals.tint * tint)
    head[:, 1] += 0.004
    middle = petals_round(rng, head, 3, size * 0.42, size * 0.6, tilt=(1.0, 1.4))
    parts = [
        ribbons(stem, paint="grass", profile=(1.0,), gradient=(0.6, 1.0)),
        swaying(ribbons(petals, paint=paint, profile=(0.7,), gradient=(0.85, 1.05), lift=1.5, sway=0), places, 1.0),
        swaying(ribbons(middle, paint="yolk", profile=(1.0,), gradient=(1.0, 1.0), lift=1.5, sway=0), places, 1.0),
    ]
    return Mesh.merge(parts)
