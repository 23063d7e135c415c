"""The rippled clouds: a tile of 256 texels without a seam, level on the mean, its slopes those of its height."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.water.cloud_ripples import SIZE, STEPS, cloud_ripple_slopes, filtered, rippled_clouds

SEEDS = [0, 7, 2006]


def seam_against_inside(image: NDArray[np.float64], axis: int) -> float:
    """The steps across a tile's edge over those within it, both root mean square."""
    step = np.abs(image - np.roll(image, 1, axis)) ** 2
    return float(np.sqrt(step.take(0, axis).mean() / step.take(range(1, image.shape[axis]), axis).mean()))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("axis", [0, 1])
def test_the_tile_has_no_seam(seed: int, axis: int) -> None:
    slopes = cloud_ripple_slopes(seed).image.astype(np.float64)
    columns = np.abs(slopes - np.roll(slopes, 1, axis)).mean(axis=(1 - axis, 2))

    assert seam_against_inside(slopes, axis) < 1.5
    assert columns[0] < columns[1:].max(), "the edge is like any other row"


def test_a_seam_would_be_seen() -> None:
    cut = cloud_ripple_slopes(0).image[: SIZE // 2 + 9].astype(np.float64)

    assert seam_against_inside(cut, 0) > 2.5


@pytest.mark.parametrize("seed", SEEDS)
def test_the_map_has_the_documents_size_and_no_tilt_at_all(seed: int) -> None:
    image = cloud_ripple_slopes(seed).image

    assert image.shape == (256, 256, 2)
    assert image.dtype == np.float32
    assert image.astype(np.float64).sum(axis=(0, 1)).tolist() == [0.0, 0.0]


def test_slopes_are_ten_times_the_heights_rise_a_texel() -> None:
    ramp = np.zeros((SIZE, SIZE), np.int64)
    ramp[:, 10:20] = np.arange(1, 11) * 655
    slope = filtered(ramp)

    np.testing.assert_allclose(slope[:, 11:19, 0], 10 * 655 / STEPS, rtol=1e-4)
    np.testing.assert_array_equal(slope[..., 1], 0)
    np.testing.assert_array_equal(filtered(ramp.T)[..., 1], slope[..., 0].T)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_map_is_the_filtered_clouds(seed: int) -> None:
    height = rippled_clouds(seed)
    slopes = cloud_ripple_slopes(seed).image

    assert (height.min(), height.max()) == (0, STEPS)
    np.testing.assert_array_equal(slopes, filtered(height))
    assert 0.1 < slopes.std() < 0.3, "rough enough to move what is seen by its scale, without breaking"


def test_ripples_bend_the_clouds(monkeypatch: pytest.MonkeyPatch) -> None:
    rippled = filtered(rippled_clouds(0))
    monkeypatch.setattr("renderer.water.cloud_ripples.DISPLACEMENT", 0.0)
    plain = filtered(rippled_clouds(0))

    assert np.ptp(rippled) > 1.5 * np.ptp(plain)


def test_the_map_is_a_function_of_its_seed() -> None:
    first = cloud_ripple_slopes(3).image.copy()
    cloud_ripple_slopes.cache_clear()

    np.testing.assert_array_equal(cloud_ripple_slopes(3).image, first)
    assert np.abs(cloud_ripple_slopes(4).image - first).max() > 0.2
    assert cloud_ripple_slopes(3).name != cloud_ripple_slopes(4).name
