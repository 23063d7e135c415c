"""What the bath's scene is built of: the basin, the wall behind it, the court, and the country round."""

from __future__ import annotations

import numpy as np

from renderer.scene import arcade, basin, court, hills, leaves, masonry, scatter, textures, trees
from renderer.scene.material import Material, Texture
from renderer.scene.scene import Scene, SceneObject

MARBLE_TEXELS, BRICK_TEXELS, PAVING_TEXELS, FLOOR_TEXELS = 2048, 1024, 1024, 1024
COLOR_TEXELS, LAWN_TEXELS, DETAIL_TEXELS = 1024, 512, 512

MARBLE = Material("marble", albedo_map="marble")
INLAY = Material("inlay", albedo_map="inlay")
BRICK = Material("brick", albedo_map="brick")
STONE = Material("stone", detail_map="stone_detail", detail_tile=arcade.STONE_TILE)
PAVING = Material("paving", "terrain", albedo_map="paving", detail_map="paving_detail", detail_tile=masonry.PAVING_TILE)
LAWN = Material("lawn", "terrain", albedo_map="lawn", detail_map="lawn_detail", detail_tile=2.3)
HEDGE = Material("hedge", detail_map="leaf_detail", detail_tile=court.HEDGE_TILE)
YEW = Material("yew", detail_map="leaf_detail", detail_tile=court.YEW_TILE)
HILLS = Material("hills", albedo=(1.05, 0.98, 0.88), detail_map="leaf_detail", detail_tile=hills.TILE)
MOUNTAINS = Material("mountains")

BATH = frozenset({"bath", "refracted"})
WALL = frozenset({"wall", "reflected"})
GROUND = frozenset({"ground"})
SURROUNDINGS = frozenset({"surroundings"})

YEWS = np.array([[x, z] for x in (-15.4, 15.4) for z in (-15.4, -5.2, 5.2, 15.4)])
"""Where the clipped yews stand, (x, z) metres."""
TREES = (64, 32.0, 60.0)
"""Single trees beyond the hedge: how many, and between which distances in metres."""
BELT = (34, 62.0, 78.0)
"""The same of the wood's edge behind them."""
WILD = ("far_oak", "far_alder", "far_birch", "far_oak", "far_pine", "far_alder", "far_spruce")
VISTAS = ((30.0, 11.0), (-42.0, 12.0), (145.0, 12.0), (215.0, 10.0))
"""Bearings from +x towards +z and half widths, degrees, where the view is left open."""


def build(seed: int) -> Scene:
    """The scene from its seed alone."""
    objects = [*bath_objects(seed), *wall_objects(seed), *court_objects(seed), *country_objects(seed)]
    return Scene("bath", tuple(objects), {texture.name: texture for texture in draw_textures(seed)})


def bath_objects(seed: int) -> list[SceneObject]:
    """The marble bath."""
    return [
        SceneObject("bath", basin.bath(seed), MARBLE, BATH),
        SceneObject("bath floor", basin.floor(seed), INLAY, BATH, casts_shadow=False),
    ]


def wall_objects(seed: int) -> list[SceneObject]:
    """The wall and its pillars."""
    return [
        SceneObject("wall", arcade.brickwork(masonry.BRICK_TILE, seed), BRICK, WALL),
        SceneObject("pillars", arcade.dressings(seed), STONE, WALL),
    ]


def court_objects(seed: int) -> list[SceneObject]:
    """The paving, and what is not in the document: hedge, yews and lawn."""
    yews = [court.yews(seed, YEWS, is_plain=is_plain) for is_plain in (False, True)]
    hedges = [court.hedge(seed, is_plain=is_plain) for is_plain in (False, True)]
    return [
        SceneObject("paving", court.paving(), PAVING, GROUND, casts_shadow=False),
        SceneObject("lawn", court.lawn(seed), LAWN, SURROUNDINGS, casts_shadow=False),
        SceneObject("hedge", hedges[0], HEDGE, SURROUNDINGS, map_mesh=hedges[1]),
        SceneObject("yews", yews[0], YEW, SURROUNDINGS, map_mesh=yews[1]),
    ]


def country_objects(seed: int) -> list[SceneObject]:
    """Trees and hills, by sectors."""
    tags = SURROUNDINGS
    objects = []
    count, inner, outer = TREES
    wild = scatter.ring(seed + 10, _lawn_height(seed), count, inner=inner, outer=outer, gaps=VISTAS, apart=5.0)
    names = np.array(WILD)[np.arange(len(wild)) * 3 % len(WILD)]
    tall = np.asarray(8.0 + 4.0 * (np.arange(len(wild)) * 0.618 % 1), np.float64)
    for number, part in enumerate(scatter.sectors(wild, 8)):
        mesh = trees.far_trees(seed + number, wild[part], names[part].tolist(), tall[part])
        objects.append(SceneObject(f"trees {number}", mesh, leaves.LEAVES, tags, casts_shadow=False))
    count, inner, outer = BELT
    far = scatter.ring(seed + 11, _lawn_height(seed), count, inner=inner, outer=outer, apart=8.0)
    for number, part in enumerate(scatter.sectors(far, 8)):
        mesh = trees.belt(seed + number, far[part], height=11.0)
        objects.append(SceneObject(f"belt {number}", mesh, leaves.LEAVES, tags, casts_shadow=False))
    down = np.eye(4)
    down[1, 3] = -court.HILLS_DROP
    for name, rows, material, columns in (
        ("woods", hills.NEAR_ROWS, HILLS, 360),
        ("mountains", hills.FAR_ROWS, MOUNTAINS, 240),
    ):
        full, plain = (hills.hill_sheet(seed, rows, wide, 12) for wide in (columns, 120))
        objects += [
            SceneObject(
                f"{name} {number}",
                mesh.transformed(down),
                material,
                tags,
                casts_shadow=False,
                map_mesh=plain[number].transformed(down),
            )
            for number, mesh in enumerate(full)
        ]
    return objects


def draw_textures(seed: int) -> list[Texture]:
    """Every texture of the scene."""
    images = {
        "marble": masonry.marble(MARBLE_TEXELS, seed),
        "brick": masonry.brickwork(BRICK_TEXELS, seed + 1),
        "stone_detail": masonry.limestone_detail(DETAIL_TEXELS, seed + 2),
        "paving_detail": masonry.paving_detail(PAVING_TEXELS, seed),
        "lawn_detail": textures.ground_detail(DETAIL_TEXELS, seed + 3),
        "leaf_detail": textures.canopy_detail(DETAIL_TEXELS, seed + 4),
    }
    once = {
        "inlay": masonry.inlay(FLOOR_TEXELS, seed + 5),
        "paving": court.paving_colors(COLOR_TEXELS, seed),
        "lawn": court.lawn_colors(LAWN_TEXELS, seed),
    }
    built = [Texture(name, image, blends_mipmaps=False) for name, image in images.items()]
    built += [Texture(name, image, wrap="clamp", blends_mipmaps=False) for name, image in once.items()]
    return [*built, leaves.atlas()]


def _lawn_height(seed: int) -> scatter.Field:
    return lambda x, z: court.lawn_height(x, z, seed)
