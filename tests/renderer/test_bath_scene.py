"""The bath: it stands where the document says, is seen and lit as there, and holds its water."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.request import FrameRequest
from renderer.scene import arcade, basin, bath, court, hills, mouldings
from renderer.scene.bath_parts import BATH, GROUND, SURROUNDINGS, WALL
from renderer.scene.mesh import Mesh
from renderer.scene.scene import Scene

Floats = NDArray[np.float64]

LEVEL = bath.ENTRY.water_level
CLIP = 2.85
"""Where the document's refraction map is cut, metres."""
TO_OURS = np.array([1.0, 1.0, -1.0])
"""What the document's coordinates are multiplied by."""
EYE = np.array([-10.0, 6.0, -10.0])
"""The document's camera, in its own coordinates."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The bath, from the user's cache where it is baked."""
    return bath.load()


@pytest.fixture(scope="module")
def tub() -> Mesh:
    """The bath with its floor."""
    return Mesh.merge([basin.bath(bath.SEED), basin.floor(bath.SEED)])


def highest(mesh: Mesh, places: Floats, low: float = -np.inf) -> Floats:
    """The height of the highest surface over (n, 2) places (x, z); ``low`` where there is none."""
    corner = mesh.position[mesh.index].astype(np.float64)
    a, b, c = (corner[:, k] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 2] - a[:, 2]) - (c[:, 0] - a[:, 0]) * (b[:, 2] - a[:, 2])
    lying = np.abs(area) > 1e-9
    a, b, c, area = a[lying], b[lying], c[lying], area[lying]
    found = np.full(len(places), low)
    for number, (x, z) in enumerate(places):
        v = ((x - a[:, 0]) * (c[:, 2] - a[:, 2]) - (c[:, 0] - a[:, 0]) * (z - a[:, 2])) / area
        w = ((b[:, 0] - a[:, 0]) * (z - a[:, 2]) - (x - a[:, 0]) * (b[:, 2] - a[:, 2])) / area
        hit = (v >= -1e-9) & (w >= -1e-9) & (v + w <= 1 + 1e-9)
        height = a[:, 1] + v * (b[:, 1] - a[:, 1]) + w * (c[:, 1] - a[:, 1])
        found[number] = np.max(height[hit], initial=low)
    return found


def square(half: float, count: int = 24) -> Floats:
    """Places (x, z) along the sides of a square, corners left out."""
    side = np.linspace(-half + 0.15, half - 0.15, count)
    edge = np.full(count, half)
    return np.concatenate([np.stack(pair, 1) for pair in ((side, edge), (side, -edge), (edge, side), (-edge, side))])


def document_place(points: Floats, width: int, height: int) -> Floats:
    """Where the document's camera sees its own points, in normalised coordinates: left-handed, yaw clockwise."""
    yaw = np.radians(45.0)
    forward = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    right = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
    seen = points - EYE
    scale = 1 / np.tan(np.pi / 8) / (seen @ forward)
    return np.stack([seen @ right * scale * height / width, seen[:, 1] * scale], axis=1)


def test_describing_the_bath_builds_nothing() -> None:
    program = "import renderer.scene.catalogue, sys; print('renderer.scene.bath_parts' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)

    assert done.stdout.strip() == "False"


# ------------------------------------------------------------------------------------- R1 to R3: places, camera, light


@pytest.mark.parametrize(
    ("tag", "middle"), [("bath", (0.0, 2.0, 0.0)), ("wall", (0.0, 6.0, 8.0))], ids=["the bath", "the wall"]
)
def test_a_models_middle_stands_where_the_document_puts_it(scene: Scene, tag: str, middle: tuple[float, ...]) -> None:
    place = np.concatenate([part.mesh.position for part in scene.objects if tag in part.tags])

    np.testing.assert_allclose((place.min(0) + place.max(0)) / 2, np.array(middle) * TO_OURS, atol=0.06)


def test_ground_and_water_lie_at_the_documents_heights(scene: Scene) -> None:
    ground = [part for part in scene.objects if "ground" in part.tags]

    assert ground
    assert {float(y) for part in ground for y in np.unique(part.mesh.position[:, 1])} == {1.0}
    assert LEVEL == 2.75


def test_a_pillar_stands_before_the_middle_of_the_wall(scene: Scene) -> None:
    pillar = next(part.mesh for part in scene.objects if part.name == "pillars").position
    bricks = next(part.mesh for part in scene.objects if part.name == "wall").position
    here = pillar[np.abs(pillar[:, 0]) < 0.6]

    assert here[:, 2].max() > bricks[:, 2].max() + 0.1
    assert here[:, 1].max() > bricks[:, 1].max() + 1


def test_every_point_is_seen_where_the_documents_camera_sees_it() -> None:
    request = FrameRequest.parse({"scene": "bath"})
    points = np.random.Generator(np.random.PCG64(4)).uniform([-4, 1, -4], [9, 11, 9], (50, 3))
    ours = request.view().project(points * TO_OURS)[:, :2]

    np.testing.assert_allclose(ours, document_place(points, request.width, request.height), atol=1e-9)


def test_the_camera_sees_bath_water_and_wall() -> None:
    view = FrameRequest.parse({"scene": "bath"}).view()
    x0, x1, z0, z1 = bath.ENTRY.water_extents
    water = np.array([[x, LEVEL, z] for x in (x0, x1) for z in (z0, z1)])
    rim = np.array([[x, basin.RIM, z] for x in (-4.0, 4.0) for z in (-4.0, 4.0)])
    pillars = np.array([[x, y, -7.4] for x in arcade.PILLARS[2:] for y in (1.0, 11.0)])

    for points in (water, rim, pillars):
        assert (np.abs(view.project(points)[:, :2]) < 1).all()


def test_light_is_the_documents_with_its_length() -> None:
    request = FrameRequest.parse({"scene": "bath"})
    assert request.sun is not None
    assert request.sun.shadows
    light = np.array([0.0, -1.0, 0.5])

    np.testing.assert_allclose(request.sun.towards * request.sun.radiance[0], -light * TO_OURS, atol=1e-12)
    np.testing.assert_array_equal(request.sun.radiance, request.sun.radiance[0])
    assert np.linalg.norm(request.sun.towards) == pytest.approx(1)
    assert request.ambient == (0.15, 0.15, 0.15)


# ------------------------------------------------------------------------------------------------ the bath as a vessel


def test_the_rim_stands_above_water_and_clip_all_round(tub: Mesh) -> None:
    half = bath.ENTRY.water_extents[1]
    assert bath.ENTRY.water_extents == (-half, half, -half, half)

    assert highest(tub, square(half + 0.05)).min() > CLIP + 0.05
    assert highest(tub, square(half + 0.3)).min() == pytest.approx(basin.RIM, abs=1e-3)
    assert highest(tub, square(half - 0.01)).max() < LEVEL - 0.5


def test_no_stone_breaks_the_water_and_no_hole_lets_it_out(tub: Mesh) -> None:
    line = np.linspace(-3.25, 3.25, 23)
    x, z = np.meshgrid(line, line)
    bottom = highest(tub, np.stack([x.ravel(), z.ravel()], axis=1))

    assert bottom.max() < LEVEL - 0.5
    assert bottom.min() > court.GROUND + 0.1, "the floor lies over the paving"


def test_the_bath_is_open_only_at_its_foot_and_round_its_floor() -> None:
    mesh = basin.bath(bath.SEED)
    _, welded = np.unique(mesh.position.round(4), axis=0, return_inverse=True)
    corner = welded.reshape(-1)[mesh.index]
    edges = np.sort(corner[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edge, times = np.unique(edges, axis=0, return_counts=True)
    height = np.zeros(welded.max() + 1)
    height[welded.reshape(-1)] = mesh.position[:, 1]
    open_at = set(height[edge[times == 1]].round(3).ravel().tolist())

    assert times.max() == 2
    assert open_at == {basin.FOOT - 0.05, basin.FLOOR}


def test_faces_turn_to_the_side_that_their_normals_say(scene: Scene) -> None:
    for part in scene.objects:
        if part.material.shader == "foliage" or "hills" in part.material.name or "mountains" in part.material.name:
            continue
        corner = part.mesh.position[part.mesh.index].astype(np.float64)
        flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        normal = part.mesh.normal[part.mesh.index].sum(axis=1)
        assert ((flat * normal).sum(axis=1) > 0).mean() > 0.995, part.name


def test_a_profile_keeps_its_offsets_on_every_side_and_its_edges_sharp() -> None:
    mesh = mouldings.swept([(0.2, 0.0), (0.2, 1.0), (0.0, 1.0)], mouldings.Path((2.0, 1.0), (5.0, -3.0), radius=0.1))
    low, high = mesh.bounds

    np.testing.assert_allclose(low, [5 - 2.2, 0, -3 - 1.2], atol=1e-6)
    np.testing.assert_allclose(high, [5 + 2.2, 1, -3 + 1.2], atol=1e-6)
    assert set(np.abs(mesh.normal[:, 1]).round(3).tolist()) == {0.0, 1.0}
    assert highest(mesh, np.array([[5.0, -3.95], [7.15, -3.0]])) == pytest.approx([-np.inf, 1.0])


# ----------------------------------------------------------------------------------------------------- the whole scene


def test_tags_say_what_enters_which_map(scene: Scene) -> None:
    kinds = {part.name.split()[0]: part.tags for part in scene.objects}

    assert {frozenset(tags) for tags in kinds.values()} == {BATH, WALL, GROUND, SURROUNDINGS}
    assert {name for name, tags in kinds.items() if "refracted" in tags} == {"bath"}
    assert {name for name, tags in kinds.items() if "reflected" in tags} == {"wall", "pillars"}
    assert {name for name, tags in kinds.items() if "ground" in tags} == {"paving"}


def test_what_is_refracted_is_cut_by_the_documents_clip_and_the_rest_is_not_under_water(scene: Scene) -> None:
    x0, x1, z0, z1 = bath.ENTRY.water_extents
    for part in scene.objects:
        x, y, z = part.mesh.position[np.unique(part.mesh.index)].T
        if part.name == "bath":
            assert y.min() < LEVEL < CLIP < y.max()
        elif part.tags != BATH:
            in_water = (x > x0) & (x < x1) & (z > z0) & (z < z1) & (y > basin.FLOOR)
            assert not in_water.any(), part.name


def test_everything_is_finite_and_has_its_textures(scene: Scene) -> None:
    for part in scene.objects:
        for mesh in (part.mesh, part.map_mesh):
            if mesh is not None:
                assert np.isfinite(mesh.position).all()
                assert np.isfinite(mesh.uv).all()
                np.testing.assert_allclose(np.linalg.norm(mesh.normal, axis=1), 1, atol=2e-3)
                assert (mesh.color >= 0).all()
        for name in (part.material.albedo_map, part.material.detail_map):
            assert name is None or name in scene.textures


def test_no_camera_of_the_turntable_is_near_anything(scene: Scene) -> None:
    turn = np.radians(np.arange(0, 360, 3))
    radius = float(np.hypot(EYE[0], EYE[2]))
    eyes = np.stack([radius * np.cos(turn), np.full(len(turn), EYE[1]), radius * np.sin(turn)], axis=1)
    for part in scene.objects:
        points = part.mesh.position[np.unique(part.mesh.index)].astype(float)
        points = points[np.abs(np.hypot(points[:, 0], points[:, 2]) - radius) < 1.5]
        for eye in eyes if len(points) else ():
            assert np.linalg.norm(points - eye, axis=1).min() > 0.9, part.name


def test_clipped_leaves_cast_their_shadow_from_within() -> None:
    for grown, plain in (
        (court.hedge(3), court.hedge(3, is_plain=True)),
        (court.yews(3, np.array([[2.0, 1.0]])), court.yews(3, np.array([[2.0, 1.0]]), is_plain=True)),
    ):
        places = plain.position[::7, [0, 2]].astype(np.float64) + 0.004
        inside = highest(grown, places, low=0.0)
        assert (inside > plain.position[::7, 1] - 0.03).mean() > 0.97


def test_land_reaches_from_the_paving_to_above_the_horizon() -> None:
    turn = np.linspace(0, 2 * np.pi, 60)
    x, z = np.cos(turn), np.sin(turn)

    assert np.abs(court.lawn_height(27 * x, 27 * z, bath.SEED) - court.GROUND).max() < 0.03
    far = hills.far_height(100 * x, 100 * z, bath.SEED) - court.HILLS_DROP
    np.testing.assert_allclose(court.lawn_height(100 * x, 100 * z, bath.SEED), far, atol=1e-9)
    crest = hills.hill_sheet(bath.SEED, hills.FAR_ROWS, 180, 1)[0].position
    bearing = np.degrees(np.arctan2(crest[:, 2], crest[:, 0])) // 4
    lowest = min(float(crest[bearing == sector, 1].max()) for sector in np.unique(bearing))
    assert lowest - court.HILLS_DROP > EYE[1] + 4
