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

ROLLED: dict[str, Any] = {
    "camera": {"position": [4.0, 2.2, 5.0], "yaw": 30.0, "pitch": -14.0, "roll": 35.0, "fov_y": 50.0}
}
LEVEL: dict[str, Any] = {"camera": {"position": [8.2, 2.0, 8.8], "yaw": 43.0, "fov_y": 46.0}}
SHORE: dict[str, Any] = {"camera": {"eye": [7.0, 1.5, 7.4], "target": [3.4, -0.2, 3.4], "fov_y": 30}}
BEACH: dict[str, Any] = {"camera": {"eye": [7.4, 1.5, 6.6], "target": [5.0, 0.0, 4.4], "fov_y": 30}}


def water(technique: str, base: dict[str, Any] = LOW_EYE, /, **parameters: Any) -> dict[str, Any]:
    """The pond, in this view, with this water."""
    return {**base, "scene": "pond", "time": MOMENT, "water": {"technique": technique, **parameters}}


PAIRS: dict[str, Picture] = {
    "edges-cut": Picture("Lake water at a shore", water("lake", BEACH, fresnel_mode=0, wave_height=0.2)),
    "edges-natural": Picture(
        "Lake water with natural edges at a shore", water("lake_edges", BEACH, fresnel_mode=0, wave_height=0.2)
    ),
    "fresnel-0": Picture("Lake water, Fresnel mode 0", water("lake", fresnel_mode=0)),
    "fresnel-1": Picture("Lake water, Fresnel mode 1", water("lake", fresnel_mode=1)),
    "fresnel-2": Picture("Lake water, Fresnel mode 2", water("lake", fresnel_mode=2)),
    "wind-0": Picture(
        "Lake water, wind at 0 degrees", water("lake", fresnel_mode=0, wave_height=0.15, wind_direction=0.0)
    ),
    "wind-90": Picture(
        "Lake water, wind at 90 degrees", water("lake", fresnel_mode=0, wave_height=0.15, wind_direction=90.0)
    ),
    "bias-none": Picture(
        "Lake water, its refraction map cut at the water",
        water("lake", SHORE, wave_height=0.2, as_published=True, refraction_clip_bias=0.0),
    ),
    "bias-large": Picture(
        "Lake water, its refraction map cut five metres higher",
        water("lake", SHORE, wave_height=0.2, as_published=True, refraction_clip_bias=5.0),
    ),
    "roll-right": Picture("Lake water under a rolled camera", water("lake", ROLLED, fresnel_mode=0, draw_mode=1.5)),
    "roll-published": Picture(
        "Lake water under a rolled camera, as published",
        water("lake", ROLLED, fresnel_mode=0, draw_mode=1.5, as_published=True),
    ),
    "wrap-right": Picture("Rastertek's water with strong ripples", water("tut29", LEVEL, reflect_refract_scale=0.08)),
    "wrap-published": Picture(
        "Rastertek's water with strong ripples, as published",
        water("tut29", LEVEL, reflect_refract_scale=0.08, as_published=True),
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
