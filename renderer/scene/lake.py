"""A mountain lake: three hundred metres of clear water among woods, with snowy peaks behind.

Cheap to import: what it is built of stands in ``lake_parts``, which is read only where no bake is found.
"""

from __future__ import annotations

from pathlib import Path

from renderer.scene.bake import baked_scene, cache_directory, source_key
from renderer.scene.entry import SceneEntry
from renderer.scene.scene import Scene

SEED = 1907


def load(directory: Path | None = None) -> Scene:
    """The scene, from the bakes in ``directory`` (the user's cache, if none is given)."""
    key = source_key(Path(__file__).parent.glob("*.py"), SEED)
    return baked_scene("lake", key, directory or cache_directory(), build)


def build() -> Scene:
    """The scene from its seed alone: seconds of work."""
    from renderer.scene import lake_parts  # noqa: PLC0415 - the builders cost every process that only reads a bake

    return lake_parts.build(SEED)


ENTRY = SceneEntry(
    name="lake",
    title="Lake",
    summary="A mountain lake among woods, with an island, a headland, reeds and snowy peaks behind.",
    water_level=0.0,
    water_extents=(-116.0, 112.0, -332.0, 12.0),
    centre=(3.0, 0.4, -35.0),
    own={
        "camera": {"eye": [1.8, 2.8, 5.6], "target": [3, 0, -35], "up": [0, 1, 0], "fov_y": 45},
        "sun": {"azimuth": 238, "elevation": 33, "color": [1, 0.95, 0.88], "intensity": 1.55},
        "ambient": [0.21, 0.25, 0.31],
        "sky": {"model": "analytic"},
        "fog": None,
    },
    load=load,
    shadow_radius=72.0,
)
