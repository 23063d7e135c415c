"""The pond: its water is where it says, every turntable view is clear, nowhere does the world end."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from renderer.request import FrameRequest
from renderer.scene import hills, pond, pond_parts
from renderer.scene.pond_parts import AXIS, Land
from renderer.scene.scene import Scene
from renderer.scene.shore import OUTLINE, outline_curve, outline_distance

EYE = np.array(pond.ENTRY.own["camera"]["eye"])
RADIUS = float(np.hypot(EYE[0], EYE[2]))


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The pond, from the user's cache where it is baked."""
    return pond.load()


@pytest.fixture(scope="module")
def land() -> Land:
    """Its ground."""
    return pond_parts.shape_land(pond.SEED)


def test_describing_the_pond_builds_nothing() -> None:
    program = "import renderer.scene.catalogue, sys; print('renderer.scene.pond_parts' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_the_scenes_own_settings_make_a_request() -> None:
    request = FrameRequest.parse({})
    assert request.scene == "pond"
    assert request.sun is not None


def test_the_outline_is_about_34_by_26_metres_and_signed() -> None:
    curve = outline_curve(8)
    assert np.ptp(curve[:, 0]) == pytest.approx(34, abs=1)
    assert np.ptp(curve[:, 1]) == pytest.approx(26, abs=1)
    inside, outside = outline_distance(np.array([0.0, 40.0]), np.array([0.0, 40.0]))
    assert inside < -5
    assert outside > 20
    on_it = outline_distance(*np.array(OUTLINE, float).T)
    np.testing.assert_allclose(on_it, 0, atol=1e-3)


def test_all_water_lies_in_the_waters_extents(land: Land) -> None:
    x0, x1, z0, z1 = pond.ENTRY.water_extents
    row, column = np.nonzero(land.shore.height < pond.ENTRY.water_level)
    assert AXIS.world[column].min() > x0
    assert AXIS.world[column].max() < x1
    assert AXIS.world[row].min() > z0
    assert AXIS.world[row].max() < z1


def test_the_water_is_two_metres_deep_and_the_bed_never_dry_in_the_middle(land: Land) -> None:
    assert -2.4 < land.shore.height.min() < -1.8
    x, z = np.meshgrid(np.linspace(-4, 4, 20), np.linspace(-4, 2, 20))
    assert land.height(x, z).max() < -0.3


def test_the_ring_of_the_turntable_stands_over_low_ground(land: Land) -> None:
    turn = np.linspace(0, 2 * np.pi, 180)[:, None]
    away = np.linspace(10, 15, 11)[None, :]
    assert land.height(away * np.cos(turn), away * np.sin(turn)).max() < 1.6


def test_nothing_stands_in_the_ring_of_the_turntable(scene: Scene) -> None:
    for part in scene.objects:
        x, y, z = part.mesh.position[np.unique(part.mesh.index)].T
        away = np.hypot(x, z)
        blocks = (away > 10) & (away < 15) & (y > 2.7) & (y < 5)
        assert not blocks.any(), part.name


def test_no_camera_of_the_turntable_is_near_anything(scene: Scene) -> None:
    turn = np.radians(np.arange(0, 360, 3))
    eyes = np.stack([RADIUS * np.cos(turn), np.full(len(turn), EYE[1]), RADIUS * np.sin(turn)], axis=1)
    for part in scene.objects:
        points = part.mesh.position[np.unique(part.mesh.index)].astype(float)
        points = points[np.abs(np.hypot(points[:, 0], points[:, 2]) - RADIUS) < 1.5]
        for eye in eyes if len(points) else ():
            assert np.linalg.norm(points - eye, axis=1).min() > 0.9, part.name


@pytest.mark.parametrize("height", [0.5, 3.2, 4.5])
def test_no_sky_shows_below_the_horizon(height: float) -> None:
    sheet = hills.hill_sheet(pond.SEED, hills.FAR_ROWS, 360, 1)[0].position
    direction = np.degrees(np.arctan2(sheet[:, 2], sheet[:, 0])) // 2
    for sector in np.unique(direction):
        assert sheet[direction == sector, 1].max() > height + 5


def test_the_land_is_one_sheet_from_the_shore_to_the_mountains(land: Land) -> None:
    turn = np.linspace(0, 2 * np.pi, 90)
    edge = 88.0
    x, z = edge * np.cos(turn), edge * np.sin(turn)
    assert np.abs(land.height(x, z) - hills.far_height(x, z, pond.SEED)).max() < 1.0


def test_the_terrain_has_the_triangles_that_were_planned(scene: Scene) -> None:
    ground = [part for part in scene.objects if "terrain" in part.tags]
    full = sum(len(part.mesh.index) for part in ground)
    plain = sum(len(part.map_mesh.index) for part in ground if part.map_mesh is not None)
    assert 60_000 < full <= 66_000
    assert plain < full / 4
    assert all(part.map_mesh is not None for part in ground)
    assert 16 <= len(ground) <= 64


def test_everything_is_finite_and_has_its_textures(scene: Scene) -> None:
    for part in scene.objects:
        for mesh in (part.mesh, part.map_mesh):
            if mesh is not None:
                assert np.isfinite(mesh.position).all()
                np.testing.assert_allclose(np.linalg.norm(mesh.normal, axis=1), 1, atol=2e-3)
                assert (mesh.color >= 0).all()
        for name in (part.material.albedo_map, part.material.detail_map):
            assert name is None or name in scene.textures


def test_the_same_seed_gives_the_same_ground_and_another_another(land: Land) -> None:
    again = pond_parts.shape_land(pond.SEED)
    np.testing.assert_array_equal(again.shore.height, land.shore.height)
    assert again.stones == land.stones
    other = pond_parts.shape_land(pond.SEED + 1)
    assert np.abs(other.shore.height - land.shore.height).max() > 0.1


def test_the_ground_is_wet_dark_at_the_waterline_and_green_on_the_meadow(scene: Scene, land: Land) -> None:
    color = scene.textures["ground"].image[..., :3].astype(float) ** 2
    texels = AXIS.texels(color.shape[0])
    x, z = np.meshgrid(texels.world[::8], texels.world[::8])
    height, distance = land.height(x, z), land.distance(x, z)
    brightness = color[::8, ::8].mean(axis=2)
    sandy = (distance > 0) & (np.hypot(x - 6.9, z - 5.4) < 2.0)
    damp, dry = sandy & (height < 0.04), sandy & (height > 0.16) & (distance < 1.2)
    assert brightness[damp].mean() < 0.8 * brightness[dry].mean()
    meadow = color[::8, ::8][(distance > 8) & (distance < 30)]
    assert (meadow[:, 1] > meadow[:, 0]).mean() > 0.6
    assert (meadow[:, 1] > meadow[:, 2]).mean() > 0.95


def test_the_grounds_colours_do_not_repeat(scene: Scene) -> None:
    strip = scene.textures["ground"].image[300:428, :, 1].astype(float)
    spectrum = np.fft.fft2(strip - strip.mean())
    likeness = np.fft.ifft2(np.abs(spectrum) ** 2).real
    likeness /= likeness[0, 0]
    assert likeness[:, 160:-160].max() < 0.35
