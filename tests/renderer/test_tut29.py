"""Tutorial 29's water in the picture: each pixel by its formulae, the ripples' shift, the edges.

Each check is seen to fail where the shader is broken in the way that it is there to catch.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.passes.mapping import map_look
from renderer.scene.material import Texture
from renderer.water import tut29
from renderer.water.tut29 import Tut29
from tests.reference import tut29 as twin
from tests.reference.sampling import Sampler
from tests.reference.tonemap import srgb
from tests.renderer import drawing
from tests.renderer.drawing import (
    PLAIN,
    STEEP,
    Floats,
    asked,
    broken_shaders,
    drawn,
    furthest,
    inside,
    mask,
    picture,
    shared_renderer,
)
from tests.renderer.world import LEVEL

pytestmark = pytest.mark.usefixtures("world")

WATER: dict[str, Any] = {"technique": "tut29"}
FLAT: dict[str, Any] = {**WATER, "normal_map": "flat"}
LEVEL_VIEW: dict[str, Any] = {"position": [0.0, 3.2, 12.0], "yaw": 0.0, "pitch": 0.0, "fov_y": 60}
"""A camera that looks straight ahead, as the document's does."""
FILE = "water/tut29.glsl"


# ------------------------------------------------------------------------ T37: R10 to R14, pixel by pixel from the maps


def map_texels(name: str) -> Floats:
    """What the map's target holds, (rows upwards, columns, 4): halves as they are, bytes as fractions."""
    renderer = drawing._DRAWING[-1] if drawing._DRAWING else shared_renderer()
    texels = renderer._kept._kept[name].drawn.target.read()
    return texels.astype(np.float64) / (255 if texels.dtype == np.uint8 else 1)


def shader_error(water: dict[str, Any], camera: dict[str, Any], frame: int = 700) -> float:
    """How far a thousand pixels of water are from the formulae on the maps that were drawn, in steps of 255."""
    magnified = 0.15 if camera is STEEP else 0.01  # by which no level of detail but the first is read
    fields: dict[str, Any] = {**PLAIN, "camera": camera, "time": frame / 60}
    fields["water"] = {**WATER, "tiling": magnified, **water}
    request = asked(**fields)
    technique, view = request.water, request.view()
    assert isinstance(technique, Tut29)
    shown = drawn(**fields).color
    maps = {name: map_texels(name) for name in ("reflection", "refraction")}
    normals = tut29.normal_map("clouds", 0).image.astype(np.float64)
    rows, columns = np.nonzero(mask(camera=camera))
    chosen = np.random.default_rng(29).permutation(len(rows))[:1000]
    assert len(chosen) == 1000
    worst = 0.0
    for row, column in zip(rows[chosen], columns[chosen], strict=True):
        ndc = np.array([(column + 0.5) / request.width * 2 - 1, 1 - (row + 0.5) / request.height * 2, 1, 0])
        ray = view.ray_from_ndc @ ndc
        eye = view.world_from_camera[:3, 3]
        point = eye + ray[:3] * (LEVEL - eye[1]) / ray[1]
        place = ((point[0] + 20) / 40, (point[2] + 20) / 40)
        n = twin.normal(normals, place, technique.tiling, frame)
        light = {}
        for name, spec in technique.maps().items():
            clip = map_look(spec, view, LEVEL).camera.clip_from_world @ [*point, 1]
            at = (clip[0] / clip[3] / 2 + 0.5, 0.5 - clip[1] / clip[3] / 2)
            # The document's reflection stands upside down against that of a true mirror.
            is_upside_down = name == "reflection" and spec.camera == "mirror"
            u, v = twin.moved((at[0], 1 - at[1] if is_upside_down else at[1]), n, technique.reflect_refract_scale)
            light[name] = Sampler(maps[name], spec.wrap).read([(u, v if is_upside_down else 1 - v)])[0]
        if light["refraction"][3] < 0.55 and not technique.as_published:
            continue  # a ripple that looks past the water's edge: see below
        result = twin.blended(light["reflection"][:3], light["refraction"][:3], technique.blend)
        expected = 255 * (result if technique.as_published else srgb(np.clip(result, 0, 1)))
        worst = max(worst, float(np.abs(shown[row, column] - expected).max()))
    return worst


@pytest.mark.parametrize("camera", [STEEP, LEVEL_VIEW], ids=["steep", "level"])
@pytest.mark.parametrize("water", [{}, {"as_published": True}, {"reflect_refract_scale": 0.04, "blend": 0.3}])
def test_a_thousand_pixels_are_what_the_formulae_make_of_the_maps(
    water: dict[str, Any], camera: dict[str, Any]
) -> None:
    assert shader_error(water, camera) <= 1.0


@pytest.mark.parametrize(
    "change",
    [
        ("mix(reflected, refracted.rgb", "mix(refracted.rgb, reflected"),
        ("2.0 * texture(normal_map, place).rg - 1.0", "texture(normal_map, place).rg - 0.5"),
        ("2.0 * texture(normal_map, place).rg", "2.0 * texture(normal_map, place).gr"),
        ("vec2(shift.x, -shift.y)", "vec2(-shift.x, -shift.y)"),
        ("vec2(shift.x, -shift.y)", "vec2(shift.x, shift.y)"),
        ("vec2 reflection_shift = shift;", "vec2 reflection_shift = refraction_shift;"),
        ("place + tut29_scroll.offset.xy", "place - tut29_scroll.offset.xy"),
    ],
)
def test_another_shader_fails(change: tuple[str, str]) -> None:
    with broken_shaders({FILE: change}):
        assert shader_error({"reflect_refract_scale": 0.04}, STEEP) > 5


# ---------------------------------------------------------------------------------------------- R11, R12: one tilt, T16


@pytest.fixture
def tilt(monkeypatch: pytest.MonkeyPatch) -> Callable[[float, float], None]:
    """Gives the normal map one value everywhere; these are the normal's x and y."""

    def set_normal(x: float, y: float) -> None:
        image = np.broadcast_to(np.array([x, y]) / 2 + 0.5, (4, 4, 2)).astype(np.float16)
        monkeypatch.setattr(tut29, "normal_map", lambda *_: Texture(f"normal {x} {y}", image))

    return set_normal


def shift_error(water: dict[str, Any], layer: str, across: int, down: int) -> int:
    """How far the water is from its map read so many pixels farther right and down, in steps of 255."""
    camera = LEVEL_VIEW if water.get("as_published") else STEEP
    shown = picture(camera=camera, water=water)
    read = picture(camera=camera, water=water, layers=[layer])
    if water.get("as_published") and layer == "reflection_map":
        read = read[::-1]  # the document's mirrored camera turns it upside down
    valid = picture(camera=camera, water=water, layers=["validity"])[..., 0] == 255
    region = inside(mask(camera=camera), 9) & valid
    region[:9] = region[-9:] = region[:, :9] = region[:, -9:] = False
    assert region.sum() > 1000
    return furthest(shown, np.roll(read, (-down, -across), axis=(0, 1)), region)


SHIFTS = [((0.5, 0.0), 0.1, (8, 0)), ((-0.25, 0.0), 0.1, (-4, 0)), ((0.0, 0.5), 8 / 90, (0, 4))]


@pytest.mark.parametrize(("n", "scale", "pixels"), SHIFTS)
@pytest.mark.parametrize("as_published", [False, True])
@pytest.mark.parametrize(("layer", "blend"), [("refraction_map", 1.0), ("reflection_map", 0.0)])
def test_one_tilt_moves_both_maps_by_scale_times_normal(
    tilt: Any,
    n: tuple[float, float],
    scale: float,
    pixels: tuple[int, int],
    layer: str,
    blend: float,
    as_published: Any,
) -> None:
    """The document moves both maps by +n; its reflection is upside down, so that on the screen v goes the other way."""
    tilt(*n)
    water = {**WATER, "reflect_refract_scale": scale, "blend": blend, "as_published": as_published}
    down = pixels[1] if layer == "refraction_map" else -pixels[1]

    assert shift_error(water, layer, pixels[0], down) <= 1
    assert shift_error(water, layer, pixels[0] + 1, down) > 20, "a pixel farther is told apart"


def test_a_flat_map_moves_nothing_at_all() -> None:
    assert (tut29.normal_map("flat", 0).image == 0.5).all()
    for layer, blend in (("refraction_map", 1.0), ("reflection_map", 0.0)):
        flat = {**FLAT, "reflect_refract_scale": 1.0, "blend": blend}
        assert furthest(picture(water=flat), picture(water=flat, layers=[layer]), mask()) == 0


@pytest.mark.parametrize("name", ["clouds", "waves"])
def test_a_map_has_no_tilt_as_a_whole_and_normals_of_at_most_one(name: str) -> None:
    n = 2 * tut29.normal_map(name, 0).image.astype(np.float64) - 1

    assert np.abs(n.mean(axis=(0, 1))).max() < 0.01
    assert np.hypot(n[..., 0], n[..., 1]).max() < 1
    assert n.std() > 0.05


# ------------------------------------------------------------------------ R14: past the picture's edge, T31; leaks, T30


def read_past_the_edge(as_published: bool) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.bool_]]:
    """The last columns of the water, the map, and where the last column shows water."""
    water = {**WATER, "blend": 1.0, "reflect_refract_scale": 0.1, "as_published": as_published}
    shown = picture(camera=STEEP, water=water)
    valid = picture(camera=STEEP, water=water, layers=["validity"])[..., 0] == 255
    return shown, picture(camera=STEEP, water=water, layers=["refraction_map"]), mask(camera=STEEP) & valid


def test_as_published_the_opposite_edge_comes_in(tilt: Any) -> None:
    tilt(0.5, 0.0)
    shown, read, water = read_past_the_edge(as_published=True)

    assert water[:, -1].sum() > 40
    assert furthest(shown[:, -8:], read[:, :8], water[:, -8:]) <= 1
    assert furthest(shown[:, -8:], np.repeat(read[:, -1:], 8, axis=1), water[:, -8:]) > 20


def test_the_opposite_edge_is_drawn_where_no_water_lies_before_it(tilt: Any) -> None:
    """A map that is read by wrapping round is drawn whole, not only near the water."""
    tilt(0.5, 0.0)
    water = {
        **WATER,
        "blend": 1.0,
        "reflect_refract_scale": 0.1,
        "as_published": True,
        "extents": [3.0, 20.0, -20.0, 20.0],
    }
    fields: dict[str, Any] = {"camera": STEEP, "water": water}
    region = mask(**fields)[:, -8:]
    picture(
        camera=LEVEL_VIEW, water={**water, "clip_bias": 10.0}, layers=["refraction_map"]
    )  # leaves other pixels behind
    shown = picture(**fields)

    assert not mask(**fields)[:, :80].any()
    assert region.sum() > 300
    assert furthest(shown[:, -8:], picture(**fields, layers=["refraction_map"])[:, :8], region) <= 1


def test_otherwise_the_edge_goes_on(tilt: Any) -> None:
    tilt(0.5, 0.0)
    shown, read, water = read_past_the_edge(as_published=False)

    assert water[:, -1].sum() > 40
    assert furthest(shown[:, -8:], np.repeat(read[:, -1:], 8, axis=1), water[:, -8:]) <= 1


def holes(**water: Any) -> int:
    """How many pixels of water are black, or of the sky's colour, where flat water is not: the map's holes."""
    fields: dict[str, Any] = {"camera": STEEP, "sky": {"model": "constant", "color": [1.0, 0.0, 1.0]}}
    rippled = picture(**fields, water={**WATER, "blend": 1.0, "reflect_refract_scale": 0.15, **water})
    flat = picture(**fields, water={**FLAT, "blend": 1.0, **water})
    is_hole, was_hole = (
        (shown.max(axis=-1) < 5) | ((shown[..., 1] < 60) & (shown[..., [0, 2]].min(axis=-1) > 200))
        for shown in (rippled, flat)
    )
    return int((is_hole & ~was_hole & mask(camera=STEEP)).sum())


def test_ripples_draw_no_hole_onto_the_water_but_as_published() -> None:
    assert holes(clip_bias=0.0) == 0
    assert holes(clip_bias=0.0, as_published=True) > 20
    assert holes(clip_bias=0.5, as_published=True) < holes(clip_bias=0.0, as_published=True)


def test_a_look_that_trusts_the_map_draws_holes() -> None:
    with broken_shaders({FILE: ("refracted.a < 0.5", "refracted.a < -1.0")}):
        assert holes(clip_bias=0.0) > 20
