"""What `water/luna.glsl` defines besides the library: rows L6, L7 and L8 of the document."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.gpu.texture import GpuTexture, upload
from renderer.light import LightBlock
from renderer.scene.material import Texture
from renderer.water.luna import Luna, LunaScroll
from renderer.water.normal_maps import SLOPE
from tests.reference import normals
from tests.renderer.drawing import shared_renderer
from tests.shaders.calling import call

SCROLL = LunaScroll(offset_0=(0.0,) * 4, offset_1=(0.0,) * 4, blend_0=0.0, blend_1=0.0)


def tilted(slope: tuple[float, float]) -> GpuTexture:
    """A ripple map that is one slope everywhere."""
    image = np.broadcast_to(np.array(slope, np.float32), (4, 4, 2)).copy()
    return upload(shared_renderer().device, Texture(f"slope {slope}", image))


@pytest.fixture
def tilt() -> Iterator[Any]:
    """Makes ripple maps of one slope, and frees them."""
    made: list[GpuTexture] = []

    def make(slope: tuple[float, float]) -> GpuTexture:
        made.append(tilted(slope))
        return made[-1]

    yield make
    for texture in made:
        texture.release()


def luna(
    expression: str, result: str, *, textures: dict[str, Any] | None = None, water: Luna | None = None, **arguments: Any
) -> NDArray[Any]:
    """Call a function of Luna's shader."""
    blocks = [water or Luna(), SCROLL, LightBlock()]
    return call("water/luna.glsl", expression, result, blocks=blocks, textures=textures, **arguments)


def test_the_damping_has_the_values_of_the_document() -> None:
    v = np.array([0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0])
    damped = luna("bottom_damping(v)", "float", v=v)

    assert np.abs(damped - [1.0, 0.9990, 0.8926, 0.6513, 0.4013, 0.0956, 0.0]).max() < 6e-5
    assert np.abs(damped - normals.bottom_damping(v)).max() < 1e-6


def test_a_shift_of_a_tenth_never_leaves_the_bottom_and_a_larger_one_does() -> None:
    v = np.linspace(0, 1, 20_001)
    left = v + 0.1 * luna("bottom_damping(v)", "float", v=v).astype(np.float64)

    assert left.max() <= 1 + 1e-6
    assert (v + 0.12 * normals.bottom_damping(v)).max() > 1.0005, "the limit must be a limit"


@pytest.mark.parametrize(
    ("first", "second"), [((0.3, -0.2), (0.1, 0.4)), ((0.5, 0.0), (0.5, 0.0)), ((-2.0, 1.0), (0.1, 0.1))]
)
def test_the_normal_is_the_normalised_mean_of_two(
    tilt: Any, first: tuple[float, float], second: tuple[float, float]
) -> None:
    maps = {"normal_map_0": tilt(first), "normal_map_1": tilt(second)}
    n = luna("luna_normal(p)", "vec3", textures=maps, p=[[0.3, 0.7]])

    assert np.abs(n[0] - normals.mean_of_two(first, second)).max() < 1e-3
    assert abs(np.linalg.norm(n[0]) - 1) < 1e-6


def test_opposite_tilts_cancel_to_upright(tilt: Any) -> None:
    maps = {"normal_map_0": tilt((0.75, -0.5)), "normal_map_1": tilt((-0.75, 0.5))}

    assert np.abs(luna("luna_normal(p)", "vec3", textures=maps, p=[[0.3, 0.7]])[0] - [0, 1, 0]).max() < 1e-6


def test_no_ripple_height_is_exactly_flat(tilt: Any) -> None:
    maps = {"normal_map_0": tilt((0.75, -0.5)), "normal_map_1": tilt((0.75, -0.5))}
    n = luna("luna_normal(p)", "vec3", textures=maps, water=Luna(ripple_height=0.0), p=[[0.3, 0.7]])

    assert n.tolist() == [[0.0, 1.0, 0.0]]


def test_ripple_maps_tilt_nowhere_on_average() -> None:
    for seed in (0, 7):
        slopes = next(iter(Luna().textures(seed).values())).image
        n = normals.of_slope(slopes[::4, ::4])

        assert np.abs(slopes.mean(axis=(0, 1))).max() < 1e-6
        assert abs(float(slopes.std()) - SLOPE) < 1e-3
        assert np.abs(n.mean(axis=(0, 1))[[0, 2]]).max() < 5e-3


def test_the_shift_goes_right_and_down_by_the_horizontal_normal() -> None:
    n = normals.unit(np.array([[0.3, 0.9, 0.0], [0.0, 0.9, 0.3], [0.2, 0.9, -0.4]])).astype(np.float32)
    place = np.full((3, 2), 0.5)
    moved = luna("rippled(p, n)", "vec2", water=Luna(ripple_scale=(0.06, 0.03)), p=place, n=n)
    down = 0.5 + n[:, 2] * 0.03 * normals.bottom_damping(0.5)

    assert np.abs(moved[:, 0] - (0.5 + n[:, 0] * 0.06)).max() < 1e-6
    assert np.abs((1 - moved[:, 1]) - down).max() < 1e-6
