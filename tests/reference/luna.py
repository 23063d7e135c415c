"""Luna's pond water in double precision, one pixel at a time. Written from Luna 2006.

Texture coordinates are the document's: u to the right, v downwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.reference import normals

Floats = NDArray[np.float64]


def shifted(place: ArrayLike, normal: ArrayLike, scale: ArrayLike) -> Floats:
    """Coordinates (n, 2) in a map moved by the rippled normal's horizontal components (sections 3 and 5.2)."""
    uv, n, s = (np.asarray(value, np.float64) for value in (place, normal, scale))
    return np.stack(
        [uv[:, 0] + n[:, 0] * s[0], uv[:, 1] + n[:, 2] * s[1] * normals.bottom_damping(uv[:, 1])],
        axis=-1,
    )


def weight(normal: ArrayLike, view: ArrayLike, bias: float, power: float) -> Floats:
    """The refraction's weight (section 4): the clamp comes after the bias."""
    cosine = (np.asarray(normal) * np.asarray(view)).sum(axis=-1)
    return np.asarray(np.clip(bias + np.maximum(cosine, 0) ** power, 0, 1))


def blended(reflected: ArrayLike, refracted: ArrayLike, refraction: ArrayLike) -> Floats:
    """lerp(reflected, refracted, weight)."""
    w = np.asarray(refraction)[:, None]
    return np.asarray(np.asarray(reflected) * (1 - w) + np.asarray(refracted) * w)


def lit(
    blend: ArrayLike,
    normal: ArrayLike,
    view: ArrayLike,
    sun: ArrayLike,
    *,
    ambient: ArrayLike,
    diffuse: ArrayLike,
    specular: ArrayLike,
    power: float,
) -> Floats:
    """Per-pixel lighting of a material whose ambient and diffuse colours are the blend's (section 4).

    ``ambient``, ``diffuse`` and ``specular`` are the products of light and material.
    """
    n, v, to_sun = (np.asarray(value, np.float64) for value in (normal, view, sun))
    cosine = n @ to_sun
    mirrored = 2 * cosine[:, None] * n - to_sun
    lobe = np.where(cosine > 0, np.maximum((mirrored * v).sum(axis=-1), 0) ** power, 0)
    received = np.asarray(ambient) + np.asarray(diffuse) * np.maximum(cosine, 0)[:, None]
    return np.asarray(np.asarray(blend) * received + np.asarray(specular) * lobe[:, None])
