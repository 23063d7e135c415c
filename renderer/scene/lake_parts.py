"""What the lake is built of: ground, boulders, woods and mountains.

The default camera stands near the origin, where the ground's grid is finest; boulders and the trees
round it are placed by hand, everything else is scattered from the seed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene import ground, lake_peaks, lake_woods, leaves, rocks, terrain, textures
from renderer.scene.lake_shore import shape_lake
from renderer.scene.material import Material, Texture
from renderer.scene.mesh import Mesh
from renderer.scene.noise import Floats, resolved_fbm, scattered, smoothstep
from renderer.scene.scene import Scene, SceneObject
from renderer.scene.shore import Shore

AXIS = terrain.Axis(1025, reach=600.0, core=12.0)
TERRAIN_TRIANGLES, MAP_TRIANGLES = 42_000, 7_000
TILES = 8
COLOR_TEXELS, DETAIL_TEXELS = 2048, 512
BED = ground.Bed(bare=(1.2, 4.5), algae=0.3, silt=(2.5, 8.0), absorption=(0.30, 0.125, 0.115))
FLOOR = ground.Floor(gloom=0.62, litter=0.0)

GROUND = Material("ground", "terrain", albedo_map="ground", detail_map="ground_detail", detail_tile=3.9)
ROCK = Material("rock", "surface", detail_map="rock_detail", detail_tile=rocks.TILE)
PEAKS = Material("peaks", "surface", albedo_map="peaks")

BOULDERS = (
    rocks.Stone(-2.9, -2.9, (0.95, 0.62, 0.74), 20.0, 0.42),
    rocks.Stone(-4.3, -3.6, (0.52, 0.36, 0.42), 75.0, 0.38),
    rocks.Stone(-1.8, -3.7, (0.38, 0.24, 0.30), 130.0, 0.30),
    rocks.Stone(4.9, -5.6, (1.25, 0.90, 1.00), 60.0, 0.38),
    rocks.Stone(6.9, -6.1, (0.72, 0.50, 0.58), 10.0, 0.36),
    rocks.Stone(4.0, -7.3, (0.50, 0.42, 0.44), 140.0, top=0.17),
    rocks.Stone(-7.5, -6.5, (1.20, 1.10, 0.95), 35.0, top=0.42),
    rocks.Stone(-9.4, -7.4, (0.70, 0.90, 0.62), 95.0, top=0.16),
    rocks.Stone(11.5, -14.5, (1.30, 1.00, 1.05), 50.0, 0.40),
    rocks.Stone(13.2, -16.4, (0.70, 0.60, 0.62), 120.0, 0.36),
    rocks.Stone(-16.0, 0.5, (0.90, 0.66, 0.78), 15.0, 0.42),
    rocks.Stone(33.0, -109.5, (2.30, 1.90, 1.80), 70.0, 0.40),
    rocks.Stone(36.5, -106.0, (1.60, 1.30, 1.40), 30.0, 0.40),
    rocks.Stone(41.0, -119.0, (1.90, 1.40, 1.50), 145.0, 0.40),
    rocks.Stone(-19.8, -141.0, (1.90, 1.50, 1.60), 35.0, 0.40),
    rocks.Stone(-31.0, -134.8, (1.70, 1.30, 1.50), 80.0, 0.42),
    rocks.Stone(-47.0, -141.5, (2.20, 1.60, 1.70), 115.0, 0.42),
    rocks.Stone(-39.0, -136.3, (1.10, 0.80, 0.90), 10.0, 0.40),
)
HEROES = (0, 3, 6)
"""Boulders that are seen large."""


@dataclass(frozen=True, eq=False)
class Land:
    """The shaped ground and what stands on it."""

    seed: int
    shore: Shore
    stones: list[rocks.Stone]

    def height(self, x: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float64]:
        """The ground's height in metres at points of any shape."""
        return terrain.sampled(AXIS, self.shore.height, x, z)

    def distance(self, x: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float64]:
        """Signed distance from the waterline in metres, positive on land."""
        return terrain.sampled(AXIS, self.shore.distance, x, z)

    def meadow(self, x: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float64]:
        """How well grass grows, 0 to 1: not on sand or stones."""
        bare = np.maximum(self.shore.sand, self.shore.stones) * (self.shore.distance < 1.3)
        return 1 - terrain.sampled(AXIS, bare.astype(np.float32), x, z)


def build(seed: int) -> Scene:
    """The scene from its seed alone."""
    land = shape_land(seed)
    peaks = lake_peaks.shape_range(seed)
    objects = [
        *lake_woods.planting(seed, land.height, land.distance, land.meadow),
        *rock_objects(land),
        *terrain_objects(land),
        *peak_objects(peaks),
    ]
    images = (
        *draw_textures(land),
        Texture("peaks", lake_peaks.range_colors(peaks, seed), blends_mipmaps=False),
        lake_woods.album().texture,
        leaves.atlas(),
        leaves.bark(),
    )
    return Scene("lake", tuple(objects), {texture.name: texture for texture in images})


def shape_land(seed: int) -> Land:
    """The ground, and the stones scattered on it."""
    shore = shape_lake(AXIS, seed)
    return Land(seed, shore, _scattered_stones(shore, seed))


def terrain_objects(land: Land) -> list[SceneObject]:
    """The ground in tiles, each with its level of detail for the maps.

    It casts no shadow: its own coarse level, which the sun would see, cuts through the fine one.
    """
    height, distance = land.shore.height, land.shore.distance
    away = np.hypot(AXIS.world[None, :], AXIS.world[:, None])
    # Woods hide the ground, water the bed; a shore is seen from everywhere.
    hidden = np.where(height < -0.3, 0.12, np.where(distance > 25, 0.25, 1.0))
    seen = 1 / (0.5 + away / 16) * hidden
    longest = np.clip(0.7 + away / 9, 0.7, 26.0) / AXIS.spacing[:, None]
    vertices = terrain.grid_vertices(AXIS, height, skirt=9.0)
    full, plain = (
        terrain.tiled(
            vertices,
            terrain.fitted(terrain.split_errors(height, seen.astype(np.float32), cap.astype(np.float32)), count),
            *(TILES, AXIS.reach, AXIS.core),
        )
        for cap, count in ((longest, TERRAIN_TRIANGLES), (4 * longest, MAP_TRIANGLES))
    )
    return [
        SceneObject(
            f"ground {number}",
            full[number],
            GROUND,
            frozenset({"terrain"}),
            map_mesh=plain.get(number, full[number]),
            casts_shadow=False,
        )
        for number in full
    ]


def rock_objects(land: Land) -> list[SceneObject]:
    """Boulders and stones in blocks; the small ones apart, because the maps and shadows leave them out."""
    tags = frozenset({"rock"})
    blocks: dict[int, list[tuple[rocks.Stone, int]]] = {}
    for number, stone in enumerate((*BOULDERS, *land.stones)):
        level = 3 if number in HEROES else 2 if number < len(BOULDERS) else 1 if max(stone.size) >= 0.2 else 0
        blocks.setdefault(_block(stone), []).append((stone, level))
    parts = []
    for block, members in sorted(blocks.items()):
        full: list[Mesh] = []
        plain: list[Mesh] = []
        for level in (1, 2, 3):
            here = [stone for stone, its in members if its == level]
            for meshes, detail in ((full, level), (plain, level - 1)):
                meshes.append(rocks.stones(here, land.seed + 211 * level + block, detail, land.height))
        pebbles = rocks.stones([stone for stone, its in members if its == 0], land.seed + 900 + block, 0, land.height)
        parts.append(
            SceneObject(
                f"boulders {block}", Mesh.merge(full), ROCK, tags, map_mesh=Mesh.merge(plain), detail_distance=26.0
            )
        )
        parts.append(SceneObject(f"stones {block}", pebbles, ROCK, tags, casts_shadow=False, in_maps=False))
    return [part for part in parts if len(part.mesh.index)]


def _block(stone: rocks.Stone) -> int:
    return int(stone.x > 0) + 2 * int(np.searchsorted([-220.0, -90.0, -35.0, -12.0], stone.z))


def peak_objects(land: lake_peaks.Range) -> list[SceneObject]:
    """The mountains, by sectors."""
    full, plain = (lake_peaks.range_sheet(land, detail) for detail in ("full", "map"))
    return [
        SceneObject(f"peaks {number}", mesh, PEAKS, frozenset({"hills"}), casts_shadow=False, map_mesh=plain[number])
        for number, mesh in enumerate(full)
    ]


def wooded(land: Land) -> Floats:
    """Where the forest shades the ground, 0 to 1 on the ground's grid."""
    axis = AXIS.coarser(4)
    x, z = np.meshgrid(axis.world, axis.world)
    height, distance = (part[::4, ::4].astype(np.float64) for part in (land.shore.height, land.shore.distance))
    cover = lake_woods.cover(land.seed, x, z, distance, height).astype(np.float32)
    for kind, spot_x, spot_z, tall in lake_woods.HEROES:
        reach = (0.16 if kind == "spruce" else 0.3) * tall
        cover = np.maximum(
            cover, 0.8 * smoothstep(1.3, 0.3, (np.hypot(x - spot_x, z - spot_z) / reach).astype(np.float32))
        )
    return terrain.upsampled(cover.astype(np.float32), AXIS.count).clip(0, 1)


def draw_textures(land: Land) -> list[Texture]:
    """The ground's colours and the tiling details."""
    shades = [ground.Shade(stone.x, stone.z, 1.9 * max(stone.size), 0.55) for stone in (*BOULDERS, *land.stones)]
    normal = terrain.grid_normals(AXIS, land.shore.height)
    rock = smoothstep(0.86, 0.72, normal[..., 1]) * smoothstep(4.0, 14.0, land.shore.distance)
    colors = ground.ground_colors(
        *(AXIS, land.shore, COLOR_TEXELS, land.seed),
        paths=(),
        shades=shades,
        woods=wooded(land),
        bed=BED,
        rock=rock.astype(np.float32),
        is_wide=True,
        floor=FLOOR,
    )
    details: Mapping[str, NDArray[np.uint8]] = {
        "ground_detail": textures.ground_detail(DETAIL_TEXELS, land.seed),
        "rock_detail": textures.rock_detail(DETAIL_TEXELS, land.seed + 1),
    }
    ground_map = Texture("ground", colors, wrap="clamp", blends_mipmaps=False)
    return [ground_map, *(Texture(name, image, blends_mipmaps=False) for name, image in details.items())]


def _scattered_stones(shore: Shore, seed: int) -> list[rocks.Stone]:
    """Stones along the shore and in the shallows: shingle before the camera, boulders all round the lake."""
    x = AXIS.world
    clumps = smoothstep(-0.35, 0.55, resolved_fbm(x, 2.0, seed + 78, octaves=2)).astype(np.float32)
    found = []
    for box, count, (least, spread, rare), thick, band in (
        ((-14.0, 16.0, -16.0, 5.0), 2600, (0.05, 0.06, 0.28), 1.5, (-6.0, 1.7)),
        ((-50.0, 60.0, -60.0, 6.0), 3400, (0.14, 0.12, 0.60), 1.0, (-3.0, 1.8)),
        ((-114.0, 110.0, -328.0, -50.0), 9000, (0.35, 0.30, 1.30), 0.8, (-2.5, 2.2)),
    ):
        table = scattered(seed + 77 + count, count, 9)
        x = box[0] + (box[1] - box[0]) * table[:, 0]
        z = box[2] + (box[3] - box[2]) * table[:, 1]
        distance, sand, stony, clump = (
            terrain.sampled(AXIS, part, x, z) for part in (shore.distance, shore.sand, shore.stones, clumps)
        )
        share = (0.75 * stony + 0.25 * sand + 0.05) * clump * thick
        share *= np.clip((distance - band[0]) / 2, 0, 1) * np.clip((band[1] - distance) / 0.9, 0, 1)
        size = least + spread * table[:, 4] + rare * table[:, 3] ** 5
        found += [
            rocks.Stone(
                float(x[at]),
                float(z[at]),
                (float(size[at]), *(size[at] * (0.55 + 0.3 * table[at, 5:7])).tolist()),
                float(360 * table[at, 7]),
                float(0.25 + 0.25 * table[at, 8]),
            )
            for at in np.flatnonzero(table[:, 2] < share)
        ]
    return found
