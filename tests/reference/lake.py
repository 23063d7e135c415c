"""The two lake techniques, pixel by pixel in double precision. Written from Habib 2009 and Habib 2009b.

All is in the documents' own space: z upwards, textures with their first row on top and v downwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

DULL = (0.1, 0.1, 0.2)
TINT = (0.95, 1.00, 1.05)
HIGHLIGHT = (0.98, 0.97, 0.7, 0.6)
LIGHT = (0.1, 0.6, 0.5)


def in_document(vector: ArrayLike) -> Floats:
    """A vector of the y-up world in the documents' z-up world, both right-handed."""
    v = np.asarray(vector, np.float64)
    return np.stack([v[..., 0], -v[..., 2], v[..., 1]], axis=-1)


def unit(vector: ArrayLike) -> Floats:
    """Vectors (..., 3) at length 1."""
    v = np.asarray(vector, np.float64)
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def fresnel(mode: int, cosine: ArrayLike, *, has_third: bool = True) -> Floats:
    """The Fresnel term of a mode, not yet cut; the later document lacks the third."""
    c = np.asarray(cosine, np.float64)
    if mode == 1:
        return np.asarray(0.02 + 0.97 * (1 - c) ** 5)
    if mode == 2 and has_third:
        return np.asarray(1 / (1 + c) ** 5)
    return np.asarray(1 - 1.3 * c)


def weight(mode: int, cosine: ArrayLike, draw_mode: float = 1.0, *, has_third: bool = True) -> Floats:
    """Share of the reflection: times the hardness, then between 0 and 1."""
    return np.asarray(np.minimum(np.maximum(fresnel(mode, cosine, has_third=has_third) * draw_mode, 0), 1))


def bump_place(plane: ArrayLike, degrees: float, wave_length: float, milliseconds: float, force: float) -> Floats:
    """Where the bump map is read: the row vector (u, v, 0, 1) times a rotation about z, divided, moved along v."""
    p = np.asarray(plane, np.float64)
    a = np.radians(degrees)
    rotation = np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
    return np.asarray((p @ rotation) / wave_length + (milliseconds / 100000.0) * force * np.array([0.0, 1.0]))


def perturbation(normal: ArrayLike, wave_height: float) -> Floats:
    """The waves' shift, (u, v): of a normal of the documents' world, stored as a colour 0..1 without rounding."""
    color = (np.asarray(normal, np.float64) + 1) / 2
    return np.asarray(wave_height * (color[..., :2] - 0.5))


def highlight(eye: ArrayLike, shift: ArrayLike, spec_perturb: float, spec_power: float, light: ArrayLike) -> Floats:
    """The power of the cosine at the half vector; 0 where that points below the water or the light stands there."""
    s = np.asarray(shift, np.float64) * spec_perturb
    bent = np.concatenate([s, np.zeros_like(s[..., :1])], axis=-1)
    cosine = unit(np.asarray(eye) + unit(light) + bent)[..., 2]
    raised = np.exp(spec_power * np.log(np.maximum(cosine, 1e-300)))
    return np.where((cosine > 0) & (unit(light)[..., 2] > 0), raised, 0.0)


def added(t: ArrayLike, color: ArrayLike = HIGHLIGHT) -> Floats:
    """What the highlight adds: the colour's four channels are scaled by t, then red, green and blue by alpha."""
    c = np.asarray(color, np.float64) * np.asarray(t, np.float64)[..., None]
    return np.asarray(c[..., :3] * c[..., 3:])


def blended(refracted: ArrayLike, reflected: ArrayLike, share: ArrayLike) -> Floats:
    """The two maps' colours by the reflection's share."""
    f = np.asarray(share, np.float64)[..., None]
    return np.asarray(np.asarray(refracted) * (1 - f) + np.asarray(reflected) * f)


def dulled(combined: ArrayLike, factor: float, dull: ArrayLike = DULL) -> Floats:
    """The first document's water colouring."""
    return np.asarray(factor * np.asarray(dull, np.float64) + (1 - factor) * np.asarray(combined, np.float64))


def is_valid(displayed: ArrayLike, clear: ArrayLike = (0.0, 0.0, 0.0), threshold: float = 0.1) -> NDArray[np.bool_]:
    """Whether a map shows something: the sum of the three channels, apart from the clear colour, is large enough."""
    apart = np.abs(np.asarray(displayed, np.float64) - np.asarray(clear, np.float64))
    return np.asarray(apart.sum(axis=-1) >= threshold)


def tinted(combined: ArrayLike, valid: ArrayLike, factor: float) -> Floats:
    """The second document's water colouring, with its alpha: (..., 4)."""
    v = np.asarray(valid, np.float64)[..., None]
    rgba = np.concatenate([np.asarray(combined, np.float64) * v, v], axis=-1)
    return np.asarray(factor * rgba * np.array([*TINT, 1.0]))


def over(color: ArrayLike, alpha: ArrayLike, behind: ArrayLike) -> Floats:
    """Source alpha against what stands behind."""
    a = np.asarray(alpha, np.float64)[..., None]
    return np.asarray(np.asarray(color) * a + np.asarray(behind) * (1 - a))


def mirrored_view(eye: ArrayLike, target: ArrayLike, side: ArrayLike, level: float) -> Floats:
    """The view matrix (4, 4) of the mirrored camera, for columns: eye and target mirrored, the side vector not."""
    e, t = (np.asarray(v, np.float64) * [1, 1, -1] + [0, 0, 2 * level] for v in (eye, target))
    up = np.cross(np.asarray(side, np.float64), t - e)
    back = unit(e - t)
    right = unit(np.cross(up, back))
    view = np.eye(4)
    view[:3, :3] = right, np.cross(back, right), back
    view[:3, 3] = -view[:3, :3] @ e
    return view
