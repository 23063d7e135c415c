"""The lake: land all round its water, a bed that goes on below it, and a forest that stands on the ground."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from renderer.request import FrameRequest
from renderer.scene import lake, lake_parts, lake_peaks, lake_woods
from renderer.scene.lake_parts import AXIS, Land
from renderer.scene.lake_shore import ISLAND, OUTLINE, RING, land_distance, shape_lake
from renderer.scene.noise import grid_fbm, resolved_fbm
from renderer.scene.scene import Scene
from tests.renderer.drawing import linear, shared_renderer

X0, X1, Z0, Z1 = lake.ENTRY.water_extents
EYE = np.array(lake.ENTRY.own["camera"]["eye"])
TARGET = np.array(lake.ENTRY.own["camera"]["target"])


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The lake, from the user's cache where it is baked."""
    return lake.load()


@pytest.fixture(scope="module")
def land() -> Land:
    """Its ground."""
    return lake_parts.shape_land(lake.SEED)


def test_describing_the_lake_builds_nothing() -> None:
    program = "import renderer.scene.catalogue, sys; print('renderer.scene.lake_parts' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_the_scenes_own_settings_make_a_request() -> None:
    request = FrameRequest.parse({"scene": "lake"})
    assert request.sun is not None
    assert request.water.extents == lake.ENTRY.water_extents


def test_the_outline_is_about_330_by_210_metres_with_an_island_in_it() -> None:
    shore = np.array(OUTLINE)
    assert 250 < np.ptp(shore[:, 1]) < 400
    assert 150 < np.ptp(shore[:, 0]) < 250
    middle = np.mean(ISLAND, axis=0)
    x, z = np.array([middle[0], 0.0, 0.0]), np.array([middle[1], -200.0, 60.0])
    on_island, in_the_middle, inland = land_distance(x, z)
    assert on_island > 3
    assert in_the_middle < -50
    assert inland > 30


def test_no_edge_of_the_waters_plane_is_seen(land: Land) -> None:
    across, along = np.linspace(X0, X1, 800), np.linspace(Z0, Z1, 800)
    for x, z in (
        (across, 0 * across + Z0),
        (across, 0 * across + Z1),
        (0 * along + X0, along),
        (0 * along + X1, along),
    ):
        assert land.height(x, z).min() > 0.2


def test_where_the_drawn_shore_says_land_no_water_stands(land: Land) -> None:
    height, distance = land.shore.height, land.shore.distance
    assert height[distance > 0].min() >= 0
    assert height[distance > 4].min() > 0.3
    row, column = np.nonzero(height < 0)
    assert AXIS.world[column].min() > X0
    assert AXIS.world[column].max() < X1
    assert AXIS.world[row].min() > Z0
    assert AXIS.world[row].max() < Z1


def test_the_bed_has_a_shelf_and_a_deep_middle(land: Land) -> None:
    depth, off_shore = -land.shore.height, -land.shore.distance
    assert 12 < depth.max() < 20
    assert np.median(depth[(off_shore > 1.5) & (off_shore < 3)]) < 0.6
    assert np.median(depth[off_shore > 60]) > 11
    assert depth[off_shore > 1].min() > 0.02


def test_the_shallows_before_the_default_camera_can_be_waded(land: Land) -> None:
    x, z = np.meshgrid(np.linspace(-3, 4, 15), np.linspace(-6, -3.5, 8))
    depth = -land.height(x, z)
    assert 0.05 < np.median(depth) < 0.8


def test_the_default_camera_stands_over_the_ground_near_the_water(land: Land) -> None:
    ground = float(land.height(EYE[0], EYE[2]))
    assert 1.2 < EYE[1] - ground < 2.6
    assert 2 < float(land.distance(EYE[0], EYE[2])) < 9


def test_no_tree_stands_in_the_way_of_the_turntable(scene: Scene) -> None:
    reach = float(np.hypot(*(EYE - TARGET)[[0, 2]]))
    assert RING[2] < reach < RING[3]
    turn = np.radians(np.arange(0, 360, 3))
    eyes = TARGET + np.stack([reach * np.cos(turn), 0 * turn, reach * np.sin(turn)], axis=1)
    eyes[:, 1] = EYE[1]
    for part in (part for part in scene.objects if part.tags & {"tree", "shrub", "reeds"}):
        points = part.mesh.position.astype(float)
        points = points[np.abs(np.hypot(*(points - TARGET)[:, [0, 2]].T) - reach) < 1.2]
        for eye in eyes if len(points) else ():
            assert np.linalg.norm(points - eye, axis=1).min() > 0.9, part.name


def test_trees_stand_on_land_with_their_feet_in_the_ground(land: Land) -> None:
    for stand in lake_woods.stands(lake.SEED, land.height, land.distance):
        x, y, z = stand.places.T
        ground = land.height(x, z)
        assert (land.distance(x, z) > 0.5).all()
        assert (y < ground).all()
        assert (y > ground - 1.3).all()
        assert (ground > 0.2).all()


def test_the_forest_stands_in_no_rows(land: Land) -> None:
    single, _ = lake_woods.stands(lake.SEED, land.height, land.distance)
    for axis in (0, 2):
        phase = np.exp(2j * np.pi * single.places[:, axis] / lake_woods.SINGLE_CELL)
        assert np.abs(phase.mean()) < 0.12


def test_the_forest_has_the_trees_and_triangles_that_were_planned(scene: Scene, land: Land) -> None:
    single, group = lake_woods.stands(lake.SEED, land.height, land.distance)
    assert 1200 < len(single.names) < 3000
    assert 2500 < len(group.names) < 7000
    assert set(single.names) == {name for name, *_ in lake_woods.SINGLE}
    assert scene.triangles < 320_000
    maps = sum(len((part.map_mesh or part.mesh).index) for part in scene.objects if part.in_maps)
    assert maps < 0.5 * scene.triangles


def test_the_default_view_has_at_most_a_hundred_thousand_triangles(scene: Scene) -> None:
    forward = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    reach = np.tan(np.radians(22.5))
    count = 0
    for part in scene.objects:
        offset = part.mesh.position[part.mesh.index].mean(axis=1) - EYE
        ahead = offset @ forward
        is_far = np.linalg.norm(offset, axis=1).min(initial=np.inf) > part.detail_distance
        inside = (np.abs(offset @ right) < 16 / 9 * reach * ahead) & (np.abs(offset @ up) < reach * ahead)
        share = len((part.map_mesh or part.mesh).index) / max(len(part.mesh.index), 1) if is_far else 1.0
        count += round(share * int(inside.sum()))
    assert 30_000 < count < 100_000


def test_every_kind_of_thing_is_tagged(scene: Scene) -> None:
    tags = set().union(*(part.tags for part in scene.objects))
    assert tags >= {"terrain", "rock", "tree", "reeds", "grass", "hills"}
    assert all(part.tags for part in scene.objects)


def test_everything_is_finite_and_has_its_textures(scene: Scene) -> None:
    for part in scene.objects:
        for mesh in (part.mesh, part.map_mesh):
            if mesh is not None:
                assert np.isfinite(mesh.position).all()
                np.testing.assert_allclose(np.linalg.norm(mesh.normal, axis=1), 1, atol=2e-3)
                assert (mesh.color >= 0).all()
        for name in (part.material.albedo_map, part.material.detail_map):
            assert name is None or name in scene.textures


def test_the_same_seed_gives_the_same_land_and_another_another(land: Land) -> None:
    coarse = AXIS.coarser(4)
    one, again, other = (shape_lake(coarse, lake.SEED + step) for step in (0, 0, 1))
    np.testing.assert_array_equal(again.height, one.height)
    assert np.abs(other.height - one.height).max() > 0.1
    first, second = (lake_woods.stands(lake.SEED, land.height, land.distance)[0] for _ in range(2))
    np.testing.assert_array_equal(first.places, second.places)
    np.testing.assert_array_equal(first.names, second.names)


def test_the_mountains_close_the_world_and_meet_the_ground(land: Land) -> None:
    peaks = lake_peaks.shape_range(lake.SEED)
    skyline = (peaks.height / peaks.distance[:, None]).max(axis=0)
    assert np.degrees(np.arctan(skyline.min())) > 1.5
    assert 500 < peaks.height.max() < 900
    turn = np.linspace(0, 2 * np.pi, 90)
    row = int(np.searchsorted(peaks.distance, 560.0))
    column = np.rint(turn / (2 * np.pi) * lake_peaks.COLUMNS).astype(np.int64) % lake_peaks.COLUMNS
    away = peaks.distance[row]
    gap = land.height(away * np.sin(turn), -away * np.cos(turn)) - peaks.height[row, column]
    assert gap.min() > 0
    assert gap.max() < 20


def test_a_far_sample_carries_no_noise_that_is_too_fine_for_it() -> None:
    x = AXIS.world
    near, far = slice(508, 517), slice(0, 40)
    fine = resolved_fbm(x, 0.8, 3, octaves=1)
    np.testing.assert_allclose(fine[near, near], grid_fbm(x[near], x[near], 0.8, 3, octaves=1), atol=1e-5)
    assert not fine[far, far].any()
    np.testing.assert_allclose(resolved_fbm(x, 500.0, 3, octaves=1), grid_fbm(x, x, 500.0, 3, octaves=1), atol=1e-5)


def test_the_default_picture_shows_sky_forest_and_their_reflection() -> None:
    frame = shared_renderer().render(
        FrameRequest.parse({"scene": "lake", "width": 240, "height": 135, "msaa": 1, "tonemap": "none"})
    )
    light = linear(frame.color)
    sky, wood, water = light[:8], light[46:54, 5:60], light[75:95, 100:150]
    assert sky.mean() > 0.4
    assert wood.mean() < 0.12
    assert (wood[..., 1] > wood[..., 2]).mean() > 0.8
    assert light[66:72, 5:60].mean() < 0.12 < water.mean()
