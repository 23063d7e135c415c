"""Luna's water by users' images, its impurities and its fades. Rows L13, L14 and L16 of Luna 2006."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import parse_qsl

import numpy as np
import pytest

from renderer.errors import InvalidRequest, MissingImage
from renderer.query import parse_query, to_query
from renderer.request import FrameRequest
from renderer.scene.images import ImageLibrary
from renderer.water.luna import Luna
from tests.reference import layering, tonemap
from tests.reference.fresnel import refraction_weight_left
from tests.renderer.drawing import (
    CAMERAS,
    FLAT,
    MIRROR,
    PLAIN,
    STEEP,
    WINDOW,
    Floats,
    asked,
    drawn,
    furthest,
    inside,
    linear,
    mask,
    picture,
)
from tests.renderer.making_images import even, file_of
from tests.renderer.world import EXTENTS, LEVEL

pytestmark = pytest.mark.usefixtures("world")

OVER: dict[str, Any] = {"position": [0.0, 30.0, 0.0], "yaw": 0.0, "pitch": -90.0, "roll": 0.0, "fov_y": 50}
"""Straight down: north is up in the picture, east to the right."""


def weight(water: dict[str, Any], **fields: Any) -> Floats:
    """The refraction weight of each pixel, 0..1, by the layer that shows the reflection's."""
    shown = drawn(**PLAIN, water={**FLAT, **water}, layers=["reflection_weight"], **fields).color[..., 0]
    return np.asarray(1 - shown / 255)


def places(camera: dict[str, Any]) -> Floats:
    """Where on the water's plane each pixel's centre looks, (h, w, 3)."""
    view = asked(camera=camera).view()
    across, down = (
        (np.arange(160) + 0.5) / 160 * 2 - 1,
        1 - (np.arange(90) + 0.5) / 90 * 2,
    )
    x, y = np.meshgrid(across, down)
    world_from_clip = np.linalg.inv(view.clip_from_world)
    ends = [np.stack([x, y, np.full_like(x, depth), np.ones_like(x)], -1) @ world_from_clip.T for depth in (0.9, 0.3)]
    near, far = (end[..., :3] / end[..., 3:] for end in ends)
    share = (LEVEL - near[..., 1]) / (far[..., 1] - near[..., 1])
    return np.asarray(near + share[..., None] * (far - near))


# ----------------------------------------------------------------------------------------- L13: the refraction bias map


@pytest.mark.parametrize("k", [0, 25, 128, 255])
def test_a_bias_map_of_one_grey_is_that_bias(images: ImageLibrary, k: int) -> None:
    card = images.put(file_of(even(k)[..., 0]), "bias_map")
    common = {"refraction_power": 3.0, "ripple_height": 1.0}
    by_map = picture(camera=STEEP, water={**common, "bias_map": card.id, "refraction_bias": -1.0})
    by_number = picture(camera=STEEP, water={**common, "refraction_bias": k / 255})

    assert furthest(by_map, by_number) <= 1
    if k:
        assert furthest(by_map, picture(camera=STEEP, water={**common, "refraction_bias": 0.0})) > 3


def test_a_bias_map_is_stretched_over_the_extents_with_its_top_to_the_north(images: ImageLibrary) -> None:
    columns, rows = np.meshgrid(np.arange(256), np.arange(256))
    for grey, axis in ((columns, 0), (rows, 2)):
        card = images.put(file_of(grey.astype(np.uint8)), "bias_map")
        shown = weight({"bias_map": card.id, "refraction_power": 64.0}, camera=STEEP)
        at = places(STEEP)
        low, high = EXTENTS[0:2] if axis == 0 else EXTENTS[2:4]
        grey_there = np.clip((at[..., axis] - low) / (high - low) * 256 - 0.5, 0, 255) / 255
        up = np.array(STEEP["eye"]) - at
        cosine = up[..., 1] / np.linalg.norm(up, axis=-1)
        expected = np.clip(grey_there + cosine**64, 0, 1)
        region = inside(mask(camera=STEEP), 2)

        assert region.sum() > 2000
        assert np.abs(shown - expected)[region].max() < 1.5 / 255


# ------------------------------------------------------------------------------------------------ L14: what it fades by


@pytest.mark.parametrize("camera", ["upright", "parallel"])
@pytest.mark.parametrize("rate", [0.02, 0.3])
def test_the_weight_falls_with_the_viewers_distance(camera: str, rate: float) -> None:
    view = CAMERAS[camera]
    shown = weight({"distance_fade": rate}, camera=view)
    plain = weight({}, camera=view)
    back = asked(camera=view).view().world_from_camera[:3, 2]
    offset = asked(camera=view).view().world_from_camera[:3, 3] - places(view)
    way = offset @ back if camera == "parallel" else np.linalg.norm(offset, axis=-1)
    region = inside(mask(camera=view), 1)

    assert region.sum() > 2000
    assert np.abs(shown - plain * refraction_weight_left(rate, way))[region].max() < 1.2 / 255


# ----------------------------------------------------------------------------------------------- L16: the colour layers


def test_a_layer_without_opacity_is_exactly_absent(images: ImageLibrary) -> None:
    card = images.put(file_of(even(250, 10, 10, 255)), "color_layer")
    layer = {"image": card.id, "opacity": 0.0}

    assert furthest(picture(camera=STEEP, water={"color_layers": [layer]}), picture(camera=STEEP)) == 0
    assert Luna(color_layers=[layer]).defines(None) == ()  # type: ignore[arg-type]  # as JSON has it


def test_layers_lie_over_the_refracted_light_by_alpha_times_opacity_the_first_lowest(images: ImageLibrary) -> None:
    low, high = [240, 200, 20, 102], [20, 60, 200, 255]
    cards = [images.put(file_of(even(*color)), "color_layer") for color in (low, high)]
    layers = [{"image": cards[0].id}, {"image": cards[1].id, "opacity": 0.25}]
    shown = picture(camera=STEEP, water={**WINDOW, "color_layers": layers})
    beneath = linear(picture(camera=STEEP, water=WINDOW))
    first = layering.over(beneath, np.array(low) / 255, 1.0)
    expected = 255 * tonemap.srgb(layering.over(first, np.array(high) / 255, 0.25))
    region = mask(camera=STEEP)

    assert np.abs(shown - expected)[region].max() <= 1.2
    assert furthest(shown, picture(camera=STEEP, water=WINDOW), ~region) == 0


def test_what_is_only_reflected_shows_no_layer() -> None:
    assert (
        furthest(picture(camera=STEEP, water={**MIRROR, "color_layers": "algae"}), picture(camera=STEEP, water=MIRROR))
        == 0
    )


def test_a_layers_top_is_north_and_it_drifts_with_its_velocity(images: ImageLibrary) -> None:
    """A tile of 40 m, red in its north-western quarter, seen from straight above."""
    quarter = even(0, 0, 0, 0, size=(64, 64))
    quarter[:32, :32] = [255, 0, 0, 255]
    card = images.put(file_of(quarter), "color_layer")
    layer = {"image": card.id, "tile": 40.0, "velocity": [0.125, -0.25]}
    at = places(OVER)
    region = inside(mask(camera=OVER), 2)
    for time in (0.0, 1.0):
        shown = picture(camera=OVER, time=time, water={**WINDOW, "color_layers": [layer]})
        there = (at[..., [0, 2]] / 40 - time * np.array(layer["velocity"])) % 1.0
        is_red = np.asarray((there < 0.5).all(axis=-1))
        is_rim = (np.abs(there - 0.5) < 0.04).any(axis=-1) | (np.minimum(there, 1 - there) < 0.04).any(axis=-1)
        looks_red = np.asarray(np.equal(shown, [255, 0, 0]).all(axis=-1))

        assert (is_red & region & ~is_rim).sum() > 300
        assert np.array_equal(looks_red[region & ~is_rim], is_red[region & ~is_rim])


def test_drifting_layers_come_back_after_the_period(images: ImageLibrary) -> None:
    water = {
        "color_layers": [{"image": "algae", "velocity": [0.013, 0.021]}, {"image": "silt", "velocity": [0.3, 0.0]}]
    }
    start, middle, before, end = (picture(camera=STEEP, water=water, time=t, period=5.0) for t in (0, 2.5, 4.9999, 5))

    assert furthest(start, end) == 0
    assert furthest(start, before) <= 1
    assert furthest(start, middle) > 5


def test_the_layers_that_are_made_here_tile_and_follow_the_seed() -> None:
    for name in ("algae", "silt"):
        made = Luna(color_layers=(name,)).textures(7)["color_layer_map_0"]  # type: ignore[arg-type]  # a name is a layer
        image = made.image.astype(float)
        steps = np.abs(np.diff(image, axis=0)).mean()
        seam = np.abs(image[0] - image[-1]).mean()
        other = Luna(color_layers=(name,)).textures(8)["color_layer_map_0"]  # type: ignore[arg-type]  # as above

        assert made.wrap == "repeat"
        assert seam < 1.5 * steps
        assert 0.1 < image[..., 3].mean() / 65535 < 0.8
        assert not np.array_equal(made.image, other.image)


# -------------------------------------------------------------------------------------------------- a user's normal map


def test_a_flat_normal_map_moves_nothing(images: ImageLibrary) -> None:
    card = images.put(file_of(even(128, 128, 255, size=(16, 12))), "normal_map")
    water = {"ripple_height": 1.0, "ripple_scale": [0.2, 0.2]}

    assert (
        furthest(picture(water={**water, "normal_map": card.id}), picture(water={**water, "ripple_height": 0.0})) == 0
    )


def test_a_normal_map_of_one_tilt_shifts_the_map_by_scale_times_normal(images: ImageLibrary) -> None:
    """Red 128 + 127 * 0.6 and blue 128 + 127 * 0.8: the normal (0.6, 0.8, 0), eight pixels to the right."""
    card = images.put(file_of(even(204, 128, 230)), "normal_map")
    scale = 8 / 160 / (76 / np.hypot(76, 102))
    flat = picture(camera=STEEP, water=WINDOW)
    water = {**WINDOW, "ripple_height": 1.0, "normal_map": card.id, "ripple_scale": [scale, 0.0]}
    shown = picture(camera=STEEP, water=water)
    region = inside(mask(camera=STEEP), 10)
    region[:, -10:] = False

    assert region.sum() > 2000
    assert furthest(shown, np.roll(flat, -8, axis=1), region) <= 2
    assert furthest(shown, flat, region) > 50


# ------------------------------------------------------------------------------------------------------------- asking


def test_nothing_is_compiled_or_read_for_what_is_not_asked_for() -> None:
    assert Luna().defines(None) == ()
    assert set(Luna().textures(0)) == {"normal_map_0", "normal_map_1"}
    assert not Luna().images()
    assert not Luna(distance_fade=1.0).needs_depth
    assert Luna(depth_fade=1.0).needs_depth


def test_a_frame_whose_image_is_gone_says_which(images: ImageLibrary) -> None:
    with pytest.raises(MissingImage, match=f"normal_map {'a' * 64} is not in this machine's library"):
        drawn(water={"normal_map": "a" * 64})


@pytest.mark.parametrize(
    ("water", "path", "bound"),
    [
        ({"normal_map": "waves"}, "water.normal_map", "'ripples' or the id of an uploaded normal_map (64 hex digits)"),
        ({"bias_map": "A" * 64}, "water.bias_map", "the id of an uploaded bias_map (64 hex digits)"),
        ({"color_layers": ["moss"]}, "water.color_layers.0.image", "'algae' or 'silt' or the id of an uploaded color_"),
        ({"color_layers": [{"image": "silt", "opacity": 2}]}, "water.color_layers.0.opacity", "<= 1.0"),
        ({"color_layers": ["silt"] * 3}, "water.color_layers", "length <= 2"),
        ({"depth_fade": -1}, "water.depth_fade", ">= 0.0"),
        ({"distance_fade": float("nan")}, "water.distance_fade", "a finite number"),
    ],
)
def test_a_mistake_is_named(water: dict[str, Any], path: str, bound: str) -> None:
    with pytest.raises(InvalidRequest) as refusal:
        asked(water=water)
    (problem,) = refusal.value.problems

    assert problem.path == path
    assert bound in (problem.bound or "")


@pytest.mark.parametrize("name", ["1" * 64, "1e" * 32, "f" * 64])
def test_a_query_says_the_same(name: str) -> None:
    """Ids that look like numbers are names still; null is none."""
    layers = [{"image": name, "opacity": 0.5, "tile": 3.0}, {"image": "algae"}]
    for query, water in (
        (f"water.bias_map={name}&water.normal_map={name}", {"bias_map": name, "normal_map": name}),
        ("water.bias_map=null", {"bias_map": None}),
        ("water.color_layers=algae", {"color_layers": ["algae"]}),
        ("water.color_layers=algae,silt&water=luna", {"color_layers": ["algae", "silt"]}),
        (f"water.color_layers={json.dumps(layers)}", {"color_layers": layers}),
        (f"water.color_layers={'c' * 64}", {"color_layers": ["c" * 64]}),
        ("water.color_layers=[]", {}),
    ):
        by_query = FrameRequest.parse(parse_query(parse_qsl(query)))
        assert by_query == FrameRequest.parse({"water": water})
        assert FrameRequest.parse(parse_query(parse_qsl(to_query(by_query)))) == by_query


def test_a_layer_by_its_name_is_the_layer_with_its_defaults() -> None:
    short, long = asked(water={"color_layers": "silt"}), asked(water={"color_layers": [{"image": "silt"}]})

    assert short.key() == long.key() == asked(water={"color_layers": ["silt"]}).key()


def test_the_weight_falls_with_the_depth_of_the_water() -> None:
    plain, less, least = (weight({"depth_fade": rate}, camera=STEEP) for rate in (0.0, 0.3, 1.0))
    region = inside(mask(camera=STEEP), 2)

    assert (plain >= less)[region].all()
    assert (less >= least)[region].all()
    assert plain[region].mean() > less[region].mean() + 0.1 > least[region].mean() + 0.2
