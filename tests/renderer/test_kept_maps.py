"""Maps that frames share: drawn once in a row, and never another byte than maps drawn anew."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.passes import kept_maps
from renderer.passes.kept_maps import KeptMaps, map_window
from renderer.passes.view import WHOLE
from renderer.pipeline import Renderer
from renderer.request import FrameRequest
from renderer.trajectory import Turntable
from tests.renderer.drawing import CAMERAS, EYE, PLAIN, STEEP, Picture, asked, picture
from tests.renderer.world import DRY

pytestmark = pytest.mark.usefixtures("world")

TURN = Turntable(frames=6, fps=10, sweep=20, loop=False, maps_every=3)
PUBLISHED = {"technique": "tut29", "as_published": True}


@pytest.fixture
def painted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Counts the maps that are drawn."""
    count = [0]
    paint = Renderer._paint

    def counting(self: Renderer, world: Any, target: Any, look: Any, spec: Any = None) -> None:
        count[0] += spec is not None
        paint(self, world, target, look, spec)

    monkeypatch.setattr(Renderer, "_paint", counting)
    return count


def color(renderer: Renderer, request: FrameRequest, *, anew: bool = False) -> Picture:
    if anew:
        renderer._kept = KeptMaps()
    return renderer.render(request).color


@pytest.mark.parametrize(
    ("water", "every", "maps"),
    [
        ("tut29", 3, 2 * 2),
        ("tut29", 1, 6 * 2),
        (PUBLISHED, 3, 2 * 2),
        ("luna", 3, 2 * 2),  # the first frame's refraction is the picture itself, the next must draw it
        ("luna", 1, 6 * 1),
    ],
)
def test_frames_in_order_draw_their_maps_once(
    renderer: Renderer, painted: list[int], water: Any, every: int, maps: int
) -> None:
    for request in asked(water=water).along(TURN.model_copy(update={"maps_every": every})):
        renderer.render(request)

    assert painted[0] == maps


def test_sub_frames_that_share_maps_draw_them_once(renderer: Renderer, painted: list[int]) -> None:
    renderer.render(asked(water="tut29", samples=4, maps={"time": 9.5, "camera": STEEP}))

    assert painted[0] == 2


def test_a_frame_with_maps_of_its_own_always_draws_them(renderer: Renderer, painted: list[int]) -> None:
    for _ in range(3):
        renderer.render(asked(water="tut29"))

    assert painted[0] == 6


@pytest.mark.parametrize("water", ["tut29", PUBLISHED, "luna"], ids=str)
@pytest.mark.parametrize("msaa", [1, 4])
def test_kept_maps_change_no_byte(renderer: Renderer, water: Any, msaa: int) -> None:
    requests = asked(water=water, msaa=msaa).along(TURN)
    kept = [color(renderer, request) for request in requests]

    for request, shown in zip(requests, kept, strict=True):
        assert (color(renderer, request, anew=True) == shown).all()
    assert (kept[1] != kept[2]).any(), "the water and the camera move on"


CHANGES: list[dict[str, Any]] = [
    {"sun": None},
    {"ambient": [0.9, 0.1, 0.1]},
    {"sky": {"model": "constant", "color": [1, 0, 0]}},
    {"fog": {"color": [1, 1, 1], "density": 0.2}},
    {"scene": "test copy"},
    {"water": {"technique": "tut29", "level": 0.6}},
    {"water": {"technique": "tut29", "clip_bias": 0.0}},
    {"water": {"technique": "tut29", "extents": [-3.0, 3.0, -3.0, 3.0]}},
    {"water": PUBLISHED},
    {"water": "luna"},
    {"maps": {"time": 2.5, "camera": EYE}},
    {"maps": {"time": 0.5, "camera": STEEP}},
    {"maps": None},
    {"period": 3.0},
    {"width": 161},
    {"msaa": 4},
    {"layers": ["reflection_map"]},
]
SHARED: dict[str, Any] = {**PLAIN, "water": "tut29", "time": 1.0, "maps": {"time": 0.5, "camera": EYE}}


def bytes_hang_on_the_frame_before(renderer: Renderer, change: dict[str, Any]) -> bool:
    """Whether two requests in turn give other bytes than each by itself."""
    first, second = asked(**SHARED), asked(**{**SHARED, **change})
    alone = [color(renderer, request, anew=True) for request in (first, second)]
    in_turn = [color(renderer, request) for request in (second, first, second, first)]
    expected = [alone[1], alone[0], alone[1], alone[0]]
    return any(not np.array_equal(a, b) for a, b in zip(in_turn, expected, strict=True))


@pytest.mark.parametrize("change", CHANGES, ids=str)
def test_whatever_changes_between_two_frames_neither_shows_the_others_maps(
    renderer: Renderer, change: dict[str, Any]
) -> None:
    assert not bytes_hang_on_the_frame_before(renderer, change)


@pytest.mark.parametrize("change", [CHANGES[1], CHANGES[2], CHANGES[3], CHANGES[4], CHANGES[10]], ids=str)
def test_a_key_without_the_world_shows_the_others_maps(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any]
) -> None:
    monkeypatch.setattr("renderer.pipeline.world_of_maps", lambda *_: None)

    assert bytes_hang_on_the_frame_before(renderer, change)


def test_a_copy_of_the_scene_takes_a_kept_maps_place(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    luna = {**SHARED, "water": "luna"}
    monkeypatch.setitem(SHARED, "water", "luna")
    assert not bytes_hang_on_the_frame_before(renderer, {"maps": None, "camera": STEEP})

    monkeypatch.setattr(KeptMaps, "forget", lambda *_: None)
    shared, own = asked(**luna), asked(**{**luna, "maps": None, "camera": STEEP})
    alone = color(renderer, shared, anew=True)
    color(renderer, own)
    assert (color(renderer, shared) != alone).any(), "what is not forgotten is shown"


# ------------------------------------------------------------------------------------- maps from another place or time


@pytest.mark.parametrize("camera", ["upright", "rolled", "steep"])
def test_the_water_reads_only_the_part_of_a_map_that_is_drawn(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, camera: str
) -> None:
    for water in ({"technique": "tut29", "reflect_refract_scale": 0.1}, {"technique": "luna"}):
        for extents in ([-4.0, 4.0, -4.0, 4.0], [-20.0, 20.0, -20.0, 20.0]):
            fields = {**SHARED, "camera": CAMERAS[camera], "water": {**water, "extents": extents}}
            part = color(renderer, asked(**fields), anew=True)
            with monkeypatch.context() as patch:
                patch.setattr("renderer.pipeline.map_window", lambda *_: WHOLE)
                assert (color(renderer, asked(**fields), anew=True) == part).all()


def test_a_map_behind_whose_eye_water_is_seen_is_drawn_whole() -> None:
    water = {"technique": "tut29", "extents": [-4.0, 4.0, -4.0, 4.0]}
    behind = {"position": [0.0, 2.0, 0.0], "yaw": 0.0, "pitch": -20.0, "fov_y": 45}
    request = asked(water=water)
    before = request.view()
    inward = asked(camera={**EYE, "fov_y": 40}, water=water).view()

    assert map_window(request, before, asked(camera=behind).view()) == WHOLE
    assert map_window(request, before, inward) != WHOLE
    assert map_window(request, before, before) != WHOLE
    assert kept_maps.map_window(asked(layers=["reflection_map"]), before, before) == WHOLE


@pytest.mark.parametrize("msaa", [1, 4])
def test_lunas_refraction_map_from_elsewhere_is_the_scene_without_water_from_there(msaa: Any) -> None:
    """Its map is the picture itself otherwise; from another camera and time it is drawn by its own pass."""
    elsewhere = {"time": 2.0, "camera": STEEP}
    read = picture(maps=elsewhere, water="luna", layers=["refraction_map"], msaa=msaa)
    dry = picture(camera=STEEP, time=2.0, water={"extents": DRY})

    assert (read == dry).all()
    assert (picture(maps=elsewhere, water="luna", layers=["reflection_map"]) != dry).any()


@pytest.mark.parametrize("water", ["luna", "tut29"])
def test_maps_at_the_frames_own_time_and_camera_are_its_own(water: str) -> None:
    own = picture(time=1.0, camera=EYE, water=water)

    assert (picture(time=1.0, camera=EYE, water=water, maps={"time": 1.0, "camera": EYE}) == own).all()
