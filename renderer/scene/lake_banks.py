"""What grows at the lake's edge: reeds in the bays, sedge, grass and flowers on the banks, bushes behind them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from renderer.scene import leaves, plants, scatter, trees
from renderer.scene.lake_shore import RING
from renderer.scene.material import Material
from renderer.scene.mesh import Mesh
from renderer.scene.scatter import Field
from renderer.scene.scene import SceneObject

REEDS = ((27.5, -22.0, 5.0, 240), (36.0, -22.0, 4.0, 140), (11.6, -15.6, 1.8, 60), (-52.0, -23.0, 5.0, 150))
"""(x, z, radius, culms)."""
TONE = np.array([0.80, 0.84, 0.86, 1.0], np.float32)
"""Factor on the grass's colour, so that it does not stand out from the turf."""


def banks(seed: int, height: Field, meadow: Field) -> Iterator[SceneObject]:
    """Reeds in the bays, and what grows on the banks near the default camera."""
    for k, (x, z, radius, count) in enumerate(REEDS):
        places = scatter.clump(seed + k, height, (x, z), radius, count, between=(-0.55, 0.06))
        meshes = [plants.reeds(seed + k, places, detail=detail) for detail in ("full", "map")]
        yield plant_object(f"reeds {k}", meshes, leaves.BLADES, "reeds", seen=18.0)
    shore = scatter.shoreline(height, reach=60.0, step=0.4)
    near = shore[np.hypot(shore[:, 0], shore[:, 1]) < 34.0]
    tussocks = scatter.bank(seed + 1, height, near, 120, falloff=0.5, between=(-0.05, 0.5), density=meadow)
    tufts = scatter.bank(seed + 2, height, near, 1100, falloff=2.2, between=(0.12, 3.0), density=meadow)
    lawn = shore[np.hypot(shore[:, 0] - 2, shore[:, 1]) < 9.0]
    turf = scatter.bank(seed + 4, height, lawn, 2300, falloff=4.5, between=(0.15, 3.0), density=meadow)
    for k, part in enumerate(scatter.sectors(tussocks, 6)):
        meshes = [plants.sedge(seed + k, tussocks[part], detail=detail) for detail in ("full", "map")]
        yield plant_object(f"sedge {k}", meshes, leaves.BLADES, "grass", seen=17.0)
    for k, part in enumerate(scatter.sectors(tufts, 12)):
        meshes = [_toned(plants.grass(seed + k, tufts[part], height=0.24, detail=detail)) for detail in ("full", "map")]
        yield plant_object(f"grass {k}", meshes, leaves.BLADES, "grass", seen=17.0, casts_shadow=False)
    is_close = np.hypot(turf[:, 0] - 2.0, turf[:, 2] - 3.0) < 5.5
    close = _toned(plants.grass(seed + 20, turf[is_close], height=0.17))
    farther = _toned(plants.grass(seed + 21, turf[~is_close], height=0.13, detail="map"))
    for name, mesh in (("close", close), ("farther", farther)):
        yield plant_object(f"turf {name}", (mesh, mesh), leaves.BLADES, "grass", casts_shadow=False, in_maps=False)
    for k, hue in enumerate(plants.HEADS):
        places = scatter.bank(seed + 5 + k, height, near, 60, falloff=3.0, between=(0.3, 3.0), density=meadow)
        mesh = plants.flowers(seed + k, places, hue=hue)
        yield plant_object(f"flowers {hue}", (mesh, mesh), leaves.BLADES, "flower", casts_shadow=False, in_maps=False)
    bushes = scatter.bank(seed + 9, height, shore, 70, falloff=5.0, between=(0.5, 4.0), density=meadow)
    off = np.hypot(bushes[:, 0] - RING[0], bushes[:, 2] - RING[1])
    bushes = bushes[(np.hypot(bushes[:, 0], bushes[:, 2] - 3) > 13) & ((off < RING[2]) | (off > RING[3]))]
    for k, part in enumerate(scatter.sectors(bushes, 8)):
        full, plain = (trees.shrubs(seed + k, bushes[part], detail=detail) for detail in ("full", "map"))
        yield plant_object(f"shrubs {k}", (full, plain), leaves.LEAVES, "shrub", seen=30.0)


def _toned(mesh: Mesh) -> Mesh:
    return replace(mesh, color=mesh.color * TONE)


def plant_object(
    name: str,
    meshes: Sequence[Mesh],
    material: Material,
    tag: str,
    *,
    seen: float = math.inf,
    casts_shadow: bool = True,
    in_maps: bool = True,
) -> SceneObject:
    """A plant's object: its full and its plain mesh, and the metres within which the full one is seen."""
    return SceneObject(
        name,
        meshes[0],
        material,
        frozenset({"plant", tag}),
        casts_shadow,
        map_mesh=meshes[1],
        in_maps=in_maps,
        detail_distance=seen,
    )
