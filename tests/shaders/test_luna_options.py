"""What Luna's options add to the weight and to the refracted light: rows L13, L14 and L16 of the document."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.gpu.texture import upload
from renderer.light import LightBlock
from renderer.scene.material import Texture
from renderer.water.luna import Luna, LunaScroll
from tests.reference import fresnel
from tests.reference.layering import over
from tests.renderer.drawing import shared_renderer
from tests.shaders.calling import call

WAYS = np.array([0.0, 1e-3, 0.1, 0.5, 1.0, 3.0, 20.0, 400.0, 5e4])
SCROLL = LunaScroll(offset_0=(0.0,) * 4, offset_1=(0.0,) * 4, blend_0=0.0, blend_1=0.0)


@pytest.mark.parametrize("rate", [0.0, 0.01, 0.4, 3.0, 1e3])
def test_a_way_leaves_the_same_part_a_metre(rate: float) -> None:
    left = call("lib/fresnel.glsl", "refraction_weight_left(rate, way)", rate=np.float32(rate), way=WAYS)

    assert np.abs(left - fresnel.refraction_weight_left(rate, WAYS)).max() < 2e-6
    assert left[0] == 1.0
    assert (np.diff(left) <= 0).all()
    if rate == 0:
        assert (left == 1.0).all()


def test_the_part_falls_with_the_rate() -> None:
    rates = np.linspace(0, 5, 60)
    left = call("lib/fresnel.glsl", "refraction_weight_left(rate, 1.5)", rate=rates)

    assert (np.diff(left) < 0).all()


def weight(defines: tuple[str, ...], last: str, water: Luna, **arguments: Any) -> NDArray[Any]:
    """Luna's weight of points that are looked at along v, ``last`` are the point's optional members."""
    flat = shared_renderer().device
    map_ = upload(flat, Texture("flat", np.zeros((2, 2, 2), np.float32)))
    point = f"WaterPoint(vec3(0), normalize(v), vec3(0, 1, 0), vec2(0.5), vec2(0.5), vec2(0.5), 1.0{last})"
    try:
        return call(
            "water/luna.glsl",
            f"luna_weight({point}, vec3(0, 1, 0))",
            defines=defines,
            blocks=[water, SCROLL, LightBlock()],
            textures={"normal_map_0": map_, "normal_map_1": map_},
            **arguments,
        )
    finally:
        map_.release()


def test_the_weight_falls_with_depth_and_with_distance_by_their_own_rates() -> None:
    views = np.random.default_rng(2).uniform([-1, 0.05, -1], [1, 1, 1], (60, 3))
    cosine = views[:, 1] / np.linalg.norm(views, axis=1)
    depth, distance = np.linspace(0, 4, 60), np.linspace(30, 1, 60)
    water = Luna(depth_fade=0.7, distance_fade=0.05, refraction_bias=-0.1)
    defines = ("NEEDS_DEPTH", "NEEDS_DISTANCE")
    faded = weight(defines, ", depth, way", water, v=views, depth=depth, way=distance)
    plain = 1 - fresnel.luna_reflection_weight(cosine, -0.1, 2.0)
    left = fresnel.refraction_weight_left(0.7, depth) * fresnel.refraction_weight_left(0.05, distance)

    assert np.abs(faded - plain * left).max() < 3e-6
    assert np.abs(weight((), "", water, v=views) - plain).max() < 3e-6


@pytest.mark.parametrize("name", ["depth", "distance"])
def test_the_weight_never_rises_on_the_way_and_ends_at_reflection(name: str) -> None:
    way = np.array([0.0, 0.01, 0.2, 1.0, 5.0, 60.0, 4e3], np.float32)
    water = Luna(depth_fade=0.3, distance_fade=0.3, refraction_bias=1.0)
    fallen = weight((f"NEEDS_{name.upper()}",), ", way", water, v=np.tile([0.1, 0.9, 0.0], (7, 1)), way=way)

    assert fallen[0] == 1.0
    assert (np.diff(fallen) < 0).all() or fallen[-1] == 0.0
    assert fallen[-1] < 1e-6


def test_a_layer_covers_by_its_alpha_times_opacity() -> None:
    rng = np.random.default_rng(4)
    beneath, layer = rng.uniform(0, 3, (50, 3)), rng.uniform(0, 1, (50, 4))
    linear = over(np.zeros((50, 3)), np.concatenate([layer[:, :3], np.ones((50, 1))], axis=1), 1.0)
    above = np.concatenate([linear * layer[:, 3:], layer[:, 3:]], axis=1)
    for opacity in (0.0, 0.3, 1.0):
        seen = call("lib/layering.glsl", "layered(b, a, o)", "vec3", b=beneath, a=above, o=np.float32(opacity))

        assert np.abs(seen - over(beneath, layer, opacity)).max() < 2e-6
        if opacity == 0:
            assert np.array_equal(seen, beneath.astype(np.float32))


def test_the_distance_is_from_the_eye_or_along_a_parallel_view() -> None:
    rng = np.random.default_rng(5)
    places = rng.uniform(-50, 50, (40, 3))
    eye, back = np.array([3.0, 7.0, -2.0]), np.array([0.36, 0.48, 0.8])
    near = call("lib/projection.glsl", "distance_to_eye(p, e, 0.0)", p=places, e=np.tile([*eye, 1.0], (40, 1)))
    reach = np.full(40, eye @ back)
    parallel = call(
        "lib/projection.glsl", "distance_to_eye(p, e, r)", p=places, e=np.tile([*back, 0.0], (40, 1)), r=reach
    )

    assert np.abs(near - np.linalg.norm(places - eye, axis=1)).max() < 2e-5
    assert np.abs(parallel - (eye - places) @ back).max() < 2e-5
