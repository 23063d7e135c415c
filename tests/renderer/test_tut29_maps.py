"""What enters tutorial 29's maps, as published and otherwise (R6, R7, R9), and what mirrored cameras lose."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera, Lens, pose, rotation_from_angles
from renderer.passes.mapping import map_look
from renderer.scene.catalogue import SCENES
from renderer.water.technique import MapSpec
from renderer.water.tut29 import Tut29
from tests.renderer.drawing import Picture, asked, picture
from tests.renderer.world import LEVEL, entry_of, objects

pytestmark = pytest.mark.usefixtures("world")

TAGGED = "test tagged"
TAGS = {"post": "reflected", "drowned": "refracted"}
WATER: dict[str, Any] = {"technique": "tut29"}
PUBLISHED: dict[str, Any] = {**WATER, "as_published": True}


@pytest.fixture(scope="module")
def tagged(world: Any) -> Iterator[None]:
    """The test world with the post tagged as reflected and the drowned box as refracted."""
    parts = tuple(
        replace(part, tags=part.tags | ({TAGS[part.name]} if part.name in TAGS else set())) for part in objects()
    )
    SCENES[TAGGED] = entry_of(TAGGED, parts)
    yield
    del SCENES[TAGGED]


def has(shown: Picture, color: str) -> bool:
    """Whether a map shows a saturated box of this colour."""
    r, g, b = (shown[..., k].astype(int) for k in range(3))
    boxes = {
        "red": (r > 2 * g) & (r > 2 * b) & (r > 60),
        "green": (g > 2 * r) & (g > 2 * b) & (g > 60),
        "yellow": (r > 2 * b) & (g > 2 * b) & (g > 0.75 * r) & (r > 120),
    }
    return int(boxes[color].sum()) > 15


def colors(water: dict[str, Any], layer: str, scene: str = TAGGED) -> set[str]:
    shown = picture(scene=scene, water=water, layers=[layer])
    return {color for color in ("red", "green", "yellow") if has(shown, color)}


@pytest.mark.usefixtures("tagged")
def test_as_published_a_map_holds_what_is_tagged_for_it_on_black() -> None:
    assert colors(PUBLISHED, "refraction_map") == {"green"}
    assert colors(PUBLISHED, "reflection_map") == {"red"}
    for layer in ("refraction_map", "reflection_map"):
        shown = picture(scene=TAGGED, water=PUBLISHED, layers=[layer])
        assert (shown.max(axis=-1) == 0).mean() > 0.6, "no sky, nothing else"


@pytest.mark.usefixtures("tagged")
def test_otherwise_the_reflection_holds_all_that_stands_above_the_water_and_the_sky() -> None:
    assert colors(WATER, "reflection_map") == {"red", "yellow"}
    assert colors(WATER, "refraction_map") == {"green"}
    shown = picture(scene=TAGGED, water=WATER, layers=["reflection_map"], sky={"model": "constant", "color": [0, 0, 1]})
    assert ((shown[..., 2] == 255) & (shown[..., 0] == 0)).mean() > 0.1


def test_without_tags_a_map_holds_everything() -> None:
    assert colors(PUBLISHED, "refraction_map", "test") >= {"green", "red"}
    assert colors(WATER, "refraction_map", "test") >= {"green", "red"}


def test_as_published_nothing_clips_the_reflection() -> None:
    """What lies under water then stands above it in the mirror, before what the water mirrors."""
    assert "green" in colors(PUBLISHED, "reflection_map", "test")
    assert "green" not in colors(WATER, "reflection_map", "test")


def at_post(height: float, **water: Any) -> NDArray[np.uint8]:
    """What the refraction map shows of the post's front this far above the water."""
    camera = {"eye": [0.0, 1.5, 4.0], "target": [0.0, LEVEL, 0.0], "fov_y": 40}
    size = {"width": 320, "height": 180}
    shown = picture(camera=camera, water={**WATER, **water}, layers=["refraction_map"], **size)
    x, y, _ = asked(camera=camera, **size).view().project(np.array([[0.0, LEVEL + height, 0.6]]))[0]
    return np.asarray(shown[int((1 - y) / 2 * 180), int((1 + x) / 2 * 320)])


def is_red(pixel: NDArray[np.uint8]) -> bool:
    return bool(pixel[0] > 60 and pixel[1] < pixel[0] / 2)


@pytest.mark.parametrize("as_published", [False, True])
def test_the_refraction_is_clipped_a_tenth_above_the_water(as_published: bool) -> None:
    assert is_red(at_post(0.07, as_published=as_published))
    assert not is_red(at_post(0.13, as_published=as_published))
    assert not is_red(at_post(0.07, as_published=as_published, clip_bias=0.0)), "exercise 5: at the exact height"
    assert is_red(at_post(-0.05, as_published=as_published, clip_bias=0.0))


# ----------------------------------------------------------------------------------- R9: what the mirrored cameras lose

SIZE = (320, 180)


def loss(spec: MapSpec, pitch: float, roll: float) -> float:
    """The share, in per cent, of the water's pixels that read the map outside it.

    The water is an endless plane, the picture 16:9 with a vertical field of 45 degrees: what is lost then hangs on
    pitch and roll alone, not on the eye's height.
    """
    width, height = SIZE
    focal = height / 2 / np.tan(np.radians(22.5))
    eye = np.array([0.0, LEVEL + 5.0, 0.0])
    camera = Camera(
        pose(rotation_from_angles(30.0, pitch, roll), eye), Lens(focal, focal, width / 2, height / 2), width, height
    )
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    rays = np.stack([x, y, np.ones_like(x), np.zeros_like(x)], axis=-1).reshape(-1, 4) @ camera.ray_from_ndc.T
    down = rays[rays[:, 1] < 0, :3]
    water = eye - down * (5.0 / down[:, 1])[:, None]
    clip = np.c_[water, np.ones(len(water))] @ map_look(spec, camera, LEVEL).camera.clip_from_world.T
    place = clip[:, :2] / clip[:, 3:]
    return float(100 * ((np.abs(place) > 1 + 1e-9).any(axis=1) | (clip[:, 3] <= 0)).mean())


TRUE = Tut29().maps()["reflection"]
YAW_ONLY = Tut29(as_published=True).maps()["reflection"]
LOOK_AT = MapSpec("look_at")


@pytest.mark.parametrize(
    ("pitch", "roll", "look_at", "yaw_only"),
    [
        (-15, 0, 0.3, 43.0),
        (-15, 5, 6.0, 44.0),
        (-15, 15, 13.7, 44.0),
        (-15, 30, 24.0, 46.0),
        (-40, 0, 0.0, 88.0),
        (0, 15, 21.3, 12.9),
    ],
)
def test_the_published_mirrors_lose_what_was_measured_and_the_true_one_nothing(
    pitch: float, roll: float, look_at: float, yaw_only: float
) -> None:
    """The measured figures hold up to 1.7 of a hundred pixels that fall on the border."""
    assert loss(TRUE, pitch, roll) == 0
    assert loss(LOOK_AT, pitch, roll) == pytest.approx(look_at, abs=1.2)
    assert loss(YAW_ONLY, pitch, roll) == pytest.approx(yaw_only, abs=1.2)


def test_a_level_camera_loses_nothing_to_the_documents_mirror() -> None:
    assert loss(YAW_ONLY, 0, 0) == 0
