"""The plants of bank and water: the same every time, on the ground, cheap, and out of the camera's way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene import leaves, lilies, plants, scatter
from renderer.scene.leaf_drawing import SUPERSAMPLE, Canvas
from renderer.scene.mesh import Mesh
from renderer.scene.plant_drawing import STRIPS, strip
from renderer.scene.planting import planting
from renderer.scene.scene import SceneObject

Array = NDArray[np.float64]
PLACES = np.stack([np.linspace(-1, 1, 12), np.full(12, 0.3), np.linspace(1, -1, 12) ** 3], axis=1)

BUILDERS: dict[str, Callable[..., Mesh]] = {
    "reeds": plants.reeds,
    "cattails": plants.cattails,
    "sedge": plants.sedge,
    "grass": plants.grass,
    "irises": plants.irises,
    "flowers": plants.flowers,
    "lily_pads": lilies.lily_pads,
}
TRIANGLES = {"reeds": 40, "cattails": 65, "sedge": 50, "grass": 20, "irises": 65, "flowers": 14, "lily_pads": 70}
"""Most triangles that one plant may cost."""


def ground(x: Array, z: Array) -> Array:
    """A bowl like the pond's: water within an ellipse, a bank that rises to a metre."""
    r = np.hypot(np.asarray(x) / 17, np.asarray(z) / 13)
    bank = 1.2 * (1 - np.exp(-2.2 * np.maximum(r - 1, 0)))
    return np.asarray(np.where(r < 1, -1.8 * np.maximum(1 - r**2, 0) ** 0.8, bank))


@pytest.fixture(scope="module")
def grown() -> tuple[SceneObject, ...]:
    return planting(5, ground)


@pytest.mark.parametrize("name", BUILDERS)
def test_a_seed_gives_the_same_plants_and_another_seed_others(name: str) -> None:
    first, again, other = (BUILDERS[name](seed, PLACES) for seed in (3, 3, 4))
    assert np.array_equal(first.vertices(), again.vertices())
    assert np.array_equal(first.index, again.index)
    assert not np.array_equal(first.position[:50], other.position[:50])


@pytest.mark.parametrize("detail", ["full", "map"])
@pytest.mark.parametrize("name", BUILDERS)
def test_plants_are_sound_meshes(name: str, detail: str) -> None:
    mesh = BUILDERS[name](3, PLACES, detail=detail)
    assert np.isfinite(mesh.position).all()
    assert np.abs(np.linalg.norm(mesh.normal, axis=1) - 1).max() < 1e-5
    assert mesh.color[:, 3].min() >= 0
    assert mesh.color[:, 3].max() <= 1
    assert mesh.color[:, :3].min() > 0.1
    assert mesh.uv.min() >= 0
    assert mesh.uv.max() <= 1
    corners = mesh.position[mesh.index]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert area.min() > 1e-9


@pytest.mark.parametrize("name", BUILDERS)
def test_a_plant_costs_few_triangles_and_fewer_in_the_maps(name: str) -> None:
    full, plain = (BUILDERS[name](3, PLACES, detail=detail) for detail in ("full", "map"))
    assert len(full.index) <= TRIANGLES[name] * len(PLACES)
    assert len(plain.index) <= 0.75 * len(full.index)


@pytest.mark.parametrize("name", BUILDERS)
def test_both_details_fill_the_same_space(name: str) -> None:
    (low, high), (map_low, map_high) = (BUILDERS[name](3, PLACES, detail=detail).bounds for detail in ("full", "map"))
    slack = 0.12 * (high - low) + 0.15
    assert (np.abs(map_low - low) < slack).all()
    assert (np.abs(map_high - high) < slack).all()


@pytest.mark.parametrize("name", BUILDERS)
def test_no_places_give_an_empty_mesh(name: str) -> None:
    assert len(BUILDERS[name](3, np.zeros((0, 3))).index) == 0


@pytest.mark.parametrize("name", [name for name in BUILDERS if name != "lily_pads"])
def test_plants_stand_on_their_ground_and_their_feet_are_rigid(name: str) -> None:
    mesh = BUILDERS[name](3, PLACES)
    assert abs(float(mesh.position[:, 1].min()) - 0.3) < 0.02
    feet = mesh.position[:, 1] < 0.31
    assert feet.any()
    assert mesh.color[feet, 3].max() < 0.01


def test_pads_float_just_over_the_water_and_look_up() -> None:
    mesh = lilies.lily_pads(3, lilies.float_pads(3, (0.0, 0.0), 1.5, 30), blooming=0.0)
    assert mesh.position[:, 1].min() >= 0.003
    assert np.median(mesh.position[:, 1]) < 0.025
    assert mesh.normal[:, 1].min() > 0.5
    assert (mesh.color[:, 3] == 0).all()


def test_pads_of_a_group_lie_beside_each_other() -> None:
    places = lilies.float_pads(3, (4.0, -2.0), 1.6, 30)
    gap = np.linalg.norm(places[:, None] - places, axis=2) + np.eye(30)
    assert np.median(gap.min(axis=1)) > 0.18
    assert np.linalg.norm(places.mean(axis=0) - [4.0, 0.0, -2.0]) < 0.5


def test_the_whole_planting_is_deterministic(grown: tuple[SceneObject, ...]) -> None:
    again = planting(5, ground)
    assert [part.name for part in again] == [part.name for part in grown]
    for one, two in zip(grown, again, strict=True):
        assert np.array_equal(one.mesh.vertices(), two.mesh.vertices()), one.name


def test_the_whole_planting_keeps_its_budget(grown: tuple[SceneObject, ...]) -> None:
    full = sum(len(part.mesh.index) for part in grown)
    plain = sum(len((part.map_mesh or part.mesh).index) for part in grown if part.in_maps or part.casts_shadow)
    assert full <= 85_000
    assert plain <= 25_000


def test_nothing_stands_in_the_cameras_ring(grown: tuple[SceneObject, ...]) -> None:
    for part in grown:
        x, y, z = part.mesh.position.T
        in_ring = (np.hypot(x, z) > 9.5) & (np.hypot(x, z) < 15.5)
        assert not (in_ring & (y > 2.0)).any(), part.name


def test_reeds_and_lilies_grow_in_the_water_they_like(grown: tuple[SceneObject, ...]) -> None:
    for part in grown:
        if "reeds" in part.tags and len(part.mesh.index):
            assert part.mesh.position[:, 1].min() > -0.52
    bed = scatter.clump(3, ground, (-16.0, -3.6), 2.0, 60, between=(-0.4, 0.0))
    assert len(bed) > 10
    assert bed[:, 1].min() > -0.4
    assert bed[:, 1].max() < 0.0


def test_the_bank_is_thinned_by_the_density() -> None:
    shore = scatter.shoreline(ground)
    assert np.abs(ground(shore[:, 0], shore[:, 1])).max() < 0.2
    everywhere = scatter.bank(3, ground, shore, 400)
    eastern = scatter.bank(3, ground, shore, 400, density=lambda x, _: (x > 0) * 1.0)
    assert (everywhere[:, 0] < 0).any()
    assert (eastern[:, 0] > 0).all()


def test_sectors_share_out_every_place_once() -> None:
    places = scatter.ring(3, ground, 40, inner=20, outer=40)
    parts = scatter.sectors(places, 8)
    assert sorted(np.concatenate(parts).tolist()) == list(range(len(places)))


def test_gaps_in_a_ring_stay_open() -> None:
    places = scatter.ring(3, ground, 60, inner=20, outer=40, gaps=((90.0, 20.0),), apart=1.0)
    bearing = np.degrees(np.arctan2(places[:, 2], places[:, 0]))
    assert len(places) > 30
    assert np.abs(bearing - 90).min() >= 20


@pytest.mark.parametrize("name", STRIPS)
def test_a_strip_shows_its_own_paint(name: str) -> None:
    middle, half = strip(name)
    uv = leaves.at("strips", np.array([[middle - half, 0.5], [middle, 0.5], [middle + half, 0.5]]))
    image = leaves.atlas().image
    texels = (uv * [image.shape[1], image.shape[0]]).astype(int)
    shown = image[texels[:, 1], texels[:, 0], :3].astype(float)
    assert np.abs(shown - STRIPS[name]).max() < 60


def test_a_canvas_reduces_to_clean_edges() -> None:
    canvas = Canvas(16)
    canvas.polygon(np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0]]), (200, 100, 50))
    texture = canvas.texture()
    assert canvas.side == 16 * SUPERSAMPLE
    assert texture[8, 3, 3] == 1
    assert texture[8, 12, 3] == 0
    assert texture[8, 3, :3] == pytest.approx(np.array([200, 100, 50]) / 255, abs=1 / 255)
