"""The pictures of two pages: the gallery, with every technique in every scene and pairs to compare; and the layers."""

from __future__ import annotations

from typing import Any

from tests.golden.pictures import LOW_EYE, PICTURES, SIZE, Page, Picture

GALLERY_SIZE: dict[str, Any] = {"width": 960, "height": 540, "msaa": 4, "samples": 4, "format": "webp"}
MOMENT = 2.0
"""Seconds: when the gallery's pictures are taken."""

COLUMNS: dict[str, str] = {
    "luna": "Luna's pond water",
    "lake": "Habib's lake water",
    "lake_edges": "Habib's lake water with natural edges",
    "tut29": "Rastertek's water",
}
"""The techniques in the gallery's order, and how its texts name them."""
ROWS: dict[str, str] = {"pond": "the pond", "lake": "the lake", "bath": "the bath"}
"""The scenes in the gallery's order, and how its texts name them."""

EVERYWHERE: dict[str, Picture] = {
    f"{technique}-in-{scene}": Picture(f"{name} in {place}", {"scene": scene, "water": technique, "time": MOMENT})
    for scene, place in ROWS.items()
    for technique, name in COLUMNS.items()
}

ROLLED: dict[str, Any] = {"camera": {"position": [9.2, 3.0, 9.6], "yaw": 43.0, "pitch": -12.0, "roll": 16.0}}
NEAR_SHORE: dict[str, Any] = {"camera": {"eye": [5.6, 1.5, 6.4], "target": [-1.0, 0.0, -1.5], "fov_y": 40}}


def water(technique: str, base: dict[str, Any] = LOW_EYE, /, **parameters: Any) -> dict[str, Any]:
    """The pond, in this view, with this water."""
    return {**base, "scene": "pond", "time": MOMENT, "water": {"technique": technique, **parameters}}


PAIRS: dict[str, Picture] = {
    "edges-cut": Picture("Lake water at the shore", water("lake", NEAR_SHORE, wave_height=0.2)),
    "edges-natural": Picture("Lake water with natural edges at the shore", water("lake_edges", NEAR_SHORE)),
    "fresnel-0": Picture("Lake water, Fresnel mode 0", water("lake", fresnel_mode=0)),
    "fresnel-1": Picture("Lake water, Fresnel mode 1", water("lake", fresnel_mode=1)),
    "fresnel-2": Picture("Lake water, Fresnel mode 2", water("lake", fresnel_mode=2)),
    "wind-0": Picture("Lake water, wind at 0 degrees", water("lake", wind_direction=0.0)),
    "wind-90": Picture("Lake water, wind at 90 degrees", water("lake", wind_direction=90.0)),
    "bias-none": Picture("Lake water, maps cut at the water", water("lake", NEAR_SHORE, clip_bias=0.0)),
    "bias-large": Picture("Lake water, maps cut past the water", water("lake", NEAR_SHORE, clip_bias=0.4)),
    "roll-right": Picture("Lake water under a rolled camera", water("lake", ROLLED)),
    "roll-published": Picture("The same with the look-at mirror", water("lake", ROLLED, as_published=True)),
    "wrap-right": Picture("Rastertek's water at the screen's edge", water("tut29", reflect_refract_scale=0.06)),
    "wrap-published": Picture(
        "The same with wrapped maps", water("tut29", reflect_refract_scale=0.06, as_published=True)
    ),
}
"""Pictures that stand side by side, two or three to a claim of the documents."""

LAYERS: dict[str, Picture] = {
    f"layer-{layer.replace('_', '-')}": Picture(text, {**LOW_EYE, "layers": [layer]})
    for layer, text in {
        "reflection_weight": "The weight of the reflection",
        "perturbation": "The shift by the ripples",
        "validity": "Where both maps could be read",
        "water_mask": "Where water is seen",
    }.items()
}
"""The layers that the README does not show."""

PAGES: tuple[Page, ...] = (
    Page("README.md", SIZE, PICTURES),
    Page("docs/gallery.md", GALLERY_SIZE, EVERYWHERE | PAIRS),
    Page("docs/layers.md", SIZE, LAYERS),
)
