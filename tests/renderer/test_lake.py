"""The lake's maps, weight and waves in the picture. Rows of Habib 2009 by their numbers, and of Habib 2009b.

Each check is seen to fail where the shader or a map is broken in the way that it is there to catch.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import look_at
from renderer.passes.mapping import map_look
from renderer.scene.material import Texture
from renderer.water.lake import Lake
from renderer.water.lake_edges import LakeEdges
from tests.reference import lake, normals, tonemap
from tests.reference.sampling import Sampler
from tests.renderer.drawing import (
    GRAZING,
    PLAIN,
    SIZE,
    STEEP,
    Floats,
    asked,
    broken_shaders,
    drawn,
    furthest,
    inside,
    linear,
    mask,
    picture,
    views,
)
from tests.renderer.test_maps import green
from tests.renderer.world import LEVEL

pytestmark = pytest.mark.usefixtures("world")

FLAT: dict[str, Any] = {"technique": "lake", "wave_height": 0.0, "dull_blend_factor": 0.0, "spec_alpha": 0.0}
WINDOW: dict[str, Any] = {**FLAT, "draw_mode": 0.0}
MIRROR: dict[str, Any] = {**FLAT, "draw_mode": 100.0}
TECHNIQUES = [Lake, LakeEdges]


# ------------------------------------------------------------------------------------------ K3 to K9, E2, E3: the maps


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_the_documents_maps_are_512_pixels_a_side_mirrored_bytes(technique: type[Lake]) -> None:
    for spec in technique(as_published=True).maps().values():
        assert (spec.size, spec.format, spec.wrap) == ((512, 512), "byte", "mirror")
    for spec in technique().maps().values():
        assert (spec.size, spec.scale, spec.format) == (None, 1.0, "half")


def test_the_documents_mirrored_camera_is_its_recipe_and_by_default_the_true_mirror() -> None:
    camera = asked(camera={"position": [7.0, 3.2, 9.0], "yaw": 38.0, "pitch": -14.0, "roll": 22.0}).view()
    pose = camera.world_from_camera
    eye, forward, side = pose[:3, 3], -pose[:3, 2], pose[:3, 0]
    recipe = lake.mirrored_view(lake.in_document(eye), lake.in_document(eye + forward), lake.in_document(side), LEVEL)
    spec = Lake(as_published=True).maps()["reflection"]
    made = np.linalg.inv(map_look(spec, camera, LEVEL).camera.world_from_camera)
    place = np.random.default_rng(1).normal(size=(20, 3))

    expected = np.c_[lake.in_document(place), np.ones(20)] @ recipe.T
    assert np.abs(np.c_[place, np.ones(20)] @ made.T - expected).max() < 1e-9
    assert Lake().maps()["reflection"].camera == LakeEdges().maps()["reflection"].camera == "mirror"


def test_the_mirrored_camera_mirrored_again_is_the_first() -> None:
    camera = asked(camera=STEEP).view()
    spec = Lake(as_published=True).maps()["reflection"]
    once = map_look(replace(spec, size=None), camera, LEVEL).camera
    pose = once.world_from_camera
    eye, ahead = pose[:3, 3] * [1, -1, 1] + [0, 2 * LEVEL, 0], -pose[:3, 2] * [1, -1, 1]
    again = look_at(eye, eye + ahead, np.cross(pose[:3, 0], ahead))

    assert np.abs(again - camera.world_from_camera).max() < 1e-9


@pytest.mark.parametrize("technique", TECHNIQUES)
@pytest.mark.parametrize("as_published", [False, True])
def test_the_reflection_keeps_what_is_above_and_the_sky(technique: type[Lake], as_published: bool) -> None:
    spec = technique(as_published=as_published, reflection_clip_bias=1.0).maps()["reflection"]

    assert (spec.clip, spec.draws_sky, spec.bias) == ("above", True, 1.0)
    assert technique(as_published=as_published).maps()["reflection"].bias == 0
    water = {"technique": technique.model_fields["technique"].default, "as_published": as_published}
    assert green(picture(camera=STEEP, water=water, layers=["reflection_map"])) == 0
    assert green(picture(camera=STEEP, water={**water, "reflection_clip_bias": 2.0}, layers=["reflection_map"])) > 20


def test_the_documents_refraction_keeps_five_metres_above_the_water_and_no_sky() -> None:
    spec = Lake(as_published=True).maps()["refraction"]

    assert (spec.camera, spec.clip, spec.bias, spec.draws_sky) == ("direct", "below", 5.0, False)
    assert Lake(as_published=True, refraction_clip_bias=0.5).maps()["refraction"].bias == 0.5
    assert Lake(refraction_clip_bias=0.5).maps()["refraction"].clip == "below"
    assert Lake().maps()["refraction"].is_the_scene


@pytest.mark.parametrize("as_published", [False, True])
def test_the_edges_refraction_is_cut_at_the_water(as_published: bool) -> None:
    spec = LakeEdges(as_published=as_published).maps()["refraction"]
    water = {"technique": "lake_edges", "as_published": as_published}
    shown = picture(water=water, layers=["refraction_map"])

    assert (spec.clip, spec.bias, spec.draws_sky) == ("below", 0.0, False)
    places = asked().view().project(np.array([[0.0, 2.5, 0.0], [6.0, 3.0, -9.5], [0.0, -1.0, 0.6]]))
    columns, rows = (np.array([1, -1]) * places[:, :2] + 1).T / 2 * np.array([SIZE]).T
    seen = shown[rows.astype(int), columns.astype(int)].max(axis=-1)
    assert (seen[:2] == 0).all(), "neither post nor hut above the water"
    assert seen[2] > 60
    assert (shown[0] == 0).all(), "no sky"


def test_maps_are_cleared_to_the_colour_that_is_asked_for() -> None:
    water = {"technique": "lake", "as_published": True}
    black, night = (
        picture(water={**water, **more}, layers=["refraction_map"])[0] for more in ({}, {"clear_color": "#ff8000"})
    )

    assert (black == 0).all()
    assert np.abs(night.astype(int) - [255, 128, 0]).max() <= 1


# ---------------------------------------------------------------------------- K14 to K19, E8: the weight at every pixel


def weight_error(technique: str, mode: int, draw_mode: float, camera: dict[str, Any]) -> float:
    """The largest difference of the weight's picture from the formula at each pixel's own angle, in steps of 255."""
    water = {"technique": technique, "wave_height": 0.05, "fresnel_mode": mode, "draw_mode": draw_mode}
    shown = drawn(**PLAIN, camera=camera, water=water, layers=["reflection_weight"]).color
    cosine = np.clip(views(camera)[..., 1], 0, 1)
    expected = lake.weight(mode, cosine, draw_mode, has_third=technique == "lake")
    region = mask(camera=camera)
    assert region.sum() > 3000
    return float(np.abs(shown - 255 * expected[..., None])[region].max())


@pytest.mark.parametrize("camera", [STEEP, GRAZING])
@pytest.mark.parametrize("draw_mode", [0.0, 0.6, 1.0, 2.0, 7.5])
@pytest.mark.parametrize("mode", [0, 1, 2])
@pytest.mark.parametrize("technique", ["lake", "lake_edges"])
def test_the_weight_is_the_formula_at_every_pixel(
    technique: str, mode: int, draw_mode: float, camera: dict[str, Any]
) -> None:
    assert weight_error(technique, mode, draw_mode, camera) <= 0.58


@pytest.mark.parametrize(
    ("mode", "change"),
    [
        (0, ("water/lake.glsl", "FRESNEL_MODE == 0", "FRESNEL_MODE == 7")),
        (2, ("water/lake.glsl", "FRESNEL_MODE == 1", "FRESNEL_MODE > 0")),
        (1, ("lib/lake.glsl", "0.97 * grazing2 * grazing2", "0.98 * grazing2")),
        (0, ("lib/lake.glsl", "clamp(fresnel * draw_mode, 0.0, 1.0)", "clamp(fresnel, 0.0, 1.0)")),
        (1, ("passes/water.frag", "- position_world * view", "- (position_world - vec3(0, 0.25, 0)) * view")),
    ],
)
def test_another_weight_fails(mode: int, change: tuple[str, str, str]) -> None:
    with broken_shaders({change[0]: change[1:]}):
        assert max(weight_error("lake", mode, 1.5, camera) for camera in (STEEP, GRAZING)) > 3


# --------------------------------------------------------------------------------------- K10, K11, K12, T16: the shift


@pytest.fixture
def tilt(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Gives the bump map one slope everywhere; returns the normal that it means, in the document's world."""

    def set_slope(x: float, z: float) -> Floats:
        image = np.broadcast_to(np.array([x, z], np.float32), (4, 4, 2)).copy()
        monkeypatch.setattr("renderer.water.lake_waves.ripple_slopes", lambda _: Texture(f"slope {x} {z}", image))
        return lake.in_document(normals.of_slope(np.array([x, z])))

    return set_slope


SLOPE = 33 / 128
"""A slope that a half float holds exactly."""


def shifted(plain: NDArray[np.uint8], right: float, down: float) -> Floats:
    """A picture read farther right and down by pixels, in linear light, mirrored at its border."""
    height, width, _ = plain.shape
    y, x = np.mgrid[0:height, 0:width].reshape(2, -1)
    place = np.stack([(x + 0.5 + right) / width, (y + 0.5 + down) / height], axis=-1)
    return Sampler(linear(plain)).read(place).reshape(plain.shape)


def shift_error(water: dict[str, Any], layer: str, shift: Floats, wave_height: float) -> float:
    """How far waves of one tilt are from one shift of the map, in steps of 255, where the map shows the water."""
    plain = picture(camera=STEEP, water=water, layers=[layer])
    shown = picture(camera=STEEP, water={**water, "wave_height": wave_height})
    expected = 255 * tonemap.srgb(np.clip(shifted(plain, shift[0] * SIZE[0], shift[1] * SIZE[1]), 0, 1))
    region = inside(mask(camera=STEEP), 2 + int(np.abs(shift * SIZE).max()))
    assert region.sum() > 2500
    assert furthest(shown, picture(camera=STEEP, water=water), region) > 50, "the waves do something"
    return float(np.abs(shown - expected).max(axis=-1)[region].max())


@pytest.mark.parametrize(("water", "layer"), [(WINDOW, "refraction_map"), (MIRROR, "reflection_map")])
@pytest.mark.parametrize("slope", [(SLOPE, 0.0), (-SLOPE, 0.0), (0.0, SLOPE), (0.0, -SLOPE), (SLOPE, SLOPE)])
def test_one_tilt_shifts_both_maps_alike_by_half_the_wave_height(
    tilt: Any, water: dict[str, Any], layer: str, slope: tuple[float, float]
) -> None:
    n = tilt(*slope)

    assert shift_error(water, layer, 0.5 * 0.3 * n[:2], 0.3) <= 1.5


@pytest.mark.parametrize(
    ("slope", "change"),
    [
        ((SLOPE, 0.0), ("wave_height * 0.5 *", "wave_height *")),
        ((SLOPE, 0.0), ("vec2(n.x, -n.z)", "vec2(-n.z, n.x)")),
        ((0.0, SLOPE), ("vec2(n.x, -n.z)", "vec2(n.x, n.y)")),
        ((0.0, SLOPE), ("place.y - perturbation.y", "place.y + perturbation.y")),
    ],
)
def test_another_shift_fails(tilt: Any, slope: tuple[float, float], change: tuple[str, str]) -> None:
    n = tilt(*slope)
    with broken_shaders({"lib/lake.glsl": change}):
        assert shift_error(WINDOW, "refraction_map", 0.5 * 0.3 * n[:2], 0.3) > 10


@pytest.mark.parametrize(("slope", "signs"), [((SLOPE, 0.0), (1, 0)), ((0.0, SLOPE), (0, 1)), ((0.0, -SLOPE), (0, -1))])
def test_as_published_the_reflection_moves_the_other_way_up(
    tilt: Any, slope: tuple[float, float], signs: tuple[int, int]
) -> None:
    """Its mirrored camera sees the world upright, so that downwards in its map is upwards in the picture."""
    n = tilt(*slope)
    down = {"wave_height": 0.3, "as_published": True}
    region = inside(mask(camera=STEEP), 14)
    errors = {}
    for sign in (1, -1):
        for name, water in (("seen", WINDOW), ("mirrored", MIRROR)):
            plain = picture(camera=STEEP, water={**water, "as_published": True})
            shown = picture(camera=STEEP, water={**water, **down})
            move = 0.15 * n[:2] * [1, sign] * SIZE
            errors[name, sign] = float(np.abs(linear(shown) - shifted(plain, *move))[region].mean())
    if signs[1]:
        assert errors["seen", 1] < 0.5 * errors["seen", -1]
        assert errors["mirrored", -1] < 0.5 * errors["mirrored", 1]
    else:
        assert errors["seen", 1] == errors["seen", -1] < 0.02
        assert errors["mirrored", 1] == errors["mirrored", -1] < 0.02


@pytest.mark.parametrize("technique", ["lake", "lake_edges"])
@pytest.mark.parametrize("as_published", [False, True])
def test_a_flat_bump_map_shifts_nothing(tilt: Any, technique: str, as_published: bool) -> None:
    tilt(0.0, 0.0)
    water = {"technique": technique, "as_published": as_published}
    waves, still = ({**water, "wave_height": height} for height in (2.0, 0.0))

    assert furthest(picture(water=waves), picture(water=still)) == 0
    layer = drawn(**PLAIN, water=waves, layers=["perturbation"]).color[mask()]
    assert set(np.unique(layer[:, :2])) <= {127, 128}


# ------------------------------------------------------------------------------------------- T31: the picture's borders


def border_error(water: dict[str, Any], slope: Floats) -> float:
    """How far the picture's side is from the refraction map mirrored at its border, on average, in steps of 255."""
    plain = picture(camera=BORDER, water={**water, "wave_height": 0.0}).astype(float)
    shown = picture(camera=BORDER, water={**water, "wave_height": 0.4})
    move = 0.2 * slope[:2] * SIZE
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]].reshape(2, -1)
    place = np.stack([(x + 0.5 + move[0]) / SIZE[0], (y + 0.5 + move[1]) / SIZE[1]], axis=-1)
    expected = Sampler(plain).read(place).reshape(plain.shape)
    side = np.s_[10:-10, -8:] if move[0] > 0 else np.s_[10:-10, :8]
    return float(np.abs(shown - expected)[side].mean())


BORDER: dict[str, Any] = {"eye": [0.0, 9.0, 0.1], "target": [0.0, 0.0, 0.0], "fov_y": 40}


@pytest.mark.parametrize("slope", [(2.0, 0.0), (-2.0, 0.0)])
def test_as_published_the_maps_are_mirrored_at_the_pictures_border(
    tilt: Any, slope: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    n = tilt(*slope)
    water = {**WINDOW, "as_published": True}
    assert border_error(water, n) < 2

    specs = {name: replace(spec, wrap="clamp") for name, spec in Lake(as_published=True).maps().items()}
    monkeypatch.setattr(Lake, "maps", lambda _: specs)
    assert border_error(water, n) > 4
