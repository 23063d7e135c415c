"""The maps: where they look from, what they keep, and that no bias moves a reflection."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera, Lens, pose
from renderer.passes.mapping import map_look
from renderer.passes.view import NO_CLIP
from renderer.water.technique import MapSpec
from tests.renderer.breaking import REFLECTION, Kind, change_reflection, shift_mirror
from tests.renderer.coverage import loss
from tests.renderer.drawing import MIRROR, asked, furthest, mask, picture
from tests.renderer.world import LEVEL, RED

pytestmark = pytest.mark.usefixtures("world")


# --------------------------------------------------------------------------------------------------------- T5: coverage


def lost(kind: Kind, **angles: Any) -> float:
    """The share of the water's pixels that a map by such a camera cannot answer."""
    return loss(replace(REFLECTION, camera=kind), **angles)


@pytest.mark.parametrize("kind", ["mirror", "direct"])
def test_no_sample_of_flat_water_leaves_a_map_for_a_thousand_cameras(kind: Kind) -> None:
    assert lost(kind, roll=180, pitch=85, count=1000, is_centred=False) == 0


def test_the_look_at_mirror_loses_pixels_under_roll_and_off_its_axis() -> None:
    assert lost("look_at", pitch=15) < 1e-9, "upright and centred it is right"
    assert lost("look_at", pitch=15, roll=15) > 0.03
    assert lost("look_at", pitch=15, is_centred=False) > 0.1


def test_the_yaw_only_mirror_loses_pixels_under_pitch() -> None:
    assert lost("yaw_only") < 1e-9, "level it is right"
    assert lost("yaw_only", pitch=15) > 0.1


# ------------------------------------------------------------------------------------------------ T6, T7: clip and bias


def green(shown: NDArray[np.uint8]) -> int:
    """How many pixels show the drowned box."""
    r, g, b = (shown[..., k].astype(int) for k in range(3))
    return int(((g > 2 * r) & (g > 2 * b)).sum())


@pytest.mark.parametrize("height", [10.0, 2.0, 0.5, 0.1, 0.02])
def test_what_is_drowned_is_never_reflected(height: float) -> None:
    camera = {"eye": [5.0, LEVEL + height, 5.0], "target": [2.0, LEVEL - 0.3 * height, 0.0], "fov_y": 70}
    shown = picture(camera=camera, layers=["reflection_map"])

    assert green(shown) == 0


def test_what_is_drowned_is_reflected_where_nothing_clips_it(monkeypatch: pytest.MonkeyPatch) -> None:
    change_reflection(monkeypatch, clip=None)

    assert green(picture(layers=["reflection_map"])) > 20


def reflected_post(shown: NDArray[np.uint8], bias: float) -> NDArray[np.bool_]:
    """The pixels of the post's reflection that lie farther than the bias above the water."""
    corners = np.array([[x, LEVEL - bias, z] for x in (-0.6, 0.6) for z in (-0.6, 0.6)])
    rows = (1 - asked().view().project(corners)[:, 1]) / 2 * shown.shape[0]
    is_red = (shown[..., 0] > 90) & (shown[..., 1] < 60)
    is_red[: int(np.ceil(rows.max())) + 1] = False
    return np.asarray(is_red & mask())


def test_a_clip_bias_moves_nothing_that_is_farther_from_the_water(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = picture(water=MIRROR)
    change_reflection(monkeypatch, bias=0.3)
    biased = picture(water=MIRROR)
    post = reflected_post(plain, 0.3)

    assert post.sum() > 100
    assert (reflected_post(biased, 0.3) == post).all()
    assert furthest(plain, biased, post) == 0
    assert furthest(plain, biased) > 10, "the bias does something"


def test_a_bias_that_leaks_into_the_mirror_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    post = reflected_post(picture(water=MIRROR), 0.3)
    shift_mirror(monkeypatch, -0.3)

    assert (reflected_post(picture(water=MIRROR), 0.3) != post).sum() > 10


@pytest.mark.parametrize(("side", "sign"), [("above", 1.0), ("below", -1.0)])
@pytest.mark.parametrize("eye", [2.0, -2.0])
def test_the_plane_keeps_the_eyes_side_and_the_bias_more(
    side: Literal["above", "below"], sign: float, eye: float
) -> None:
    camera = Camera(pose(np.eye(3), np.array([0.0, LEVEL + eye, 0.0])), Lens(100, 100, 80, 45), 160, 90)
    plane = np.array(map_look(MapSpec("mirror", clip=side, bias=0.1), camera, LEVEL).clip_plane)
    kept = sign * np.sign(eye)

    assert plane @ [3, LEVEL + 0.5 * kept, 7, 1] == pytest.approx(0.6)
    assert plane @ [3, LEVEL - 0.1 * kept, 7, 1] == pytest.approx(0.0)
    assert map_look(MapSpec("direct"), camera, LEVEL).clip_plane == NO_CLIP


def test_tags_choose_what_enters_a_map(monkeypatch: pytest.MonkeyPatch) -> None:
    change_reflection(monkeypatch, objects=frozenset({"terrain"}))
    shown = picture(water=MIRROR, layers=["reflection_map"])
    red = np.rint(255 * np.array(RED) ** (1 / 2.2))

    assert (shown[..., 1] > 0.5 * shown[..., 0]).all(), f"no post, whose colour is about {red}"
