"""What the pond is built of: ground, boulders, jetty, plants and hills.

Boulders, jetty and paths are placed by hand for the default camera, which looks north-west from the
headland at (9, 9); everything else is scattered from the seed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene import ground, hills, jetty, leaves, planting, rocks, terrain, textures
from renderer.scene.material import Material, Texture
from renderer.scene.mesh import Mesh
from renderer.scene.noise import Floats, grid_fbm, scattered, smoothstep
from renderer.scene.scene import Scene, SceneObject
from renderer.scene.shore import Shore, shape_shore

AXIS = terrain.Axis(1025)
TERRAIN_TRIANGLES, MAP_TRIANGLES = 61_000, 8_000
PATH_AXIS = AXIS.texels(1024)
TILES = 8
COLOR_TEXELS, DETAIL_TEXELS = 2048, 512

GROUND = Material("ground", "terrain", albedo_map="ground", detail_map="ground_detail", detail_tile=2.3)
ROCK = Material("rock", "surface", detail_map="rock_detail", detail_tile=rocks.TILE)
WOOD = Material("wood", "surface", detail_map="wood_detail", detail_tile=jetty.TILE)
HILLS = Material("hills", "surface", detail_map="canopy_detail", detail_tile=hills.TILE)
MOUNTAINS = Material("mountains", "surface")

JETTY = jetty.Jetty(foot=(12.7, -9.5), head=(2.6, -4.3))

PATHS = (
    ((12.7, -9.5), (15.5, -11.6), (19.0, -12.6), (24.0, -11.5), (31.0, -13.5), (42.0, -10.0), (60.0, -14.0)),
    ((6.0, 5.6), (7.8, 7.4), (10.5, 9.6), (14.5, 10.6), (19.0, 8.2), (22.5, 2.5), (22.8, -4.5), (19.0, -12.6)),
)
"""Trodden paths, (x, z) metres: to the jetty, and on to the beach on the headland."""

BOULDERS = (
    rocks.Stone(0.35, 6.6, (1.00, 0.78, 0.84), 25.0, 0.40),
    rocks.Stone(3.05, 5.55, (0.42, 0.30, 0.36), 80.0, 0.40),
    rocks.Stone(-0.75, 8.1, (0.62, 0.46, 0.55), 140.0, 0.38),
    rocks.Stone(1.15, 5.75, (0.34, 0.26, 0.30), 10.0, 0.35),
    rocks.Stone(7.7, 2.9, (0.50, 0.34, 0.42), 60.0, 0.30),
    rocks.Stone(8.35, 3.5, (0.30, 0.22, 0.24), 20.0, 0.30),
    rocks.Stone(-6.6, 3.6, (1.40, 1.45, 1.10), 70.0, top=0.62),
    rocks.Stone(-8.2, 4.3, (0.85, 1.10, 0.80), 15.0, top=0.34),
    rocks.Stone(-5.0, 2.6, (0.80, 1.00, 0.70), 110.0, top=0.16),
    rocks.Stone(-15.6, 5.2, (1.05, 0.80, 0.90), 35.0, 0.40),
    rocks.Stone(-16.6, 4.1, (0.65, 0.55, 0.60), 95.0, 0.35),
    rocks.Stone(-14.1, 6.0, (0.55, 0.42, 0.50), 155.0, 0.35),
    rocks.Stone(-11.6, -8.0, (1.15, 0.85, 0.95), 50.0, 0.42),
    rocks.Stone(-10.6, -9.4, (0.70, 0.60, 0.62), 120.0, 0.36),
    rocks.Stone(-12.9, -6.9, (0.60, 0.45, 0.50), 0.0, 0.36),
    rocks.Stone(14.5, 2.2, (0.95, 0.70, 0.80), 75.0, 0.40),
    rocks.Stone(13.4, 3.2, (0.50, 0.40, 0.44), 30.0, 0.36),
    rocks.Stone(15.2, 0.6, (0.58, 0.45, 0.50), 145.0, 0.36),
    rocks.Stone(4.2, -11.2, (0.60, 0.45, 0.52), 200.0, 0.40),
    rocks.Stone(11.0, -10.4, (0.50, 0.38, 0.42), 230.0, 0.40),
    rocks.Stone(-1.8, -14.0, (0.85, 0.62, 0.70), 17.0, 0.42),
    rocks.Stone(18.2, 12.4, (1.10, 0.90, 0.95), 40.0, 0.45),
    rocks.Stone(-18.4, -4.4, (1.10, 0.80, 0.95), 80.0, 0.42),
)
HEROES, NEAR = (0, 6), (1, 2, 4)
"""Boulders that are seen large, and others that stand close before the default camera."""
ROCK_CELL, ROCKS_SEEN = 10.0, 13.0
"""Metres: the side of the cells by which rocks are drawn, and the distance beyond which their coarser shapes are."""


@dataclass(frozen=True, eq=False)
class Land:
    """The shaped ground and what stands on it."""

    seed: int
    shore: Shore
    path: Floats
    """How trodden the ground is, 0 to 1."""
    stones: list[rocks.Stone]

    def height(self, x: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float64]:
        """The ground's height in metres at points of any shape."""
        return terrain.sampled(AXIS, self.shore.height, x, z)

    def distance(self, x: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float64]:
        """Signed distance from the waterline in metres, positive on land."""
        return terrain.sampled(AXIS, self.shore.distance, x, z)

    def meadow(self, x: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float64]:
        """How well grass grows, 0 to 1: not on sand, on stones or on a path."""
        bare = np.maximum(self.shore.sand, self.shore.stones) * (self.shore.distance < 1.2)
        return 1 - np.maximum(terrain.sampled(AXIS, bare, x, z), terrain.sampled(PATH_AXIS, self.path, x, z))


def build(seed: int) -> Scene:
    """The scene from its seed alone."""
    land = shape_land(seed)
    plants = planting.planting(seed, land.height, land.meadow)
    objects = [*plants, *rock_objects(land), *jetty_objects(land), *terrain_objects(land), *hill_objects(seed)]
    images = (*draw_textures(land, canopy_cover(plants)), leaves.atlas(), leaves.bark())
    return Scene("pond", tuple(objects), {texture.name: texture for texture in images})


def shape_land(seed: int) -> Land:
    """The ground, and the stones scattered on it."""
    coarse = AXIS.coarser(8)
    x, z = np.meshgrid(coarse.world, coarse.world)
    far = terrain.upsampled(hills.far_height(x, z, seed).astype(np.float32), AXIS.count)
    shore = shape_shore(AXIS, far, seed)
    return Land(seed, shore, ground.path_share(PATH_AXIS, PATHS), _scattered_stones(shore, seed))


def terrain_objects(land: Land) -> list[SceneObject]:
    """The ground in tiles, each with its level of detail for the maps."""
    height = land.shore.height
    world = AXIS.world
    away = np.hypot(world[None, :], world[:, None])
    seen = 1 / (0.5 + away / 16) * np.where(height < -0.12, 0.08, 1.0)
    longest = np.clip(0.7 + away / 14, 0.7, 9.0) / AXIS.spacing[:, None]
    vertices = terrain.grid_vertices(AXIS, height)
    full, plain = (
        _tiles(vertices, terrain.split_errors(height, seen.astype(np.float32), cap.astype(np.float32)), count)
        for cap, count in ((longest, TERRAIN_TRIANGLES), (4 * longest, MAP_TRIANGLES))
    )
    return [
        SceneObject(f"ground {number}", full[number], GROUND, frozenset({"terrain"}), map_mesh=plain[number])
        for number in full
    ]


def _tiles(vertices: Mesh, error: Floats, triangles: int) -> dict[int, Mesh]:
    return terrain.tiled(vertices, terrain.fitted(error, triangles), TILES, AXIS.reach)


def rock_objects(land: Land) -> list[SceneObject]:
    """Boulders and stones by cells; the small ones apart, because the maps and shadows leave them out."""
    tags = frozenset({"rock"})
    parts = []
    for number, cell in enumerate(sorted({_cell(stone) for stone in (*BOULDERS, *land.stones)})):
        full: list[Mesh] = []
        plain: list[Mesh] = []
        for k, boulder in enumerate(BOULDERS):
            if _cell(boulder) != cell:
                continue
            level = 3 if k in HEROES else 2 if k in NEAR or max(boulder.size) > 0.6 else 1
            for meshes, detail in ((full, level), (plain, level - 1)):
                meshes.append(rocks.stones([boulder], land.seed + 211 * k, detail, land.height))
        here = [stone for stone in land.stones if _cell(stone) == cell]
        large = [stone for stone in here if max(stone.size) >= 0.2]
        small = [stone for stone in here if max(stone.size) < 0.2]
        if large:
            full.append(rocks.stones(large, land.seed + 5000 + number, 1, land.height))
            plain.append(rocks.stones(large, land.seed + 5000 + number, 0, land.height))
        if full:
            fine, coarse = Mesh.merge(full), Mesh.merge(plain)
            name = f"boulders {number}"
            parts.append(SceneObject(name, fine, ROCK, tags, map_mesh=coarse, detail_distance=ROCKS_SEEN))
        if small:
            pebbles = rocks.stones(small, land.seed + 6000 + number, 0, land.height)
            parts.append(SceneObject(f"stones {number}", pebbles, ROCK, tags, casts_shadow=False, in_maps=False))
    return parts


def _cell(stone: rocks.Stone) -> tuple[int, int]:
    return math.floor(stone.x / ROCK_CELL), math.floor(stone.z / ROCK_CELL)


def jetty_objects(land: Land) -> list[SceneObject]:
    """The jetty."""
    full, plain = jetty.timber(JETTY, land.height), jetty.plain(JETTY, land.height)
    return [SceneObject("jetty", full, WOOD, frozenset({"jetty"}), map_mesh=plain)]


def hill_objects(seed: int) -> list[SceneObject]:
    """The country round, by sectors; beyond the near woods the air hides all texture."""
    tags = frozenset({"hills"})
    parts = []
    for name, rows, material, columns in (
        ("woods", hills.NEAR_ROWS, HILLS, 480),
        ("mountains", hills.FAR_ROWS, MOUNTAINS, 360),
    ):
        full, plain = (hills.hill_sheet(seed, rows, count, 12) for count in (columns, 180))
        parts += [
            SceneObject(f"{name} {number}", mesh, material, tags, casts_shadow=False, map_mesh=plain[number])
            for number, mesh in enumerate(full)
        ]
    return parts


def canopy_cover(plants: Iterable[SceneObject]) -> Floats:
    """Where leaves hang over the ground, 0 to 1 on the ground's grid."""
    axis = AXIS.coarser(4)
    leaves_at = [part.mesh.position for part in plants if "tree" in part.tags]
    place = np.concatenate([position[:, [2, 0]] for position in leaves_at])
    cell = np.rint((axis.parameter(place) + 1) / 2 * (axis.count - 1)).astype(np.int64)
    cell = cell[(np.abs(place) < AXIS.reach).all(axis=1)]
    count = np.bincount(cell[:, 0] * axis.count + cell[:, 1], minlength=axis.count**2).astype(np.float32)
    cover = count.reshape(axis.count, axis.count) / (axis.spacing[:, None] * axis.spacing[None, :])
    for _ in range(9):
        for way in (0, 1):
            cover = (2 * cover + np.roll(cover, 1, way) + np.roll(cover, -1, way)) / 4
    return terrain.upsampled(np.clip(cover / 12, 0, 1).astype(np.float32), AXIS.count)


def draw_textures(land: Land, woods: Floats) -> list[Texture]:
    """The ground's colours and the tiling details."""
    shades = [ground.Shade(stone.x, stone.z, 1.9 * max(stone.size), 0.55) for stone in (*BOULDERS, *land.stones)]
    middle = np.linspace(0.5, JETTY.length - 0.4, 12)
    shades += [ground.Shade(x, z, 1.5, 0.28) for x, z in JETTY.places(middle, 0 * middle)]
    colors = ground.ground_colors(AXIS, land.shore, COLOR_TEXELS, land.seed, paths=PATHS, shades=shades, woods=woods)
    details: Mapping[str, NDArray[np.uint8]] = {
        "ground_detail": textures.ground_detail(DETAIL_TEXELS, land.seed),
        "rock_detail": textures.rock_detail(DETAIL_TEXELS, land.seed + 1),
        "wood_detail": textures.wood_detail(DETAIL_TEXELS, land.seed + 2),
        "canopy_detail": textures.canopy_detail(DETAIL_TEXELS, land.seed + 3),
    }
    ground_map = Texture("ground", colors, wrap="clamp", blends_mipmaps=False)
    return [ground_map, *(Texture(name, image, blends_mipmaps=False) for name, image in details.items())]


def _scattered_stones(shore: Shore, seed: int) -> list[rocks.Stone]:
    """Stones along the shore and in the shallows, more where it is stony, and shingle before the camera."""
    x, z = AXIS.world, AXIS.world
    clumps = smoothstep(-0.35, 0.55, grid_fbm(x, z, 1.5, seed + 78, octaves=2)).astype(np.float32)
    found = []
    for box, count, (least, spread, rare), thick in (
        ((-19.0, 18.0, -16.5, 13.5), 1800, (0.05, 0.06, 0.24), 1.0),
        ((-1.5, 10.5, 3.2, 9.0), 1000, (0.03, 0.04, 0.05), 2.2),
    ):
        table = scattered(seed + 77 + count, count, 9)
        x = box[0] + (box[1] - box[0]) * table[:, 0]
        z = box[2] + (box[3] - box[2]) * table[:, 1]
        distance, sand, stony, clump = (
            terrain.sampled(AXIS, part, x, z) for part in (shore.distance, shore.sand, shore.stones, clumps)
        )
        share = np.maximum(0.8 * stony, 0.30 * sand) + 0.04 + 0.10 * (distance < -0.3)
        share *= np.clip((distance + 5.0) / 2.5, 0, 1) * np.clip((1.6 - distance) / 0.9, 0, 1) * clump * thick
        size = least + spread * table[:, 4] + rare * table[:, 3] ** 4
        found += [
            rocks.Stone(
                float(x[at]),
                float(z[at]),
                (float(size[at]), *(size[at] * (0.55 + 0.3 * table[at, 5:7])).tolist()),
                float(360 * table[at, 7]),
                float(0.22 + 0.25 * table[at, 8]),
            )
            for at in np.flatnonzero(table[:, 2] < share)
        ]
    return found
