"""The weight of the reflection against the angle of view, as each technique's shader computes it: what is plotted."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.pipeline import first_instant
from renderer.request import FrameRequest
from renderer.water.catalogue import TECHNIQUES
from tests.golden.plot import Axis, Line, chart
from tests.renderer.drawing import shared_renderer
from tests.renderer.world import EMPTY, LEVEL, registered

Floats = NDArray[np.float64]

ANGLES = np.linspace(0.0, 90.0, 181)
ANGLE = Axis("Angle between the view and the water's normal, degrees", {float(a): f"{a}°" for a in range(0, 91, 15)})
WEIGHT = Axis("Weight of the map in the blend", {w / 4: f"{w / 4:g}" for w in range(5)})
ROWS = 1024
"""Pixels from straight down to the horizon."""
WATER_INDEX = 1.333
REAL = "water, by Fresnel"


class Series(NamedTuple):
    """One curve: its name in the legend, the water, and which of the two maps' weights it shows."""

    text: str
    water: dict[str, Any]
    shows_refraction: bool = False


class Curves(NamedTuple):
    """One chart: its title, its curves, and whether real water is drawn beside them."""

    title: str
    series: tuple[Series, ...]
    shows_real_water: bool = True

    @property
    def is_drawable(self) -> bool:
        """Whether the catalogue has all its techniques."""
        return all(series.water["technique"] in TECHNIQUES for series in self.series)


def luna(bias: float, power: float) -> dict[str, Any]:
    """Luna's water without ripples: the normal is the plane's."""
    return {"technique": "luna", "ripple_height": 0.0, "refraction_bias": bias, "refraction_power": power}


def lake(mode: int, hardness: float = 1.0, technique: str = "lake") -> dict[str, Any]:
    """Habib's water in one of its modes."""
    return {"technique": technique, "fresnel_mode": mode, "draw_mode": hardness}


CURVES: dict[str, Curves] = {
    "curves-techniques": Curves(
        "Weight of the reflection, each technique by its defaults",
        (
            Series("luna", {"technique": "luna", "ripple_height": 0.0}),
            Series("lake, lake_edges", {"technique": "lake"}),
            Series("tut29", {"technique": "tut29"}),
        ),
    ),
    "curves-luna-simple": Curves(
        "Luna, figure 6: the cosine",
        (Series("refraction", luna(0.0, 1.0), shows_refraction=True), Series("reflection", luna(0.0, 1.0))),
        shows_real_water=False,
    ),
    "curves-luna-full": Curves(
        "Luna, figure 7: power 2 and bias 0.1",
        (Series("refraction", luna(0.1, 2.0), shows_refraction=True), Series("reflection", luna(0.1, 2.0))),
        shows_real_water=False,
    ),
    "curves-luna-family": Curves(
        "Luna: what bias and power do to the reflection",
        (
            Series("bias 0, power 1", luna(0.0, 1.0)),
            Series("bias −0.3, power 1", luna(-0.3, 1.0)),
            Series("bias 0.1, power 2", luna(0.1, 2.0)),
            Series("bias 0, power 4", luna(0.0, 4.0)),
        ),
    ),
    "curves-lake-modes": Curves(
        "Lake: three Fresnel modes",
        (Series("mode 0", lake(0)), Series("mode 1", lake(1)), Series("mode 2", lake(2))),
    ),
    "curves-lake-hardness": Curves(
        "Lake: mode 2 times the draw mode",
        (
            Series("draw mode 0.5", lake(2, 0.5)),
            Series("draw mode 1", lake(2, 1.0)),
            Series("draw mode 2", lake(2, 2.0)),
            Series("draw mode 4", lake(2, 4.0)),
        ),
    ),
    "curves-lake-edges": Curves(
        "Lake with natural edges: two modes",
        (Series("mode 0", lake(0, technique="lake_edges")), Series("mode 1", lake(1, technique="lake_edges"))),
    ),
    "curves-tut29": Curves(
        "Rastertek: one weight for all angles",
        (
            Series("refraction", {"technique": "tut29"}, shows_refraction=True),
            Series("reflection", {"technique": "tut29"}),
        ),
    ),
}


def reflection_weight(water: dict[str, Any]) -> Floats:
    """The weight of the reflection at ``ANGLES``, as a picture of flat water in half floats holds it."""
    with registered():
        request = FrameRequest.parse(
            {
                "scene": EMPTY,
                "width": 4,
                "height": ROWS,
                "msaa": 1,
                "layers": ["reflection_weight"],
                "camera": {"position": [0.0, LEVEL + 2.0, 0.0], "pitch": -45.0, "fov_y": 90.0},
                "water": {**water, "extents": [-1e5, 1e5, -1e5, 1e5]},
            }
        )
        renderer = shared_renderer()
        renderer._targets.begin_frame()
        target = renderer._draw(renderer._stage(EMPTY), first_instant(request), "reflection_weight")
        rows = target.read()[:, 1, 0].astype(np.float64)
    up = (np.arange(ROWS) + 0.5) / ROWS * 2 - 1  # a framebuffer's first row is the lowest
    rays = np.stack([np.zeros(ROWS), up, np.ones(ROWS), np.zeros(ROWS)], axis=-1) @ request.view().ray_from_ndc.T
    angles = np.degrees(np.arccos(-rays[:, 1] / np.linalg.norm(rays[:, :3], axis=-1)))
    return np.interp(ANGLES, angles, rows)


def real_water(angles: Floats) -> Floats:
    """What smooth water reflects of unpolarised light, by Fresnel's equations."""
    cos_in = np.cos(np.radians(angles))
    cos_out = np.sqrt(1 - (1 - cos_in**2) / WATER_INDEX**2)
    across = (cos_in - WATER_INDEX * cos_out) / (cos_in + WATER_INDEX * cos_out)
    along = (WATER_INDEX * cos_in - cos_out) / (WATER_INDEX * cos_in + cos_out)
    return np.asarray((across**2 + along**2) / 2)


def lines_of(curves: Curves) -> list[Line]:
    """The curves of a chart, as the shaders compute them now."""
    lines = []
    for series in curves.series:
        weight = reflection_weight(series.water)
        lines.append(Line(series.text, 1 - weight if series.shows_refraction else weight))
    if curves.shows_real_water:
        lines.append(Line(REAL, real_water(ANGLES), is_reference=True))
    return lines


def draw(curves: Curves, lines: list[Line]) -> str:
    """The chart's file."""
    return chart(curves.title, ANGLE, WEIGHT, ANGLES, lines)
