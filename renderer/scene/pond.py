"""The default scene: a small pond in a bowl of meadow and trees, with a jetty and boulders.

Cheap to import: what it is built of stands in ``pond_parts``, which is read only where no bake is found.
"""

from __future__ import annotations

from pathlib import Path

from renderer.scene.bake import baked_scene, cache_directory, source_key
from renderer.scene.entry import SceneEntry
from renderer.scene.scene import Scene

SEED = 2006


def load(directory: Path | None = None) -> Scene:
    """The scene, from the bakes in ``directory`` (the user's cache, if none is given)."""
    key = source_key(Path(__file__).parent.glob("*.py"), SEED)
    return baked_scene("pond", key, directory or cache_directory(), build)


def build() -> Scene:
    """The scene from its seed alone: seconds of work."""
    from renderer.scene import pond_parts  # noqa: PLC0415 - the builders cost every process that only reads a bake

    return pond_parts.build(SEED)


ENTRY = SceneEntry(
    name="pond",
    title="Pond",
    summary="A small pond in a bowl of meadow and trees, with a jetty, boulders, reeds and lilies.",
    water_level=0.0,
    water_extents=(-19.5, 17.5, -16.5, 13.5),
    centre=(0.0, 0.4, 0.0),
    own={
        "camera": {"eye": [9, 3.2, 9], "target": [0, 0.4, 0], "up": [0, 1, 0], "fov_y": 45},
        "sun": {"azimuth": 235, "elevation": 38, "color": [1, 0.96, 0.9], "intensity": 1.5},
        "ambient": [0.22, 0.25, 0.30],
        "sky": {"model": "analytic"},
        "fog": None,
    },
    load=load,
)
