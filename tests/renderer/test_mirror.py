"""Flat water is a mirror and a window, to the bit, under any camera; and it mirrors sky and fog.

Each claim is a check that returns a figure, so that a broken variant can be seen to fail it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.passes.mapping import map_look
from tests.renderer.breaking import REFLECTION, change_reflection, shift_mirror
from tests.renderer.drawing import (
    CAMERAS,
    FLAT,
    MIRROR,
    PLAIN,
    SIZE,
    WINDOW,
    asked,
    drawn,
    furthest,
    inside,
    mask,
    picture,
)
from tests.renderer.world import COPY, DRY, EMPTY, LEVEL, STILL

pytestmark = pytest.mark.usefixtures("world")

MIST = {"color": [0.5, 0.6, 0.7], "density": 0.03, "height_falloff": 0.2}
SUN = {"direction": [0.6, 0.7, 0.4], "color": [1.0, 0.9, 0.8], "shadows": False}


# -------------------------------------------------------------------------------------------------- T1: the flat mirror


def disagreement(camera: dict[str, Any], fog: dict[str, Any] | None = None) -> float:
    """The share of the mirror's pixels that differ from the world built upside down and seen directly."""
    sky = {"model": "constant", "color": MIST["color"]}
    scenery: dict[str, Any] = {"camera": camera, "sky": sky, "fog": fog}
    below = {**SUN, "direction": [0.6, -0.7, 0.4]}
    mirror = picture(scene=STILL, water=MIRROR, sun=SUN, **scenery)
    direct = picture(scene=COPY, water={"extents": DRY}, sun=below, **scenery)
    region = inside(mask(scene=STILL, camera=camera))
    assert region.sum() > 1500
    apart = np.abs(mirror.astype(np.int16) - direct).max(axis=-1) > 1
    return float(apart[region].mean())


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_a_flat_mirror_shows_the_world_built_upside_down(camera: dict[str, Any]) -> None:
    assert disagreement(camera) <= 0.001


def test_the_mirror_shows_the_same_fog() -> None:
    assert disagreement(CAMERAS["upright"], fog=MIST) <= 0.001


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_a_flat_mirror_is_the_scene_drawn_with_the_mirrored_camera_to_the_bit(camera: dict[str, Any]) -> None:
    mirror = picture(water=MIRROR, camera=camera)
    drawn_map = picture(water=MIRROR, camera=camera, layers=["reflection_map"])

    assert furthest(mirror, drawn_map, mask(camera=camera)) == 0


@pytest.mark.parametrize("rise", [0.05, -0.1])
def test_a_mirror_at_another_level_fails(monkeypatch: pytest.MonkeyPatch, rise: float) -> None:
    shift_mirror(monkeypatch, rise)

    assert disagreement(CAMERAS["upright"]) > 0.003


@pytest.mark.parametrize(("kind", "camera"), [("look_at", "rolled"), ("yaw_only", "upright")])
def test_the_mirrors_of_the_other_documents_fail(monkeypatch: pytest.MonkeyPatch, kind: str, camera: str) -> None:
    change_reflection(monkeypatch, camera=kind)

    assert disagreement(CAMERAS[camera]) > 0.02


def test_a_mirror_without_a_clip_plane_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    change_reflection(monkeypatch, clip=None)

    assert disagreement(CAMERAS["upright"]) > 0.03


def test_a_map_of_another_size_still_lies_in_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    change_reflection(monkeypatch, scale=2.0)

    assert disagreement(CAMERAS["rolled"]) < 0.03, "only edges may differ"


# -------------------------------------------------------------------------------------------------- T2: the flat window


def is_window(camera: dict[str, Any], water: dict[str, Any] = WINDOW, **fields: Any) -> bool:
    """Whether the picture is the scene without water, to the bit."""
    wet = picture(camera=camera, water=water, **fields)
    dry = picture(camera=camera, water={"extents": DRY}, **fields)
    return bool((wet == dry).all())


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_a_flat_window_is_the_scene_without_water_to_the_bit(camera: dict[str, Any]) -> None:
    assert is_window(camera)


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_with_smooth_edges_a_window_differs_at_the_waters_edge_alone(camera: dict[str, Any]) -> None:
    wet, dry = (picture(camera=camera, water=water, msaa=4) for water in (WINDOW, {"extents": DRY}))
    water = mask(camera=camera)
    away = inside(water) | inside(~water)
    slivers = (wet != dry).any(axis=-1) & away  # of water or land between two pixels' centres

    assert slivers.sum() <= 0.001 * away.sum()


def test_a_window_with_ripples_or_a_trace_of_reflection_fails() -> None:
    assert not is_window(CAMERAS["upright"], {**WINDOW, "ripple_scale": [0.01, 0.01], "ripple_height": 1.0})
    assert not is_window(CAMERAS["upright"], {**WINDOW, "refraction_bias": -0.02, "refraction_power": 0.01})


def test_the_refraction_map_is_the_whole_scene_what_stands_in_the_air_too() -> None:
    dry = picture(water={"extents": DRY})

    assert furthest(picture(layers=["refraction_map"]), dry) == 0


# ------------------------------------------------------------------------------------------------ T11: the sky mirrored

HORIZON, ZENITH = [0.8, 0.5, 0.2], [0.05, 0.2, 0.7]
GRADIENT = {"model": "gradient", "horizon": HORIZON, "zenith": ZENITH}


@pytest.mark.parametrize("camera", ["upright", "rolled", "steep"])
def test_water_mirrors_the_sky_by_direction(camera: str) -> None:
    view = asked(camera=CAMERAS[camera]).view()
    water = {**MIRROR, "extents": [-4000, 4000, -4000, 4000]}
    shown = picture(scene=EMPTY, camera=CAMERAS[camera], sky=GRADIENT, water=water)
    height, width, _ = shown.shape
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    rays = np.stack([x, y, np.ones_like(x), np.zeros_like(x)], axis=-1) @ view.ray_from_ndc.T
    up = np.abs(rays[..., 1]) / np.linalg.norm(rays[..., :3], axis=-1)
    radiance = np.array(HORIZON) + np.sqrt(up)[..., None] * np.subtract(ZENITH, HORIZON)
    expected = 255 * np.where(radiance <= 0.0031308, 12.92 * radiance, 1.055 * radiance ** (1 / 2.4) - 0.055)
    away = up > 0.002  # the water ends before the horizon

    assert (np.abs(shown - expected).max(axis=-1)[away] <= 1).all()


# --------------------------------------------------------------------------------------------------- heights of the eye


@pytest.mark.parametrize("layer", ["color", "reflection_map", "reflection_weight", "water_mask"])
@pytest.mark.parametrize("height", [10.0, 2.0, 0.5, 0.02, 0.0, -0.02])
def test_an_eye_at_any_height_sees_finite_light(renderer: Any, height: float, layer: str) -> None:
    camera = {"eye": [5.0, LEVEL + height, 6.0], "target": [0.0, LEVEL - 0.2 + 0.5 * height, 0.0], "fov_y": 60}
    shown = drawn(**PLAIN, camera=camera, layers=[layer])
    used = [
        t for key, (t, _) in renderer._targets._kept.items() if key[0] in {"scene", "reflection map"} and key[4] == 1
    ]
    light = [target.read() for target in used if target.size == SIZE]

    assert light
    assert all(np.isfinite(values.astype(np.float32)).all() for values in light)
    assert layer != "color" or shown.color.std() > 5


def test_nothing_pops_where_the_eye_passes_through_the_water() -> None:
    def at(height: float) -> NDArray[np.float64]:
        camera = {"eye": [5.0, LEVEL + height, 6.0], "target": [0.0, LEVEL + height + 0.3, 0.0], "fov_y": 60}
        return picture(camera=camera, water=FLAT)[:40].astype(float)

    assert np.abs(at(0.001) - at(-0.001)).mean() < 1.0


# ------------------------------------------------------------------------------------------------ the edge of the water


def seam() -> int:
    """How many pixels of sky shine through between a post and its reflection, where edges are smooth."""
    sky = {"model": "constant", "color": [0.0, 0.0, 1.0]}
    shown = picture(width=480, height=270, msaa=4, sky=sky, water=MIRROR, sun=None)
    corners = np.array([[-0.6, 2.9, 0.6], [0.6, 2.9, -0.6], [-0.6, 2 * LEVEL - 2.5, 0.6]])
    x, y, _ = asked(width=480, height=270).view().project(corners).T
    left, right = (round((1 + side) / 2 * 480) for side in x[:2])
    top, bottom = (round((1 - side) / 2 * 270) for side in y[[0, 2]])
    post = shown[top + 8 : bottom - 8, left + 8 : right - 8].astype(int)
    assert (post[..., 0] > 100).mean() > 0.95
    return int((post[..., 2] > post[..., 0] // 4).sum())


def test_no_seam_of_sky_runs_along_a_waterline() -> None:
    assert seam() == 0


def test_a_reflection_that_is_cut_at_the_water_shows_a_seam(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("renderer.pipeline.EDGE_SLACK", 0.0)

    assert seam() > 10


def test_slack_is_so_many_pixels_at_any_distance() -> None:
    camera = asked(camera=CAMERAS["rolled"]).view()
    plain, slack = (np.array(map_look(REFLECTION, camera, LEVEL, slack=pixels).clip_plane) for pixels in (0.0, 2.0))
    for place in ([4.0, LEVEL, 5.0, 1.0], [-15.0, LEVEL, -12.0, 1.0]):
        depth = float((camera.mirrored(LEVEL).camera_from_world @ place)[2])

        assert plain @ place == pytest.approx(0)
        assert (slack @ place) * camera.lens.fy / -depth == pytest.approx(2.0)
