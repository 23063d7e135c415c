"""The planting of the pond: what grows where, as scene objects ready to be drawn.

    planting(seed, height, density=None) -> tuple[SceneObject, ...]

Drawn by hand for the default camera (on the headland at (9, 9), looking to the far bank): reed beds in
the bays, lilies clear of the middle so that the reflection stays whole, trees in groups with a gap for
the hills. Objects are ordered from the pond outwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from renderer.scene import leaves, lilies, plants, scatter, trees
from renderer.scene.blades import Array
from renderer.scene.material import Material
from renderer.scene.mesh import Mesh
from renderer.scene.scatter import Field
from renderer.scene.scene import SceneObject
from renderer.scene.species import Kind

REED_BEDS = (
    (-10.0, -9.8, 2.3, 100),
    (-16.0, -3.6, 1.9, 80),
    (-14.6, 5.6, 1.9, 60),
    (7.0, -10.3, 1.9, 60),
    (14.6, -3.6, 1.8, 50),
)
"""(x, z, radius, culms): they grow where the water is shallow enough."""
CATTAIL_BEDS = (
    (-17.0, 1.6, 1.4, 18),
    (-5.6, -14.0, 1.4, 16),
    (1.9, 6.3, 0.9, 14),
    (12.9, -7.0, 1.2, 14),
    (-2.6, 10.9, 1.2, 14),
)
LILIES = ((2.0, 2.6, 1.5, 30), (-8.8, -6.4, 2.2, 40), (11.2, -3.0, 1.6, 24), (-12.0, 2.6, 1.9, 28))
"""(x, z, spread, pads)."""
HEROES: Sequence[tuple[Kind, float, float, float]] = (
    ("willow", -21.0, -6.6, 7.6),
    ("birch", -22.6, 2.4, 9.4), ("birch", -24.4, 0.6, 8.2), ("birch", -21.6, 5.6, 8.8),
    ("oak", -14.2, -19.4, 9.0), ("alder", -10.4, -20.4, 8.6), ("alder", -18.6, -17.2, 7.6),
    ("pine", 3.6, -20.6, 8.4), ("pine", 6.4, -23.0, 7.6), ("spruce", -2.0, -25.6, 10.5), ("spruce", 0.6, -27.4, 8.6),
    ("willow", 19.4, -5.6, 7.0), ("birch", 25.0, 5.4, 9.2), ("alder", 24.6, 9.6, 8.6),
    ("oak", -9.6, 21.6, 8.6), ("alder", -14.4, 18.8, 8.2), ("pine", 13.0, 21.4, 10.0),
)  # fmt: skip
"""(kind, x, z, height) of the trees that make the picture."""
WILD = ("far_oak", "far_alder", "far_birch", "far_alder", "far_oak", "far_spruce", "far_birch", "far_pine")
"""What the trees between and behind them are."""
BELTS = ((30, 52.0, 62.0, True), (14, 68.0, 84.0, False))
"""Rows of far woods: count, inner and outer radius, whether the reflection shows them."""
BLADES_SEEN = 15.0
"""Metres from the eye within which single blades are drawn; farther off their coarser tufts do."""
VISTAS = ((207.0, 9.0), (285.0, 8.0), (60.0, 12.0), (150.0, 9.0))
"""Bearings (from +x towards +z) and half widths, degrees, where no further tree stands."""


def planting(seed: int, height: Field, density: Field | None = None) -> tuple[SceneObject, ...]:
    """Everything that grows, on the ground ``height(x, z)``; ``density`` (0..1) thins grass and flowers."""
    shore = scatter.shoreline(height)
    return (
        *_water_plants(seed, height),
        *_bank_plants(seed, height, shore, density),
        *_woods(seed, height),
    )


def _water_plants(seed: int, height: Field) -> list[SceneObject]:
    objects = []
    for k, (x, z, spread, count) in enumerate(LILIES):
        places = lilies.float_pads(seed + k, (x, z), spread, count)
        places = places[np.asarray(height(places[:, 0], places[:, 2])) < -0.12]
        meshes = [lilies.floating_pads(seed + k, places, detail=detail) for detail in ("full", "map")]
        objects.append(_object(f"lilies-{k}", meshes, leaves.BLADES, "lily", in_maps=False))
        meshes = [lilies.blossoms(seed + k, places, detail=detail) for detail in ("full", "map")]
        objects.append(_object(f"lilies-blossoms-{k}", meshes, leaves.BLADES, "lily"))
    for k, (x, z, radius, count) in enumerate(REED_BEDS):
        places = scatter.clump(seed + k, height, (x, z), radius, count, between=(-0.5, 0.06))
        meshes = [plants.reeds(seed + k, places, detail=detail) for detail in ("full", "map")]
        objects.append(_object(f"reeds-{k}", meshes, leaves.BLADES, "reeds"))
    for k, (x, z, radius, count) in enumerate(CATTAIL_BEDS):
        places = scatter.clump(seed + 20 + k, height, (x, z), radius, count, between=(-0.45, 0.1))
        meshes = [plants.cattails(seed + k, places, detail=detail) for detail in ("full", "map")]
        objects.append(_object(f"cattails-{k}", meshes, leaves.BLADES, "reeds"))
    return objects


def _bank_plants(seed: int, height: Field, shore: Array, density: Field | None) -> list[SceneObject]:
    tussocks = scatter.bank(seed + 1, height, shore, 110, falloff=0.25, between=(-0.08, 0.3), density=density)
    tufts = scatter.bank(seed + 2, height, shore, 1050, falloff=1.4, between=(0.1, 3.0), density=density)
    tall = scatter.bank(seed + 4, height, shore, 260, falloff=7.0, between=(0.3, 4.0), density=density)
    flags = scatter.bank(seed + 3, height, shore, 40, falloff=0.15, between=(-0.12, 0.15), density=density)
    objects = []
    for k, part in enumerate(scatter.sectors(tussocks, 6)):
        meshes = [plants.sedge(seed + k, tussocks[part], detail=detail) for detail in ("full", "map")]
        objects.append(_object(f"sedge-{k}", meshes, leaves.BLADES, "grass"))
    for k, part in enumerate(scatter.sectors(flags, 4)):
        meshes = [plants.irises(seed + k, flags[part], detail=detail) for detail in ("full", "map")]
        objects.append(_object(f"irises-{k}", meshes, leaves.BLADES, "flower"))
    for k, part in enumerate(scatter.sectors(tufts, 12)):
        meshes = [plants.grass(seed + k, tufts[part], detail=detail) for detail in ("full", "map")]
        objects.append(_object(f"grass-{k}", meshes, leaves.BLADES, "grass", casts_shadow=False))
    for k, part in enumerate(scatter.sectors(tall, 8)):
        mesh = plants.grass(seed + 20 + k, tall[part], height=0.5, detail="map")
        objects.append(
            _object(f"grass-tall-{k}", [mesh, mesh], leaves.BLADES, "grass", casts_shadow=False, in_maps=False)
        )
    for k, hue in enumerate(plants.HEADS):
        places = scatter.bank(seed + 5 + k, height, shore, 70, falloff=2.6, between=(0.2, 3.0), density=density)
        mesh = plants.flowers(seed + k, places, hue=hue)
        objects.append(
            _object(f"flowers-{hue}", [mesh, mesh], leaves.BLADES, "flower", casts_shadow=False, in_maps=False)
        )
    bushes = scatter.ring(seed + 9, height, 26, inner=19.0, outer=27.0, gaps=VISTAS, apart=2.2)
    for k, part in enumerate(scatter.sectors(bushes, 6)):
        meshes = [trees.shrubs(seed + k, bushes[part], detail=detail) for detail in ("full", "map")]
        objects.append(_object(f"shrubs-{k}", meshes, leaves.LEAVES, "shrub"))
    return objects


def _woods(seed: int, height: Field) -> list[SceneObject]:
    spots = np.array([[x, z] for _, x, z, _ in HEROES])
    places = np.stack([spots[:, 0], height(spots[:, 0], spots[:, 1]), spots[:, 1]], axis=1)
    kinds, heights = [kind for kind, *_ in HEROES], np.array([tall for *_, tall in HEROES])
    objects = []
    for k, part in enumerate(scatter.sectors(places, 8)):
        wood = trees.forest(seed + k, places[part], [kinds[i] for i in part], heights[part])
        objects.append(_object(f"trees-{k}", [wood.leaves, wood.leaves_far], leaves.LEAVES, "tree"))
        objects.append(_object(f"trunks-{k}", [wood.trunk, wood.trunk_far], leaves.BARK, "tree"))
    wild = scatter.ring(seed + 10, height, 26, inner=28.0, outer=46.0, gaps=VISTAS, taken=spots, apart=5.0)
    names = np.array(WILD)[np.arange(len(wild)) % len(WILD)]
    tall = np.asarray(7.0 + 2.8 * (np.arange(len(wild)) * 0.618 % 1), np.float64)
    for k, part in enumerate(scatter.sectors(wild, 8)):
        mesh = trees.far_trees(seed + k, wild[part], names[part].tolist(), tall[part])
        objects.append(_object(f"wild-{k}", [mesh, mesh], leaves.LEAVES, "tree", casts_shadow=False))
    casters = trees.far_casters(seed, wild, names.tolist(), tall)
    objects.append(_object("wild-shadows", [_buried(wild[0]), casters], leaves.LEAVES, "tree", in_maps=False))
    for number, (count, inner, outer, is_mirrored) in enumerate(BELTS):
        far = scatter.ring(seed + 11 + number, height, count, inner=inner, outer=outer, apart=8.0)
        for k, part in enumerate(scatter.sectors(far, 8)):
            mesh = trees.belt(seed + k, far[part])
            objects.append(
                _object(
                    f"belt-{number}-{k}", [mesh, mesh], leaves.LEAVES, "tree", casts_shadow=False, in_maps=is_mirrored
                )
            )
    return objects


def _buried(place: Array) -> Mesh:
    """One small triangle under the ground: the mesh of what only the sun sees."""
    corners = place - np.array([[0.0, 2.0, 0.0], [0.0, 2.0, 0.01], [0.01, 2.0, 0.0]])
    return Mesh.build(corners, np.array([[0, 1, 2]]))


def _object(
    name: str, meshes: Sequence[Mesh], material: Material, tag: str, *, casts_shadow: bool = True, in_maps: bool = True
) -> SceneObject:
    return SceneObject(
        name,
        meshes[0],
        material,
        frozenset({"plant", tag}),
        casts_shadow,
        map_mesh=meshes[1],
        in_maps=in_maps,
        detail_distance=BLADES_SEEN if material == leaves.BLADES and in_maps else math.inf,
    )
