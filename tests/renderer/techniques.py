"""Every technique's own words for what all can do: lie still, mirror all, let all through, be rough."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.pipeline import first_instant
from renderer.scene.catalogue import SCENES
from renderer.scene.scene import SceneObject
from renderer.water.catalogue import TECHNIQUES
from renderer.water.technique import MapSpec
from tests.renderer.drawing import FLAT, asked, shared_renderer
from tests.renderer.world import LEVEL, MATTE, box, entry_of, mirrored_copies, objects

Floats = NDArray[np.float64]
Water = Mapping[str, Any]


class Ways(NamedTuple):
    """How a technique is asked for what every technique can do."""

    still: Water
    """No waves, no light of its own: nothing but the blend of the maps."""
    mirror: Water
    """What makes still water reflect everything."""
    window: Water
    """What makes still water let everything through."""
    rough: Water
    """What makes waves as high as anybody wants them."""
    tile: float | None = None
    """Metres that still make the same picture where the water moves by them; None where any do."""
    repeats: Water | None = None
    """What gives both wave maps that tile."""
    guard: tuple[str, tuple[str, str]] | None = None
    """The shader's line that keeps out the wrong side of the water, and the line without it."""


LAKE_STILL: Water = {"wave_height": 0.0, "spec_alpha": 0.0}
WAYS: dict[str, Ways] = {
    "luna": Ways(
        still=FLAT,
        mirror={"refraction_bias": -1.0},
        window={"refraction_bias": 1.0},
        rough={"ripple_scale": [0.2, 0.2], "ripple_height": 4.0},
        tile=8.0,
        repeats={"tile_0": 8.0, "tile_1": 4.0},
        guard=("water/luna.glsl", ("bool leaks = refracted.a < 0.5;", "bool leaks = false;")),
    ),
    "lake": Ways(
        still={**LAKE_STILL, "dull_blend_factor": 0.0},
        mirror={"fresnel_mode": 2, "draw_mode": 40.0},
        window={"draw_mode": 0.0},
        rough={"wave_height": 0.4},
        guard=("water/lake.glsl", ("if (refracted.a < 0.5)", "if (false)")),
    ),
    "lake_edges": Ways(
        still={**LAKE_STILL, "dull_blend_factor": 1.0, "tint": [1.0, 1.0, 1.0]},
        mirror={"fresnel_mode": 1, "draw_mode": 60.0},
        window={"draw_mode": 0.0},
        rough={"wave_height": 0.4},
    ),
    "tut29": Ways(
        still={"reflect_refract_scale": 0.0},
        mirror={"blend": 0.0},
        window={"blend": 1.0},
        rough={"reflect_refract_scale": 0.2},
        guard=("water/tut29.glsl", ("if (refracted.a < 0.5)", "if (false)")),
    ),
}


def still(name: str, **more: Any) -> dict[str, Any]:
    """A technique's water without waves."""
    return {"technique": name, **WAYS[name].still, **more}


def mirror(name: str, **more: Any) -> dict[str, Any]:
    """A technique's water that reflects everything."""
    return still(name, **{**WAYS[name].mirror, **more})


def window(name: str, **more: Any) -> dict[str, Any]:
    """A technique's water that lets everything through."""
    return still(name, **{**WAYS[name].window, **more})


def rough(name: str, **more: Any) -> dict[str, Any]:
    """A technique's water with high waves and nothing else changed."""
    return {"technique": name, **WAYS[name].rough, **more}


def light(**fields: Any) -> NDArray[np.float32]:
    """What the shaders wrote for a small frame, before it becomes bytes, (h, w, 3), the top row first."""
    request = asked(**{"msaa": 1, **fields})
    renderer = shared_renderer()
    renderer._targets.begin_frame()
    drawn = renderer._draw(renderer._stage(request.scene), first_instant(request), request.layers[0])
    return np.asarray(drawn.read()[::-1, :, :3], np.float32)


def change_map(monkeypatch: pytest.MonkeyPatch, technique: str, name: str, **changes: Any) -> None:
    """Let a technique say something else of one of its maps."""
    kind = TECHNIQUES[technique]
    maps: Callable[[Any], Mapping[str, MapSpec]] = kind.maps

    def changed(water: Any) -> dict[str, MapSpec]:
        specs = dict(maps(water))
        return {**specs, name: replace(specs[name], **changes)}

    monkeypatch.setattr(kind, "maps", changed)


# ------------------------------------------------------------------------------------------------ worlds that tell much

PILLAR, MARKERS, SEA = "test pillar", "test markers", "test sea"
"""A pillar that is red above the water and green below; a red thing in the air and a green one under water; a bed
without an end."""
RED, GREEN, BLUE, GREY = (0.8, 0.0, 0.0), (0.0, 0.8, 0.0), [0.0, 0.0, 0.8], (0.3, 0.3, 0.3)
LIT: dict[str, Any] = {"sun": None, "ambient": [1.0, 1.0, 1.0], "sky": {"model": "constant", "color": BLUE}}
"""The light in which each thing shows its colour as it is."""
HEIGHTS = (-0.7, LEVEL, 1.1)
"""Metres: levels of the water for which there is a world built upside down below it."""


def moved(parts: tuple[SceneObject, ...], x: float, z: float) -> tuple[SceneObject, ...]:
    """The same things elsewhere."""
    shift = np.eye(4)
    shift[:3, 3] = x, 0.0, z
    return tuple(replace(part, mesh=part.mesh.transformed(shift)) for part in parts)


def copy_at(level: float) -> str:
    """The name of the world that is built upside down below this level."""
    return f"test copy at {level}"


def elsewhere(shift: float) -> str:
    """The name of the world that lies so many metres farther in x and z."""
    return f"test moved by {shift}"


SHIFT = 800.0
"""Metres: a whole number of every tile."""


@contextmanager
def telling_worlds() -> Iterator[None]:
    """These worlds stand in the catalogue for a while."""
    bed = SceneObject("bed", box([-20, LEVEL - 2.2, -20], [20, LEVEL - 2.0, 20], GREY), MATTE)
    scenes = {
        PILLAR: (
            bed,
            SceneObject("above", box([-0.8, LEVEL, -0.8], [0.8, LEVEL + 3.0, 0.8], RED), MATTE),
            SceneObject("below", box([-0.8, LEVEL - 2.0, -0.8], [0.8, LEVEL, 0.8], GREEN), MATTE),
        ),
        MARKERS: (
            SceneObject("gull", box([-1.5, LEVEL + 1.2, -1.5], [0.5, LEVEL + 2.0, 0.5], RED), MATTE),
            SceneObject("stone", box([0.5, LEVEL - 2.0, 0.5], [2.5, LEVEL - 0.8, 2.5], GREEN), MATTE),
        ),
        SEA: (SceneObject("bed", box([-3e4, LEVEL - 2.0, -3e4], [3e4, LEVEL - 1.0, 3e4], GREY), MATTE),),
        elsewhere(SHIFT): moved(objects(sway=0.0), SHIFT, SHIFT),
        **{copy_at(level): mirrored_copies(level) for level in HEIGHTS},
    }
    SCENES.update({name: entry_of(name, parts) for name, parts in scenes.items()})
    try:
        yield
    finally:
        for name in scenes:
            del SCENES[name]
