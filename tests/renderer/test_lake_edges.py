"""Natural edges: blending, the key, the tint. Rows E1 to E7 of Habib 2009b.

Each check is seen to fail where the shader or a map is broken in the way that it is there to catch.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.gpu.texture import upload
from renderer.scene.material import Texture
from renderer.water.lake_edges import LakeEdges
from tests.reference import lake
from tests.renderer.drawing import (
    broken_shaders,
    drawn,
    furthest,
    linear,
    mask,
    picture,
    shared_renderer,
)
from tests.renderer.world import DRY
from tests.shaders.calling import call

pytestmark = pytest.mark.usefixtures("world")

EDGES: dict[str, Any] = {"technique": "lake_edges", "spec_alpha": 0.0, "dull_blend_factor": 1.0}
ROUGH: dict[str, Any] = {**EDGES, "wave_height": 0.6}
SHORE: dict[str, Any] = {"eye": [13.0, 7.0, 0.0], "target": [6.0, 0.25, 0.0], "fov_y": 60}
"""Looks along a shore."""


def invalid(water: dict[str, Any], **fields: Any) -> NDArray[np.bool_]:
    """The pixels of water that the key cuts off."""
    layer = drawn(water=water, msaa=1, layers=["validity"], **{"camera": SHORE, **fields}).color[..., 0]
    assert set(np.unique(layer)) <= {0, 255}
    return np.asarray((layer == 0) & mask(water=water, **{"camera": SHORE, **fields}))


def through(water: dict[str, Any], **fields: Any) -> int:
    """How far cut-off pixels are from the scene behind, in steps of 255."""
    gone = invalid(water, **fields)
    assert gone.sum() > 30
    behind = picture(camera=SHORE, water={**water, "extents": DRY}, **fields)
    return furthest(picture(camera=SHORE, water=water, **fields), behind, gone)


# ------------------------------------------------------------------------------------------------- E1, E5: transparency


@pytest.mark.parametrize("as_published", [False, True])
@pytest.mark.parametrize("key", ["color", "alpha"])
def test_where_a_map_shows_nothing_the_scene_behind_is_seen(as_published: bool, key: str) -> None:
    assert through({**ROUGH, "as_published": as_published, "key": key}) == 0


def test_a_highlight_is_not_seen_where_the_water_is_cut_off() -> None:
    bright = {**ROUGH, "spec_alpha": 1.0, "spec_power": 1.0, "as_published": True}

    assert through(bright) == 0


def test_opaque_cuts_are_caught() -> None:
    change = ("float opacity = lake_edges.dull_blend_factor * validity", "float opacity = 1.0")
    with broken_shaders({"water/lake_edges.glsl": change}):
        assert through({**ROUGH, "as_published": True}) > 50


def test_higher_waves_cut_off_more() -> None:
    cut = [int(invalid({**EDGES, "wave_height": height}).sum()) for height in (0.0, 0.05, 0.2, 0.8)]

    assert cut == sorted(cut)
    assert cut[3] > 2 * cut[1] > 0


# ---------------------------------------------------------------------------------------------- E2, E4, T15: the key


def keyed(value: float, **fields: Any) -> float:
    """The validity that a place of a map has where it shows one displayed grey, drawn in full."""
    water = LakeEdges(**fields)
    held = value if water.as_published else float(linear(np.array([255 * value]))[0])
    image = np.full((4, 4, 4), held, np.float32)
    image[..., 3] = 1.0
    grey = upload(shared_renderer().device, Texture(f"grey {held}", image))
    try:
        result = call(
            "water/lake_edges.glsl",
            "map_validity(texture(refraction_map, p), 0.0)",
            defines=water.defines(None),
            blocks=[water, *water.blocks(0.0, None)],
            textures={"refraction_map": grey},
            p=[[0.5, 0.5]],
        )
    finally:
        grey.release()
    return float(result[0])


@pytest.mark.parametrize("as_published", [False, True])
def test_the_key_is_a_tenth_of_the_three_channels_sum_as_displayed(as_published: bool) -> None:
    assert keyed(0.03, as_published=as_published) == 0
    assert keyed(0.04, as_published=as_published) == 1
    assert keyed(0.03, as_published=as_published, key="alpha") == 1
    assert keyed(0.03, as_published=as_published, key_threshold=0.05) == 1
    assert keyed(0.0, as_published=as_published, key_threshold=0.0) == 1


@pytest.mark.parametrize("as_published", [False, True])
def test_at_night_white_is_what_shows_nothing(as_published: bool) -> None:
    night = {"as_published": as_published, "clear_color": (1.0, 1.0, 1.0)}

    assert keyed(0.97, **night) == 0
    assert keyed(0.96, **night) == 1
    assert keyed(0.0, **night) == 1


@pytest.mark.parametrize(
    ("value", "change"),
    [
        (0.04, ("apart.r + apart.g + apart.b", "apart.r")),
        (0.03, ("lake_displayed(read.rgb) - lake_displayed(", "read.rgb - (")),
    ],
)
def test_another_key_fails(value: float, change: tuple[str, str]) -> None:
    right = [keyed(value, as_published=False), keyed(value + 0.01, as_published=False)]
    with broken_shaders({"water/lake_edges.glsl": change}):
        assert [keyed(value, as_published=False), keyed(value + 0.01, as_published=False)] != right


def test_dark_things_are_keyed_out_by_colour_and_kept_by_alpha() -> None:
    dark: dict[str, Any] = {"sun": None, "ambient": [0.001, 0.001, 0.001]}
    shares = [invalid({**EDGES, "wave_height": 0.0, "key": key}, **dark).sum() for key in ("color", "alpha")]

    assert shares[0] > 0.9 * mask(camera=SHORE).sum()
    assert shares[1] < 0.02 * mask(camera=SHORE).sum()


def test_a_night_scene_keeps_its_dark_water_under_a_white_clear_colour() -> None:
    dark: dict[str, Any] = {"sun": None, "ambient": [0.001, 0.001, 0.001], "sky": DARK}
    for as_published in (False, True):
        black = {**ROUGH, "as_published": as_published}
        white = {**black, "clear_color": [1.0, 1.0, 1.0]}
        water = mask(camera=SHORE).sum()

        assert invalid(black, **dark).sum() > 0.9 * water
        assert 30 < invalid(white, **dark).sum() < 0.2 * water


DARK = {"model": "constant", "color": [0.002, 0.002, 0.004]}


# ------------------------------------------------------------------------------------------------------- E5, E7: tint


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("as_published", [False, True])
def test_the_factor_dims_the_tinted_water_and_lets_the_scene_through(factor: float, as_published: bool) -> None:
    water = {**EDGES, "wave_height": 0.0, "as_published": as_published, "key": "alpha"}
    plain = picture(camera=SHORE, water={**water, "tint": [1.0, 1.0, 1.0]})
    behind = picture(camera=SHORE, water={**water, "extents": DRY})
    shown = picture(camera=SHORE, water={**water, "dull_blend_factor": factor})
    region = mask(camera=SHORE) & ~invalid(water)
    combined, scene, result = (c / 255 if as_published else linear(c) for c in (plain, behind, shown))
    rgba = lake.tinted(combined, np.ones(combined.shape[:2]), factor)
    expected = lake.over(np.minimum(rgba[..., :3], 1.0), rgba[..., 3], scene)

    if as_published:
        assert 255 * np.abs(result - expected)[region].max() <= 2.0
    else:
        assert np.abs(result - expected)[region].max() < 0.012
    assert factor > 0 or furthest(shown, behind, region) == 0


def test_every_fresnel_mode_but_the_second_is_the_first() -> None:
    shown = [picture(camera=SHORE, water={**EDGES, "fresnel_mode": mode}) for mode in (0, 1, 2)]

    assert furthest(shown[0], shown[2]) == 0
    assert furthest(shown[0], shown[1]) > 10


# ---------------------------------------------------------------------------------------------- what may be asked of it

OTHER: dict[str, Any] = {
    "key": "alpha",
    "key_threshold": 1.2,
    "tint": [0.5, 1.0, 1.0],
    "dull_blend_factor": 0.3,
    "clear_color": [0.2, 0.18, 0.1],
    "wave_height": 0.1,
    "reflection_clip_bias": 1.0,
    "wave_length": 0.3,
    "wind_force": -13.0,
    "wind_direction": 30.0,
    "draw_mode": 3.0,
}


@pytest.mark.parametrize("name", sorted(OTHER))
def test_every_parameter_changes_the_water_and_nothing_else(name: str) -> None:
    base = {"technique": "lake_edges", "wave_height": 0.6, "key_threshold": 0.9 if name == "key" else 0.5}
    view: dict[str, Any] = {"camera": SHORE, "time": 2.0}
    plain, other = (picture(**view, water=w) for w in (base, {**base, name: OTHER[name]}))
    region = mask(**view)

    assert furthest(plain, other, region) > 3
    assert furthest(plain, other, ~region) == 0
