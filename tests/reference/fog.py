"""Light through air whose density falls with height: the integral itself, by quadrature."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)


def transmittance(
    y_eye: ArrayLike, y_point: ArrayLike, distance: ArrayLike, density: float, falloff: float
) -> NDArray[np.float64]:
    """exp(-integral of density * exp(-falloff |y|) along the way), Beer's law.

    The way is cut where it passes y = 0, where |y| has its kink; each part by 64 Gauss-Legendre nodes.
    """
    a, b, length = np.broadcast_arrays(*(np.asarray(v, np.float64) for v in (y_eye, y_point, distance)))
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = np.where(a * b < 0, a / (a - b), 1.0)
    total = np.zeros(a.shape)
    for start, end in ((np.zeros(a.shape), crossing), (crossing, np.ones(a.shape))):
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            s = start + (end - start) * (node + 1) / 2
            total += weight / 2 * (end - start) * np.exp(-falloff * np.abs(a + (b - a) * s))
    return np.asarray(np.exp(-density * total * length))
