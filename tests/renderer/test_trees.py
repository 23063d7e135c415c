"""Trees: soft crowns on tight cards, sorted for the early depth test, and an atlas without dark fringes."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene import leaves, trees
from renderer.scene.crowns import grow
from renderer.scene.mesh import Mesh
from renderer.scene.species import SPECIES, Kind

KINDS: tuple[Kind, ...] = get_args(Kind)
WOODY = tuple(kind for kind in KINDS if kind != "shrub")
Texels = NDArray[np.float64]


def centres(mesh: Mesh) -> NDArray[np.float32]:
    return np.asarray(mesh.position.reshape(-1, 8, 3).mean(axis=1))


def cell(name: str) -> Texels:
    """A cell of the atlas, 0..1."""
    (left, bottom), (right, top) = leaves.at(name, np.array([[0.0, 0.0], [1.0, 1.0]]))
    image = leaves.atlas().image
    height, width = image.shape[:2]
    rows = slice(round(top * height - 0.5), round(bottom * height + 0.5))
    return image[rows, round(left * width - 0.5) : round(right * width + 0.5)] / 255


def darkest_fringe(texels: Texels) -> float:
    """Over blocks that mix leaf and sky, the least brightness of the mean colour against the leaf's own."""
    side = len(texels) // 8
    blocks = texels.reshape(side, 8, side, 8, 4).transpose(0, 2, 1, 3, 4).reshape(-1, 64, 4)
    alpha = blocks[..., 3]
    mixed = blocks[(alpha.mean(axis=1) > 0.05) & (alpha.mean(axis=1) < 0.95)]
    weight = mixed[..., 3:]
    leaf = (mixed[..., :3] * weight).sum(axis=1) / weight.sum(axis=1)
    return float((mixed[..., :3].mean(axis=1).sum(axis=1) / leaf.sum(axis=1)).min())


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_gives_the_same_tree_and_another_seed_another(kind: Kind) -> None:
    one, two, other = trees.tree(kind, 7), trees.tree(kind, 7), trees.tree(kind, 8)
    for part in ("trunk", "leaves", "trunk_far", "leaves_far"):
        assert np.array_equal(getattr(one, part).vertices(), getattr(two, part).vertices()), part
    assert not np.array_equal(one.leaves.position[:20], other.leaves.position[:20])


@pytest.mark.parametrize("kind", KINDS)
def test_trees_are_sound_meshes(kind: Kind) -> None:
    tree = trees.tree(kind, 7)
    for mesh in (tree.trunk, tree.leaves, tree.trunk_far, tree.leaves_far):
        assert np.isfinite(mesh.position).all()
        assert np.abs(np.linalg.norm(mesh.normal, axis=1) - 1).max() < 1e-5
        assert mesh.color.min() >= 0
    assert (tree.trunk.color[:, 3] == 0).all()
    assert tree.leaves.color[:, 3].max() <= 1


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [1, 7, 23])
def test_a_tree_keeps_its_budget(kind: Kind, seed: int) -> None:
    tree = trees.tree(kind, seed)
    assert 60 <= len(tree.leaves.index) <= 800
    assert len(tree.leaves_far.index) <= 0.8 * len(tree.leaves.index)
    assert len(tree.trunk.index) <= 250
    assert len(tree.trunk_far.index) <= 100


@pytest.mark.parametrize("kind", WOODY)
@pytest.mark.parametrize("seed", [1, 7, 23])
def test_a_tree_is_as_high_and_as_wide_as_asked(kind: Kind, seed: int) -> None:
    species = SPECIES[kind]
    tree = trees.tree(kind, seed, height=9.0)
    low, high = Mesh.merge([tree.leaves, tree.trunk]).bounds
    assert 7.4 < high[1] < 10.6
    reach = species.spread * 9.0 + species.lean * 9.0 * 3 + species.card
    assert max(-low[0], high[0], -low[2], high[2]) < reach


@pytest.mark.parametrize("kind", WOODY)
def test_both_details_have_the_same_outline_and_hue(kind: Kind) -> None:
    tree = trees.tree(kind, 7)
    (low, high), (far_low, far_high) = tree.leaves.bounds, tree.leaves_far.bounds
    assert (np.abs(far_low - low)[:2] < 0.25 * (high - low)[:2]).all()
    assert (np.abs(far_high - high)[:2] < 0.25 * (high - low)[:2]).all()
    near, far = (mesh.color[:, :3].mean(axis=0) for mesh in (tree.leaves, tree.leaves_far))
    assert far == pytest.approx(near, rel=0.12)


@pytest.mark.parametrize("kind", KINDS)
def test_normals_look_out_of_the_crown(kind: Kind) -> None:
    crown = grow(kind, 7)
    outward = crown.centre - crown.centre.mean(axis=0)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = np.einsum("ij,ij->i", outward, crown.normal)
    assert (along > 0).mean() > 0.7


@pytest.mark.parametrize("kind", [kind for kind in KINDS if SPECIES[kind].lobes])
@pytest.mark.parametrize("seed", [1, 7, 23])
def test_the_undersides_of_lobes_are_darker_than_their_tops(kind: Kind, seed: int) -> None:
    crown = grow(kind, seed)
    shade = crown.shade.sum(axis=1)
    assert shade[crown.normal[:, 1] < 0.1].mean() < 0.97 * shade[crown.normal[:, 1] > 0.3].mean()


@pytest.mark.parametrize("kind", KINDS)
def test_cards_are_drawn_from_the_pond_outwards(kind: Kind) -> None:
    depth = centres(trees.tree(kind, 7).leaves)[:, 2]
    assert np.corrcoef(np.arange(len(depth)), depth)[0, 1] < -0.9


def test_a_forest_faces_the_pond_and_begins_with_the_nearest() -> None:
    places = np.array([[0.0, 0.5, -40.0], [25.0, 0.5, 0.0], [0.0, 0.5, 30.0]])
    wood = trees.forest(5, places, ["oak", "birch", "alder"], np.full(3, 8.0))
    away = np.hypot(*centres(wood.leaves)[:, [0, 2]].T)
    assert away[:20].max() < 30
    assert away[-20:].min() > 33
    assert (away > 20).all()
    feet = wood.trunk.position[wood.trunk.position[:, 1] < 0.45]
    assert len(feet) > 10


def test_far_trees_stand_upright_on_the_ground_and_face_the_pond() -> None:
    places = np.array([[50.0, 1.0, 0.0], [0.0, 2.0, -60.0], [-40.0, 0.0, 40.0]])
    mesh = trees.far_trees(5, places, ["far_oak", "thicket0", "far_spruce"], np.array([8.0, 9.0, 10.0]))
    assert len(mesh.index) == 6 * 3
    corners = mesh.position[mesh.index]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", face, -corners.mean(axis=1) * [1, 0, 1]) > 0).all()
    height = mesh.position.reshape(3, 8, 3)[..., 1]
    assert sorted((height.max(axis=1) - height.min(axis=1)).round().tolist()) == [8, 9, 10]
    assert np.abs(height.min(axis=1) - [1.0, 0.0, 2.0]).max() < 0.4


def test_the_casters_of_far_shadows_stand_behind_the_trees() -> None:
    places = np.array([[30.0, 1.0, 0.0], [0.0, 2.0, -40.0]])
    heights = np.array([8.0, 9.0])
    names = ["far_oak", "far_spruce"]
    seen, casters = (build(5, places, names, heights) for build in (trees.far_trees, trees.far_casters))
    away, farther = (np.hypot(mesh.position[:, 0], mesh.position[:, 2]) for mesh in (seen, casters))
    assert (farther - away).min() > 1.0


def test_shrubs_grow_where_they_are_put() -> None:
    places = np.array([[20.0, 0.4, 0.0], [0.0, 0.6, -22.0]])
    full, plain = (trees.shrubs(5, places, size=1.3, detail=detail) for detail in ("full", "map"))
    assert len(plain.index) < len(full.index) <= 2 * 130
    assert full.position[:, 1].max() < 3.0


@pytest.mark.parametrize("name", leaves.CELLS)
def test_no_dark_colour_hides_under_the_empty_texels(name: str) -> None:
    texels = cell(name)
    if texels[..., 3].min() < 0.5:
        assert darkest_fringe(texels) > 0.7
        assert texels[..., :3].sum(axis=2).min() > 0.12


def test_the_fringe_test_sees_a_dark_fringe() -> None:
    unbled = cell("oak0").copy()
    unbled[unbled[..., 3] == 0] = 0
    assert darkest_fringe(unbled) < 0.5


def test_bleeding_changes_no_covered_colour() -> None:
    rng = np.random.default_rng(3)
    image = rng.uniform(0.2, 1, (32, 32, 4)).astype(np.float32)
    image[..., 3] = rng.uniform(size=(32, 32)) < 0.2
    image[image[..., 3] == 0] = 0
    bled = leaves.bled(image)
    covered = image[..., 3] == 1
    assert bled[covered] == pytest.approx(image[covered], abs=1e-5)
    assert np.array_equal(bled[..., 3], image[..., 3])
    assert bled[~covered][:, :3].min() > 0.1


@pytest.mark.parametrize("name", [*leaves.DRAWINGS, *leaves.PORTRAITS])
def test_a_hull_is_convex_tight_and_holds_the_drawing(name: str) -> None:
    hull = leaves.hull(name)
    edge = np.roll(hull, -1, axis=0) - hull
    following = np.roll(edge, -1, axis=0)
    turn = edge[:, 0] * following[:, 1] - edge[:, 1] * following[:, 0]
    assert turn.min() > -1e-9
    alpha = cell(name)[..., 3]
    side = len(alpha)
    t, s = np.mgrid[0:side, 0:side]
    s, t = (s + 0.5) / side, 1 - (t + 0.5) / side
    inside = np.ones_like(alpha, bool)
    for corner, along in zip(hull, edge, strict=True):
        inside &= along[0] * (t - corner[1]) - along[1] * (s - corner[0]) >= -1e-9
    assert alpha[inside].sum() > 0.96 * alpha.sum()
    if alpha.min() < 0.5:
        assert alpha[~inside].mean() < 0.06


def test_the_atlas_is_one_texture_for_all_foliage() -> None:
    atlas = leaves.atlas()
    assert atlas.name == leaves.LEAVES.albedo_map == leaves.BLADES.albedo_map
    assert atlas.is_srgb
    assert atlas.mipmaps == "coverage"
    assert atlas.image.dtype == np.uint8
    assert len(leaves.CELLS) <= leaves.COLUMNS * leaves.ROWS
    uv = np.array([leaves.at(name, np.array([[0.5, 0.5]]))[0] for name in leaves.CELLS])
    assert len(np.unique(uv.round(4), axis=0)) == len(leaves.CELLS)


def test_bark_repeats_upwards() -> None:
    image = leaves.bark().image.astype(int)
    seam = np.abs(image[0] - image[-1]).mean()
    within = np.abs(image[1:] - image[:-1]).mean(axis=(1, 2))
    assert seam <= within.max() * 1.05
