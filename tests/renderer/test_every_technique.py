"""What every technique of the catalogue keeps: finite light, true mirrors and windows, no leaks from the wrong side."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from renderer.water.catalogue import TECHNIQUES
from tests.renderer.coverage import loss
from tests.renderer.drawing import (
    CAMERAS,
    EYE,
    Picture,
    asked,
    broken_shaders,
    furthest,
    inside,
    mask,
    picture,
)
from tests.renderer.techniques import (
    HEIGHTS,
    LIT,
    MARKERS,
    PILLAR,
    WAYS,
    change_map,
    copy_at,
    light,
    mirror,
    rough,
    window,
)
from tests.renderer.world import DRY, LEVEL, STILL

pytestmark = [pytest.mark.usefixtures("world", "telling"), pytest.mark.parametrize("name", TECHNIQUES)]

SUN = {"direction": [0.6, 0.7, 0.4], "color": [1.0, 0.9, 0.8], "shadows": False}


# ----------------------------------------------------------------------------------------------------- finite, in range


def random_views(count: int) -> Iterator[dict[str, Any]]:
    """Cameras of any pose and lens, above the water and below."""
    rng = np.random.default_rng(11)
    for _ in range(count):
        yield {
            "position": [*rng.uniform(-15, 15, 1), LEVEL + rng.choice([-1, 1, 1]) * np.exp(rng.uniform(-3, 2)), 9.0],
            "yaw": rng.uniform(-180, 180),
            "pitch": rng.uniform(-80, 30),
            "roll": rng.uniform(-180, 180),
            "fov_y": rng.uniform(5, 140),
        }


def as_plain(value: Any) -> Any:
    """NumPy's numbers as Python's."""
    return np.asarray(value).tolist()


def test_light_is_finite_and_layers_are_in_their_range_for_random_cameras(name: str) -> None:
    for camera in random_views(8):
        view = {key: as_plain(value) for key, value in camera.items()}
        for water in ({"technique": name}, rough(name)):
            shown = light(camera=view, water=water, time=3.3)
            assert np.isfinite(shown).all()
            assert shown.min() >= 0
            for layer in ("reflection_weight", "perturbation", "validity"):
                share = light(camera=view, water=water, time=3.3, layers=[layer])
                assert np.isfinite(share).all()
                assert share.min() >= 0, layer
                assert share.max() <= 1.0, layer


@pytest.mark.parametrize(
    "fields",
    [
        {"camera": {**EYE, "fov_y": 150.0}},
        {"camera": {**EYE, "fov_y": 2.0}},
        {"camera": {**EYE, "orthographic": {"height": 12.0}}},
        {"width": 45, "height": 160},
        {"width": 1, "height": 1},
        {"camera": {"eye": [3.0, -1.0, 3.0], "target": [0.0, 3.0, 0.0]}},
        {"camera": {"eye": [3.0, LEVEL, 3.0], "target": [0.0, LEVEL, 0.0]}},
        {"time": -1e7},
        {"time": 1e7, "period": 0.37},
        {"sun": None, "fog": {"density": 0.2}},
    ],
    ids=["wide", "narrow", "parallel", "portrait", "pixel", "from below", "at the water", "early", "late", "fog"],
)
def test_every_view_is_finite(name: str, fields: dict[str, Any]) -> None:
    request = asked(**fields)
    shown = light(**fields, water=rough(name))

    assert shown.shape == (request.height, request.width, 3)
    assert np.isfinite(shown).all()


# ----------------------------------------------------------------------------------------------- T1, T2: mirror, window


def disagreement(name: str, level: float, camera: dict[str, Any]) -> float:
    """The share of still water's pixels, all mirror, that differ from the world built upside down and seen directly."""
    scenery: dict[str, Any] = {"camera": camera, "sky": {"model": "constant", "color": [0.5, 0.6, 0.7]}}
    shown = picture(scene=STILL, water=mirror(name, level=level), sun=SUN, **scenery)
    direct = picture(
        scene=copy_at(level), water={"extents": DRY}, sun={**SUN, "direction": [0.6, -0.7, 0.4]}, **scenery
    )
    region = inside(mask(scene=STILL, camera=camera, water={"technique": name, "level": level}))
    assert region.sum() > 800
    return float((np.abs(shown.astype(np.int16) - direct).max(axis=-1) > 1)[region].mean())


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_still_water_of_weight_one_shows_the_world_built_upside_down(name: str, camera: dict[str, Any]) -> None:
    assert disagreement(name, LEVEL, camera) <= 0.001


@pytest.mark.parametrize("level", HEIGHTS)
def test_water_mirrors_at_any_height(name: str, level: float) -> None:
    assert disagreement(name, level, CAMERAS["rolled"]) <= 0.002


def test_another_mirror_fails(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    change_map(monkeypatch, name, "reflection", camera="look_at")

    assert disagreement(name, LEVEL, CAMERAS["rolled"]) > 0.02


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_still_water_of_weight_zero_is_the_scene_without_water(name: str, camera: dict[str, Any]) -> None:
    wet = picture(scene=STILL, camera=camera, water=window(name))
    dry = picture(scene=STILL, camera=camera, water={"extents": DRY})

    assert (np.abs(wet.astype(np.int16) - dry).max(axis=-1) > 1).mean() <= 0.0005


# --------------------------------------------------------------------------------------------- T5 to T7: maps and clips


def test_the_maps_answer_every_pixel_of_water_under_any_camera(name: str) -> None:
    for spec in TECHNIQUES[name]().maps().values():
        assert loss(spec, roll=180, pitch=85, is_centred=False) == 0


def test_a_clip_bias_moves_nothing_that_is_farther_from_the_water(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    bias = 0.3
    fields: dict[str, Any] = {"scene": PILLAR, **LIT, "water": mirror(name)}
    change_map(monkeypatch, name, "reflection", bias=0.0)
    plain, plain_map = picture(**fields), picture(**fields, layers=["reflection_map"])
    change_map(monkeypatch, name, "reflection", bias=bias)
    biased, biased_map = picture(**fields), picture(**fields, layers=["reflection_map"])
    corners = np.array([[x, LEVEL - bias, z] for x in (-0.8, 0.8) for z in (-0.8, 0.8)])
    row = int(np.ceil(((1 - asked(scene=PILLAR).view().project(corners)[:, 1]) / 2 * plain.shape[0]).max())) + 1

    assert red(plain[row:]) > 100
    assert furthest(plain[row:], biased[row:]) == 0
    assert green(biased_map) > green(plain_map) == 0, "the bias does something"


def red(shown: Picture) -> int:
    """How many pixels are redder than anything else."""
    r, g, b = (shown[..., k].astype(int) for k in range(3))
    return int(((r > 60) & (r > 2 * g) & (r > 2 * b)).sum())


def green(shown: Picture) -> int:
    """How many pixels are greener than anything else."""
    return red(shown[..., [1, 0, 2]])


@pytest.mark.parametrize("height", [10.0, 2.0, 0.5, 0.1, 0.02])
def test_each_map_holds_its_own_side_of_the_water(name: str, height: float) -> None:
    camera = {"eye": [5.0, LEVEL + height, 5.0], "target": [0.5, LEVEL - 0.3 * height, 0.5], "fov_y": 70}
    specs = TECHNIQUES[name]().maps()
    maps = {
        side: picture(scene=MARKERS, **LIT, camera=camera, water=name, layers=[f"{side}_map"])
        for side in ("reflection", "refraction")
    }

    assert specs["reflection"].clip == "above"
    assert green(maps["reflection"]) == 0
    if specs["refraction"].clip == "below":
        assert red(maps["refraction"]) == 0
    else:
        assert furthest(maps["refraction"], picture(scene=MARKERS, **LIT, camera=camera, water={"extents": DRY})) == 0


def test_a_map_without_its_clip_plane_holds_both_sides(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    change_map(monkeypatch, name, "reflection", clip=None)

    assert green(picture(scene=MARKERS, **LIT, water=name, layers=["reflection_map"])) > 20


# ----------------------------------------------------------------------------------------------------------- T30: leaks


def leaks(name: str) -> tuple[int, int]:
    """Pixels of water, over a second of high waves, in which the wrong side of the pillar shows: red, and green.

    The first are counted in water that lets everything through, the second in water that mirrors everything; where a
    technique says that it could not read its maps, and shows the scene behind, neither.
    """
    counts = [0, 0]
    for moment in (0.0, 0.3, 0.7):
        for k, (full, count) in enumerate(((window, red), (mirror, green))):
            given = {**full(name), **rough(name)}
            fields: dict[str, Any] = {"scene": PILLAR, **LIT, "water": given, "time": moment}
            region = mask(**fields)
            if TECHNIQUES[name].blends:
                region &= picture(**fields, layers=["validity"])[..., 0] == 255
            counts[k] += count(np.where(region[..., None], picture(**fields), 0))
    return counts[0], counts[1]


def test_nothing_from_the_wrong_side_of_the_water_shows_in_it(name: str) -> None:
    assert leaks(name) == (0, 0)


def test_without_its_guard_a_technique_leaks(name: str) -> None:
    guard = WAYS[name].guard
    if guard is None:
        pytest.skip("its maps hold nothing from the wrong side")
    with broken_shaders(dict([guard])):
        assert sum(leaks(name)) > 3
