"""The pictures of the README, by name: what each shows and the request that draws it."""

from __future__ import annotations

from typing import Any, NamedTuple

from renderer.scene.catalogue import DEFAULT as DEFAULT_SCENE
from renderer.scene.catalogue import SCENES
from renderer.water.catalogue import DEFAULT as DEFAULT_TECHNIQUE
from renderer.water.catalogue import TECHNIQUES

SIZE: dict[str, Any] = {"width": 1280, "height": 720, "msaa": 4, "samples": 8, "format": "webp"}
LOW_EYE: dict[str, Any] = {"camera": {"eye": [8.2, 2.0, 8.8], "target": [-2.0, 0.3, -3.0], "fov_y": 42}}


class Picture(NamedTuple):
    """One picture: its alternative text, and its request."""

    text: str
    request: dict[str, Any]

    @property
    def is_drawable(self) -> bool:
        """Whether the catalogues have its scene and its technique."""
        water = self.request.get("water", {})
        technique = water if isinstance(water, str) else water.get("technique", DEFAULT_TECHNIQUE)
        return technique in TECHNIQUES and self.request.get("scene", DEFAULT_SCENE) in SCENES


class Page(NamedTuple):
    """A page with pictures: where it lies, how large they are, and which they are."""

    path: str
    size: dict[str, Any]
    pictures: dict[str, Picture]


def side(azimuth: float) -> dict[str, Any]:
    """The default view carried round the pond to this compass direction."""
    return {"camera": {"orbit": {"target": [0, 0.4, 0], "distance": 13.03, "azimuth": azimuth, "elevation": 12.4}}}


PICTURES: dict[str, Picture] = {
    "noon": Picture("The pond at noon", {"sun": {"azimuth": 150, "elevation": 58}}),
    "morning": Picture(
        "The pond on a clear morning",
        {
            "sun": {"azimuth": 95, "elevation": 19, "color": [1.0, 0.83, 0.62]},
            "ambient": [0.2, 0.23, 0.29],
        },
    ),
    "evening": Picture(
        "The pond before sunset",
        {
            "sun": {"azimuth": 262, "elevation": 9, "color": [1.0, 0.66, 0.38], "intensity": 1.6},
            "ambient": [0.2, 0.2, 0.26],
            "tonemap": {"operator": "aces", "exposure": 0.7},
        },
    ),
    "south-east": Picture("Seen from the south-east", side(135)),
    "south-west": Picture("Seen from the south-west", side(225)),
    "north-west": Picture("Seen from the north-west", side(315)),
    "north-east": Picture("Seen from the north-east", side(45)),
    "reflection-map": Picture("The reflection map", {**LOW_EYE, "layers": ["reflection_map"]}),
    "refraction-map": Picture("The refraction map", {**LOW_EYE, "layers": ["refraction_map"]}),
    "ripples-off": Picture("Without ripples", {**LOW_EYE, "water": {"ripple_scale": [0, 0], "ripple_height": 0}}),
    "ripples-on": Picture("With ripples", LOW_EYE),
}
