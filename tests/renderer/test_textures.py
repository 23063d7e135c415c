"""Noise and tiling textures: seeded, seamless, neutral."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene import textures
from renderer.scene.noise import grid_fbm, grid_noise, hashed, point_noise, smoothstep

SIZE = 256
DETAILS = [textures.ground_detail, textures.rock_detail, textures.wood_detail, textures.canopy_detail]
Draw = Callable[[int, int], NDArray[np.uint8]]


def test_the_hash_gives_the_values_that_every_machine_gives() -> None:
    values = (hashed(7, np.arange(4), np.arange(4)) * 2**24).astype(int)
    assert values.tolist() == [2249354, 9238906, 13259924, 5889197]


def test_the_hash_is_uniform_and_knows_negative_cells() -> None:
    values = hashed(1, np.arange(-200, 200)[None], np.arange(-200, 200)[:, None])
    assert abs(values.mean() - 0.5) < 0.005
    assert abs(values.std() - 12**-0.5) < 0.005
    assert len(np.unique(values)) > 0.99 * values.size


def test_noise_has_mean_zero_and_deviation_one_half() -> None:
    axis = np.linspace(0, 100, 400)
    for noise in (grid_noise(axis, axis, 1.0, 3), grid_fbm(axis, axis, 4.0, 3, octaves=3)):
        assert abs(noise.mean()) < 0.05
        assert abs(noise.std() - 0.5) < 0.08


def test_periodic_noise_repeats_and_other_noise_does_not() -> None:
    axis = np.linspace(0, 8, 50)
    tile = grid_noise(axis, axis, 1.0, 5, period=(8.0, 8.0))
    np.testing.assert_allclose(grid_noise(axis + 8, axis - 16, 1.0, 5, period=(8.0, 8.0)), tile, atol=1e-5)
    assert np.abs(grid_noise(axis + 8, axis, 1.0, 5) - tile).max() > 0.5


def test_noise_at_points_is_smooth_and_bounded() -> None:
    line = np.stack([np.linspace(0, 20, 4001), np.full(4001, 0.3), np.full(4001, -7.7)], axis=1)
    values = point_noise(line, 1.0, 2)
    assert np.abs(values).max() <= 1
    assert np.abs(np.diff(values)).max() < 0.02


def test_smoothstep_runs_either_way() -> None:
    ramp = np.array([-1.0, 0.0, 0.5, 1.0, 2.0], np.float32)
    np.testing.assert_allclose(smoothstep(0, 1, ramp), [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(smoothstep(1, 0, ramp), [1, 1, 0.5, 0, 0])


@pytest.mark.parametrize("draw", DETAILS)
def test_a_detail_is_neutral_on_the_mean_and_in_every_quarter(draw: Draw) -> None:
    image = draw(SIZE, 3).astype(float)
    quarters = image.reshape(2, SIZE // 2, 2, SIZE // 2, 4).mean(axis=(1, 3))
    assert np.abs(quarters[..., :2] - 127.5).max() < 3
    assert np.abs(quarters[..., 2:] - 127.5).max() < 3
    assert image[..., 2].std() > 4


@pytest.mark.parametrize("draw", DETAILS)
def test_a_detail_has_no_seam(draw: Draw) -> None:
    image = draw(SIZE, 3).astype(float)
    for axis in (0, 1):
        seam = np.abs(image - np.roll(image, 1, axis=axis))
        edge, inside = seam.take(0, axis=axis).mean(), seam.mean()
        assert edge < 1.35 * inside


def test_a_seam_would_be_seen() -> None:
    image = textures.rock_detail(SIZE, 3)[: SIZE // 2 + 9].astype(float)
    seam = np.abs(image - np.roll(image, 1, axis=0))
    assert seam[0].mean() > 1.35 * seam.mean()


@pytest.mark.parametrize("draw", DETAILS)
def test_a_detail_is_a_function_of_its_seed(draw: Draw) -> None:
    first = draw(64, 3)
    np.testing.assert_array_equal(draw(64, 3), first)
    assert (draw(64, 4) != first).mean() > 0.3


def test_slopes_belong_to_the_height() -> None:
    height, _ = textures.pebbles(64, 1, radii=((12.0, 1),))
    image = textures.packed(height, 1.0, height * 0 + np.float32(0.5)).astype(float) / 127.5 - 1
    row, column = np.unravel_index(int(height.argmax()), height.shape)
    assert image[row, (column + 6) % 64, 0] > 0.1
    assert image[row, (column - 6) % 64, 0] < -0.1
    assert image[(row + 5) % 64, column, 1] > 0.05
