"""The lake's time and wind: rows K12 and K13 of Habib 2009, and periods."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.water.lake import Lake
from tests.renderer.drawing import STEEP, broken_shaders, furthest, mask, picture
from tests.renderer.world import EMPTY

pytestmark = pytest.mark.usefixtures("world")

WATER: dict[str, Any] = {"technique": "lake", "wave_height": 0.4, "wave_length": 0.3, "wind_force": 20.0}
TILES_A_SECOND = 0.2
"""At that wind: a hundredth of the force."""


def seen(time: float, period: float | None = None, **more: Any) -> np.ndarray[Any, np.dtype[np.uint8]]:
    return picture(scene="test still", camera=STEEP, time=time, period=period, water={**WATER, **more})


# --------------------------------------------------------------------------------------------------------- K13, T24


def test_the_waves_move_a_hundredth_of_the_winds_force_a_second() -> None:
    """The document counts milliseconds by the hundred thousand."""
    (wind,) = Lake(wind_force=20.0).blocks(1.25, None)

    assert wind.offset[:2] == pytest.approx((0.0, 0.25))  # type: ignore[attr-defined]
    assert Lake(wind_force=0.0).blocks(7.0, None) == Lake(wind_force=0.0).blocks(0.0, None)


@pytest.mark.parametrize("technique", ["lake", "lake_edges"])
@pytest.mark.parametrize(("as_published", "tiles"), [(False, 1), (True, 2)])
def test_the_waves_come_back_after_a_tile_and_mirrored_ones_after_two(
    technique: str, as_published: bool, tiles: int
) -> None:
    water: dict[str, Any] = {"technique": technique, "as_published": as_published}
    first = seen(0.5, **water)

    assert furthest(first, seen(0.5 + tiles / TILES_A_SECOND, **water)) <= 1
    assert furthest(first, seen(0.5 + 0.5 * tiles / TILES_A_SECOND, **water)) > 20


def test_mirrored_tiles_that_repeat_one_by_one_are_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Lake, "_tiles", 1.0)
    before, after = (seen(t, as_published=True) for t in (4.99, 5.01))

    assert furthest(before, after) > 20, "the waves jump where a tile ends"


def test_mirrored_tiles_run_on_without_a_jump() -> None:
    step = [seen(t, as_published=True).astype(int) for t in (4.99, 5.01, 5.03)]

    assert np.abs(step[1] - step[0]).mean() < 2 * np.abs(step[2] - step[1]).mean()


@pytest.mark.parametrize("as_published", [False, True])
@pytest.mark.parametrize("period", [0.7, 5.0, 10.0, 60.0])
def test_a_period_later_every_byte_is_the_same(period: float, as_published: bool) -> None:
    water = {"as_published": as_published}

    assert furthest(seen(0.0, period, **water), seen(period, period, **water)) == 0
    assert furthest(seen(0.0, period, **water), seen(0.4 * period, period, **water), mask(camera=STEEP)) > 20


# --------------------------------------------------------------------------------------------------------- K12, T26

CORNER: dict[str, Any] = {
    "scene": EMPTY,
    "sky": {"model": "gradient", "horizon": [0.9, 0.7, 0.4], "zenith": [0.0, 0.1, 0.5]},
    "time": 3.3,
}
"""A world that looks alike from all sides."""


def turned(wind: float, view: float, **more: Any) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """A view that is turned about the plane's corner, over waves that are turned about it."""
    a = np.radians(view)

    def place(radius: float, height: float) -> list[float]:
        middle = np.radians(45.0)
        return [float(radius * np.cos(middle + a)), height, float(radius * np.sin(middle + a))]

    camera = {"eye": place(40.0, 8.0), "target": place(48.0, 0.0), "fov_y": 40}
    water = {**WATER, "spec_alpha": 0.0, "draw_mode": 100.0, "extents": [0, 80, 0, 80], "wind_direction": wind, **more}
    return picture(**CORNER, camera=camera, water=water)


@pytest.mark.parametrize("angle", [-20.0, 7.0, 20.0])
@pytest.mark.parametrize("as_published", [False, True])
def test_wind_and_camera_turned_alike_see_the_same(angle: float, as_published: bool) -> None:
    base = turned(0.0, 0.0, as_published=as_published)

    assert np.abs(base - turned(angle, -angle, as_published=as_published).astype(int)).max() <= 2
    assert furthest(base, turned(angle, 0.0, as_published=as_published)) > 6


def test_a_scroll_that_is_turned_with_the_waves_is_caught() -> None:
    along = "mat2(turn.x, turn.y, -turn.y, turn.x) * offset"
    with broken_shaders({"lib/lake.glsl": ("turned / wave_length + offset", f"turned / wave_length + {along}")}):
        assert furthest(turned(0.0, 0.0), turned(20.0, -20.0)) > 6


def test_a_whole_turn_of_the_wind_is_none() -> None:
    assert furthest(seen(2.0, wind_direction=360.0), seen(2.0, wind_direction=0.0)) <= 1


@pytest.mark.parametrize(("direction", "way"), [(0.0, (0.0, -1.0)), (90.0, (-1.0, 0.0)), (180.0, (0.0, 1.0))])
def test_the_waves_run_where_the_wind_is_said_to_carry_them(direction: float, way: tuple[float, float]) -> None:
    """What stands at a place now stood, a second before, where the wind comes from."""
    water = {**WATER, "wind_direction": direction, "spec_alpha": 0.0, "draw_mode": 100.0, "wave_length": 0.1}
    moved = 0.2 * 0.1 * 80.0
    eye = np.array([40.0, 12.0, 40.1])

    def at(time: float, shift: float) -> np.ndarray[Any, np.dtype[np.uint8]]:
        here = eye + shift * np.array([way[0], 0.0, way[1]])
        camera = {"eye": here.tolist(), "target": [here[0], 0.0, here[2] - 0.1], "fov_y": 40}
        return picture(**{**CORNER, "time": time}, camera=camera, water={**water, "extents": [0, 80, 0, 80]})

    assert np.abs(at(1.0, 0.0) - at(2.0, moved).astype(int)).max() <= 2
    assert np.abs(at(1.0, 0.0) - at(2.0, -moved).astype(int)).mean() > 0.5
