"""Noise against its twin, and the clouds that are made of it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.reference import noise
from tests.shaders.calling import call

Floats = NDArray[np.float64]

NOISE = "lib/noise.glsl"
CLOUDS = "lib/clouds.glsl"


def places(width: int, seed: int) -> Floats:
    """Random places (4000, width) of all signs, exact in 32 bits."""
    return np.random.default_rng(seed).uniform(-900, 900, (4000, width)).astype(np.float32).astype(np.float64)


def test_hashes_are_their_twins_bit_for_bit() -> None:
    words = np.random.default_rng(1).integers(0, 2**32, 500, dtype=np.uint32)
    cells = np.random.default_rng(2).integers(-(2**20), 2**20, (500, 3))

    mixed = [noise.hash_uint(int(word)) for word in words]
    np.testing.assert_array_equal(call(NOISE, "hash_uint(w)", "uint", w=words), mixed)
    found = call(NOISE, "hash_cell(ivec3(c), 7u)", "uint", c=cells.astype(np.float64))
    np.testing.assert_array_equal(found, noise.hash_cell(cells, 7))


@pytest.mark.parametrize("width", [2, 3])
def test_noise_is_its_twin(width: int) -> None:
    p = places(width, 3)

    np.testing.assert_allclose(call(NOISE, "gradient_noise(p, 5u)", p=p), noise.gradient_noise(p, 5), atol=3e-6)
    # Octaves turn and double the place: the last one has lost three digits of its fraction.
    np.testing.assert_allclose(call(NOISE, "fbm(p, 3.5, 5u)", p=p / 50), noise.fbm(p / 50, 3.5, 5), atol=3e-5)


def test_value_noise_is_its_twin_and_stays_in_its_range() -> None:
    p = places(2, 4)
    found = call(NOISE, "value_noise(p, 9u)", p=p)

    np.testing.assert_allclose(found, noise.value_noise(p, 9), atol=3e-6)
    assert found.min() >= 0
    assert found.max() < 1
    assert abs(found.mean() - 0.5) < 0.02


def test_noise_has_no_lattice_lines() -> None:
    axis = np.arange(-32, 32)
    cells = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3).astype(np.float64)
    sign = np.where(call(NOISE, "unit_float(hash_cell(ivec3(c), 3u))", c=cells) < 0.5, -1.0, 1.0)
    power = np.abs(np.fft.fftn(sign.reshape(64, 64, 64))) ** 2 / sign.size

    assert power.max() < 25  # white noise: exp(-25) * 262,144 cells = 4e-6; a bare xor of primes has peaks over 1,000
    bare = ((cells.astype(np.int64) * noise.PRIMES) & 0xFFFFFFFF).astype(np.uint32)
    lined = np.where((bare[:, 0] ^ bare[:, 1] ^ bare[:, 2]) >> 31, -1.0, 1.0).reshape(64, 64, 64)
    assert (np.abs(np.fft.fftn(lined)) ** 2 / lined.size).max() > 1000


def test_phase_functions_of_clouds_scatter_all_the_light_once() -> None:
    c, w = np.polynomial.legendre.leggauss(400)
    for phase in ("droplet_phase(c)", "diffuse_phase(c)"):
        assert abs(2 * np.pi * (w * call(CLOUDS, phase, c=c)).sum() - 1) < 1e-4


@pytest.mark.parametrize("coverage", [0.1, 0.35, 0.6, 0.9])
def test_clouds_cover_their_share(coverage: float) -> None:
    at = np.random.default_rng(14).uniform(-400, 400, (40_000, 2))
    column = call(CLOUDS, "cumulus_column(p, c, 3.0, 11u)", p=at, c=coverage)

    assert abs((column > 0).mean() - coverage) < 0.03


def test_no_cloud_where_none_is_wanted_and_no_gap_where_all_is() -> None:
    at = np.random.default_rng(15).uniform(-400, 400, (40_000, 2))

    assert call(CLOUDS, "cirrus_depth(p, 0.0, 1u)", p=at).max() == 0
    assert (call(CLOUDS, "cumulus_column(p, 0.0, 3.0, 1u)", p=at) > 0).mean() < 1e-3
    assert (call(CLOUDS, "cumulus_column(p, 1.0, 3.0, 1u)", p=at) < 0).mean() < 2e-3
