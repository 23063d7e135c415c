"""Blades in groups: tufts, whorls of petals, and the chance in their colours."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from renderer.scene.blades import Array, Blades

GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))

Span = tuple[float, float]


def tuft(
    rng: Generator,
    places: Array,
    blades: int,
    height: float,
    *,
    spread: float,
    tilt: Span,
    bend: Span,
) -> Blades:
    """``blades`` blades of unit width round each place, fanning outwards.

    Tufts differ in height and in their green. ``spread`` metres from the middle; ``tilt`` radians from
    the vertical at the root, ``bend`` how much more at the tip.
    """
    n, k = len(places), len(places) * blades
    turn = (np.tile(np.arange(blades), n) + rng.uniform(-0.6, 0.6, k)) * GOLDEN_ANGLE
    azimuth = turn + np.repeat(rng.uniform(0, 2 * np.pi, n), blades)
    off = np.abs(rng.normal(0, spread, k))
    aside = np.stack([off * np.cos(azimuth), np.zeros(k), off * np.sin(azimuth)], axis=1)
    start = rng.uniform(*tilt, k)
    return Blades(
        root=np.repeat(places, blades, axis=0) + aside,
        azimuth=azimuth,
        tilt=np.stack([start, start + rng.uniform(*bend, k)], axis=1),
        length=height * np.repeat(rng.uniform(0.65, 1.25, n), blades) * rng.uniform(0.6, 1.15, k),
        width=np.ones(k),
        tint=np.repeat(tints(rng, n, 0.05), blades, axis=0) * rng.uniform(0.85, 1.15, (k, 1)),
        twist=rng.normal(0, 0.5, k),
    )


def petals_round(rng: Generator, head: Array, count: int, length: float, width: float, *, tilt: Span) -> Blades:
    """A whorl of ``count`` petals round each head (n, 3)."""
    n, k = len(head), len(head) * count
    turn = np.tile(np.arange(count), n) * 2 * np.pi / count
    return Blades(
        root=np.repeat(head, count, axis=0),
        azimuth=turn + np.repeat(rng.uniform(0, 2 * np.pi, n), count),
        tilt=np.array(tilt) + rng.normal(0, 0.12, (k, 1)),
        length=length * rng.uniform(0.85, 1.15, k),
        width=np.full(k, width),
        tint=np.repeat(rng.uniform(0.9, 1.05, (k, 1)), 3, axis=1),
    )


def tints(rng: Generator, count: int, spread: float) -> Array:
    """Factors (count, 3) between yellowish and bluish (by ``spread``), lighter and darker."""
    hue, shade = rng.normal(0, spread, count), 1 + rng.normal(0, 0.07, count)
    return np.asarray(np.stack([1 + 1.6 * hue, 1 + 0.3 * hue, 1 - 1.2 * hue], axis=1) * shade[:, None])


def wrapped(angle: Array) -> Array:
    """Angles brought to −π..π."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)
