"""The maps: where they look from, what they keep, and that flat water is a mirror and a window to the bit.

Each claim is a check that returns a figure, so that a broken variant can be seen to fail it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera, Lens, pose, rotation_from_angles
from renderer.passes import mapping
from renderer.passes.mapping import map_look
from renderer.passes.view import NO_CLIP
from renderer.water.luna import Luna
from renderer.water.technique import MapSpec
from tests.renderer.drawing import FLAT, MIRROR, PLAIN, SIZE, WINDOW, asked, drawn, furthest, inside, mask, picture
from tests.renderer.world import COPY, DRY, EMPTY, LEVEL, RED, STILL

pytestmark = pytest.mark.usefixtures("world")

EYE = {"eye": [7.0, 3.2, 9.0], "target": [0.0, 0.3, 0.0]}
CAMERAS: dict[str, dict[str, Any]] = {
    "upright": {**EYE, "fov_y": 45},
    "rolled": {"position": [7.0, 3.2, 9.0], "yaw": 38.0, "pitch": -14.0, "roll": 22.0},
    "off axis": {**EYE, "intrinsics": {"fx": 110.0, "fy": 120.0, "cx": 30.0, "cy": 70.0}},
    "parallel": {"eye": [12.0, 12.0, 16.0], "target": [0.0, 0.3, 0.0], "orthographic": {"height": 9.0}},
    "steep": {"eye": [2.0, 9.0, 6.0], "target": [0.0, 0.0, 0.0], "fov_y": 70},
}
MIST = {"color": [0.5, 0.6, 0.7], "density": 0.03, "height_falloff": 0.2}
SUN = {"direction": [0.6, 0.7, 0.4], "color": [1.0, 0.9, 0.8], "shadows": False}
REFLECTION = MapSpec(camera="mirror", clip="above", clear=(1.0, 1.0, 1.0, 0.0))

Respecify = Callable[..., None]
Kind = Literal["mirror", "look_at", "yaw_only", "direct"]


@pytest.fixture
def respecify(monkeypatch: pytest.MonkeyPatch) -> Iterator[Respecify]:
    """Changes what Luna says of its reflection map."""

    def change(**changes: Any) -> None:
        specs = {"reflection": replace(REFLECTION, **changes), "refraction": MapSpec(camera="direct")}
        monkeypatch.setattr(Luna, "maps", lambda _: specs)

    yield change


def shift_mirror(monkeypatch: pytest.MonkeyPatch, rise: float) -> None:
    """Mirror about a plane that lies higher than the water."""
    monkeypatch.setitem(mapping.MAP_CAMERAS, "mirror", lambda camera, level: camera.mirrored(level + rise))


# ------------------------------------------------------------------------------------------------- T1: the flat mirror


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
def test_the_mirrors_of_the_other_documents_fail(respecify: Respecify, kind: str, camera: str) -> None:
    respecify(camera=kind)

    assert disagreement(CAMERAS[camera]) > 0.02


def test_a_mirror_without_a_clip_plane_fails(respecify: Respecify) -> None:
    respecify(clip=None)

    assert disagreement(CAMERAS["upright"]) > 0.03


def test_a_map_of_another_size_still_lies_in_its_place(respecify: Respecify) -> None:
    respecify(scale=2.0)

    assert disagreement(CAMERAS["rolled"]) < 0.03, "only edges may differ"


# ------------------------------------------------------------------------------------------------- T2: the flat window


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


# -------------------------------------------------------------------------------------------------------- T5: coverage


def random_camera(rng: np.random.Generator, *, roll: float, pitch: float, is_centred: bool) -> Camera:
    """Any camera above the water that may see it, off-axis too unless it is centred."""
    turn = rotation_from_angles(rng.uniform(-180, 180), pitch, roll)
    eye = np.array([rng.uniform(-50, 50), LEVEL + np.exp(rng.uniform(-3, 3)), rng.uniform(-50, 50)])
    focal = rng.uniform(40, 400)
    cx, cy = (80, 45) if is_centred else (rng.uniform(-40, 200), rng.uniform(-40, 130))
    lens = Lens(focal, focal * rng.uniform(0.8, 1.25), cx, cy)
    return Camera(pose(turn, eye), lens, 160, 90)


def outside(spec: MapSpec, camera: Camera, rng: np.random.Generator) -> tuple[int, int]:
    """How many of the water's pixels read the map outside [0, 1], and how many pixels of water there are."""
    ndc = rng.uniform(-1, 1, (64, 2))
    rays = np.c_[ndc, np.ones(64), np.zeros(64)] @ camera.ray_from_ndc.T
    eye = camera.world_from_camera[:3, 3]
    with np.errstate(divide="ignore"):
        reach = (LEVEL - eye[1]) / rays[:, 1]
    water = eye + rays[:, :3] * np.where(np.isfinite(reach), reach, 0)[:, None]
    water = water[(reach > 0.02) & (reach < 1e5)]
    clip = np.c_[water, np.ones(len(water))] @ map_look(spec, camera, LEVEL).camera.clip_from_world.T
    place = 0.5 * clip[:, :2] / clip[:, 3:] + 0.5
    is_out = (place < -1e-6) | (place > 1 + 1e-6) | (clip[:, 3:] <= 0)
    return int(is_out.any(axis=1).sum()), len(water)


def loss(kind: Kind, *, roll: float = 0.0, pitch: float = 0.0, count: int = 200, is_centred: bool = True) -> float:
    """The share of the water's pixels that such a map cannot answer, over random cameras of up to these angles."""
    rng = np.random.default_rng(5)
    lost = seen = 0
    for _ in range(count):
        camera = random_camera(
            rng, roll=rng.uniform(-roll, roll), pitch=rng.uniform(-pitch, pitch), is_centred=is_centred
        )
        out, of = outside(replace(REFLECTION, camera=kind), camera, rng)
        lost, seen = lost + out, seen + of
    assert seen > 10 * count
    return lost / seen


@pytest.mark.parametrize("kind", ["mirror", "direct"])
def test_no_sample_of_flat_water_leaves_a_map_for_a_thousand_cameras(kind: Kind) -> None:
    assert loss(kind, roll=180, pitch=85, count=1000, is_centred=False) == 0


def test_the_look_at_mirror_loses_pixels_under_roll_and_off_its_axis() -> None:
    assert loss("look_at", pitch=15) < 1e-9, "upright and centred it is right"
    assert loss("look_at", pitch=15, roll=15) > 0.03
    assert loss("look_at", pitch=15, is_centred=False) > 0.1


def test_the_yaw_only_mirror_loses_pixels_under_pitch() -> None:
    assert loss("yaw_only") < 1e-9, "level it is right"
    assert loss("yaw_only", pitch=15) > 0.1


# ---------------------------------------------------------------------------------------------- T6, T7: clip and bias


def green(shown: NDArray[np.uint8]) -> int:
    """How many pixels show the drowned box."""
    r, g, b = (shown[..., k].astype(int) for k in range(3))
    return int(((g > 2 * r) & (g > 2 * b)).sum())


@pytest.mark.parametrize("height", [10.0, 2.0, 0.5, 0.1, 0.02])
def test_what_is_drowned_is_never_reflected(height: float) -> None:
    camera = {"eye": [5.0, LEVEL + height, 5.0], "target": [2.0, LEVEL - 0.3 * height, 0.0], "fov_y": 70}
    shown = picture(camera=camera, layers=["reflection_map"])

    assert green(shown) == 0


def test_what_is_drowned_is_reflected_where_nothing_clips_it(respecify: Respecify) -> None:
    respecify(clip=None)

    assert green(picture(layers=["reflection_map"])) > 20


def reflected_post(shown: NDArray[np.uint8], bias: float) -> NDArray[np.bool_]:
    """The pixels of the post's reflection that lie farther than the bias above the water."""
    corners = np.array([[x, LEVEL - bias, z] for x in (-0.6, 0.6) for z in (-0.6, 0.6)])
    rows = (1 - asked().view().project(corners)[:, 1]) / 2 * shown.shape[0]
    is_red = (shown[..., 0] > 90) & (shown[..., 1] < 60)
    is_red[: int(np.ceil(rows.max())) + 1] = False
    return np.asarray(is_red & mask())


def test_a_clip_bias_moves_nothing_that_is_farther_from_the_water(respecify: Respecify) -> None:
    plain = picture(water=MIRROR)
    respecify(bias=0.3)
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


def test_tags_choose_what_enters_a_map(respecify: Respecify) -> None:
    respecify(objects=frozenset({"terrain"}))
    shown = picture(water=MIRROR, layers=["reflection_map"])
    red = np.rint(255 * np.array(RED) ** (1 / 2.2))

    assert (shown[..., 1] > 0.5 * shown[..., 0]).all(), f"no post, whose colour is about {red}"


# ------------------------------------------------------------------------------------------------ T11: the sky mirrored

GRADIENT = {"model": "gradient", "horizon": [0.8, 0.5, 0.2], "zenith": [0.05, 0.2, 0.7]}


@pytest.mark.parametrize("camera", ["upright", "rolled", "steep"])
def test_water_mirrors_the_sky_by_direction(camera: str) -> None:
    view = asked(camera=CAMERAS[camera]).view()
    water = {**MIRROR, "extents": [-4000, 4000, -4000, 4000]}
    shown = picture(scene=EMPTY, camera=CAMERAS[camera], sky=GRADIENT, water=water)
    height, width, _ = shown.shape
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    rays = np.stack([x, y, np.ones_like(x), np.zeros_like(x)], axis=-1) @ view.ray_from_ndc.T
    up = np.abs(rays[..., 1]) / np.linalg.norm(rays[..., :3], axis=-1)
    radiance = np.array(GRADIENT["horizon"]) + np.sqrt(up)[..., None] * np.subtract(
        GRADIENT["zenith"], GRADIENT["horizon"]
    )
    expected = 255 * np.where(radiance <= 0.0031308, 12.92 * radiance, 1.055 * radiance ** (1 / 2.4) - 0.055)
    away = up > 0.002  # the water ends before the horizon

    assert (np.abs(shown - expected).max(axis=-1)[away] <= 1).all()


# ------------------------------------------------------------------------------------------------------ heights of the eye


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


# --------------------------------------------------------------------------------------------------- the edge of the water


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
