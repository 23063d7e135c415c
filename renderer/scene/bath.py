"""The bath: water in a marble basin before a wall with pillars, laid out as Rastertek n.d. has it.

The document's world is left-handed with +z forward and yaw clockwise from above; ours is right-handed. Its (x, y, z)
are our (x, y, -z): both say right, up, forward, so that every picture stays as it is and nothing is mirrored. In its
numbers:

- ground at y = 1, wall and pillar at (0, 6, 8), bath at (0, 2, 0), water at y = 2.75;
- camera at (-10, 6, -10), turned 45 degrees to the right: here at (-10, 6, 10) with a yaw of -45, since ours turns
  left. It looks level, to the north-east. The document does not state the field of view; here it is 45 degrees;
- light that travels along (0, -1, 0.5): here the sun stands towards (0, 1, 0.5). That vector is 1.118 long and the
  document leaves it so, which makes its n.l reach 1.118; our direction is a unit vector and the intensity carries the
  length. Ambient light is 0.15, the sun's colour 1. The document caps n.l at 1, and its sum with the ambient light at
  1 before the surface's colour multiplies it; the scene does not, and a face turned to the sun receives 1.268.

The models are not part of the document. Here the bath stands on the ground, so its middle at y = 2 puts its rim at
y = 3, over the clip plane that the document draws at 2.85; its inner faces enclose a square of 6.6 m, which is the
water's; the wall is 10 m high about its middle at y = 6, and the middle one of its pillars stands at x = 0. Hedge,
yews, lawn and woods are ours, so that all sides can be shown.
"""

from __future__ import annotations

from pathlib import Path

from renderer.scene.bake import baked_scene, cache_directory, source_key
from renderer.scene.entry import SceneEntry
from renderer.scene.scene import Scene

SEED = 29


def load(directory: Path | None = None) -> Scene:
    """The scene, from the bakes in ``directory`` (the user's cache, if none is given)."""
    key = source_key(Path(__file__).parent.glob("*.py"), SEED)
    return baked_scene("bath", key, directory or cache_directory(), build)


def build() -> Scene:
    """The scene from its seed alone: seconds of work."""
    from renderer.scene import bath_parts  # noqa: PLC0415 - the builders cost every process that only reads a bake

    return bath_parts.build(SEED)


ENTRY = SceneEntry(
    name="bath",
    title="Marble bath",
    summary="A marble bath in a paved court, before a brick wall with arches and stone pillars.",
    water_level=2.75,
    water_extents=(-3.3, 3.3, -3.3, 3.3),
    centre=(0.0, 2.75, 0.0),
    own={
        "camera": {"position": [-10, 6, 10], "yaw": -45, "pitch": 0, "roll": 0, "fov_y": 45},
        "sun": {"direction": [0, 1, 0.5], "color": [1, 1, 1], "intensity": 1.25**0.5},
        "ambient": [0.15, 0.15, 0.15],
        "sky": {"model": "analytic"},
        "fog": None,
    },
    load=load,
    shadow_radius=25.0,
)
