"""The height field: a warped grid, adaptive triangles without cracks, tiles, stones."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene import rocks, terrain
from renderer.scene.mesh import Mesh
from renderer.scene.noise import Floats, grid_fbm

AXIS = terrain.Axis(129)


@pytest.fixture(scope="module")
def height() -> Floats:
    """Hills of a few metres."""
    return 3 * grid_fbm(AXIS.world, AXIS.world, 20.0, 1, octaves=4)


@pytest.fixture(scope="module")
def error(height: Floats) -> Floats:
    """The split errors of the hills, every point of one weight."""
    return terrain.split_errors(height, np.ones_like(height), np.full_like(height, 1e9))


def cracks(index: NDArray[np.int64], size: int) -> int:
    """Edges inside the grid that do not belong to exactly two triangles."""
    edges = np.sort(np.concatenate([index[:, [0, 1]], index[:, [1, 2]], index[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    row, column = unique // size, unique % size
    is_border = np.zeros(len(unique), bool)
    for line in (row, column):
        is_border |= ((line == 0) | (line == size - 1)).all(axis=1) & (line[:, 0] == line[:, 1])
    return int((count[~is_border] != 2).sum() + (count[is_border] != 1).sum())


def doubled_area(index: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Twice each triangle's area in grid cells, positive where it faces up."""
    place = np.stack([index // size, index % size], axis=2)
    one, two = place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]
    return one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]


def test_the_axis_and_its_parameter_are_inverse_and_fine_in_the_middle() -> None:
    parameter = np.linspace(-1, 1, 21)
    np.testing.assert_allclose(AXIS.parameter(AXIS.at(parameter)), parameter, atol=1e-12)
    np.testing.assert_allclose(AXIS.world[[0, -1]], [-96, 96])
    assert AXIS.spacing[64] < AXIS.spacing[0] / 5
    texels = AXIS.texels(64)
    np.testing.assert_allclose(texels.world, -texels.world[::-1], atol=1e-12)
    assert -96 < texels.world[0] < -85


def test_sampling_gives_the_grid_back_and_its_edge_beyond(height: Floats) -> None:
    x, z = np.meshgrid(AXIS.world, AXIS.world)
    np.testing.assert_allclose(terrain.sampled(AXIS, height, x, z), height, atol=1e-4)
    far = terrain.sampled(AXIS, height, np.array([500.0]), np.array([-500.0]))
    np.testing.assert_allclose(far, height[0, -1], atol=1e-5)


def test_upsampling_keeps_the_samples() -> None:
    coarse = grid_fbm(AXIS.coarser(8).world, AXIS.coarser(8).world, 30.0, 2)
    np.testing.assert_allclose(terrain.upsampled(coarse, AXIS.count)[::8, ::8], coarse, atol=1e-5)


@pytest.mark.parametrize("triangles", [2, 60, 900, 6000])
def test_every_level_of_detail_covers_the_square_without_cracks(error: Floats, triangles: int) -> None:
    index = terrain.fitted(error, triangles)
    area = doubled_area(index, AXIS.count)
    assert len(index) <= triangles
    assert len(index) > 0.9 * triangles - 4
    assert (area > 0).all()
    assert area.sum() == 2 * 128**2
    assert cracks(index, AXIS.count) == 0


def test_a_crack_would_be_seen(error: Floats) -> None:
    loose = error.copy()
    loose[64, 96] = 0  # a corner that its neighbours' splits need
    assert cracks(terrain.triangulated(loose, 0.05), AXIS.count) > 0


def test_no_corner_left_out_is_missed_by_more_than_the_threshold(height: Floats, error: Floats) -> None:
    threshold = 0.2
    used = np.unique(terrain.triangulated(error, threshold))
    left_out = np.setdiff1d(np.arange(AXIS.count**2), used)
    assert error.ravel()[left_out].max() <= threshold
    assert error.ravel()[np.setdiff1d(used, _corners())].min() > threshold
    finer = np.unique(terrain.triangulated(error, threshold / 4))
    assert np.isin(used, finer).all()


def test_the_cap_bounds_the_longest_edge(height: Floats) -> None:
    error = terrain.split_errors(height * 0, np.ones_like(height), np.full_like(height, 9.0))
    index = terrain.triangulated(error, 0.1)
    place = np.stack([index // AXIS.count, index % AXIS.count], axis=2)
    edges = np.linalg.norm(place - np.roll(place, 1, axis=1), axis=2)
    assert edges.max() <= 9.0


def test_what_the_cap_forces_is_made_past_the_wanted_number(height: Floats) -> None:
    error = terrain.split_errors(height * 0, np.ones_like(height), np.full_like(height, 9.0))
    assert len(terrain.fitted(error, 100)) == len(terrain.triangulated(error, 0.1)) > 100


def test_normals_are_unit_and_lean_downhill() -> None:
    slope = np.broadcast_to(0.5 * AXIS.world.astype(np.float32), (AXIS.count, AXIS.count))
    normal = terrain.grid_normals(AXIS, np.ascontiguousarray(slope))
    np.testing.assert_allclose(np.linalg.norm(normal, axis=2), 1, atol=1e-5)
    np.testing.assert_allclose(normal[64, 64], np.array([-0.5, 1, 0]) / 1.25**0.5, atol=1e-3)


def test_tiles_hold_every_triangle_once(height: Floats, error: Floats) -> None:
    x, z = np.meshgrid(AXIS.world, AXIS.world)
    position = np.stack([x, height, z], axis=2).reshape(-1, 3)
    vertices = Mesh.build(position, np.zeros((0, 3), np.uint32), normal=position * 0 + [0, 1, 0])
    index = terrain.fitted(error, 3000)
    tiles = terrain.tiled(vertices, index, 4, AXIS.reach)
    assert sum(len(tile.index) for tile in tiles.values()) == len(index)
    corners = np.concatenate([tile.position[tile.index].reshape(-1, 9) for tile in tiles.values()])
    whole = vertices.position[index].reshape(-1, 9)
    np.testing.assert_array_equal(corners[np.lexsort(corners.T)], whole[np.lexsort(whole.T)])


@pytest.mark.parametrize("level", [0, 1, 2])
def test_stones_are_closed_face_outwards_and_stand_in_the_ground(level: int) -> None:
    placed = [
        rocks.Stone(3.0, -2.0, (0.5, 0.3, 0.4), 30.0, 0.3),
        rocks.Stone(-1.0, 4.0, (1.0, 0.8, 0.9), 200.0, top=0.7),
    ]
    mesh = rocks.stones(placed, 5, level, lambda x, z: 0.1 * x + 0 * z)
    middles = np.array([[3.0, 0.0, -2.0], [-1.0, 0.0, 4.0]])
    corners = mesh.position[mesh.index].astype(float)
    owner = np.linalg.norm(corners.mean(axis=1)[:, None, [0, 2]] - middles[None][..., [0, 2]], axis=2).argmin(axis=1)
    centre = np.stack([corners[owner == k].mean(axis=(0, 1)) for k in (0, 1)])[owner]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert len(mesh.index) == 2 * 20 * 4**level
    assert (np.einsum("ij,ij->i", face, corners.mean(axis=1) - centre) > 0).mean() > 0.97
    assert np.isfinite(mesh.normal).all()
    np.testing.assert_allclose(corners[owner == 1][..., 1].max(), 0.7, atol=1e-5)
    assert corners[owner == 0][..., 1].min() < 0.3


def _corners() -> NDArray[np.int64]:
    last = AXIS.count - 1
    return np.array([0, last, last * AXIS.count, AXIS.count**2 - 1])
