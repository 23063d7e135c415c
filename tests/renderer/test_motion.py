"""Time: what repeats does so to the bit, moves in between as lively as ever, and stays sharp however late it is."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.passes.view import Wind
from renderer.water import scroll
from renderer.water.scroll import Scroll
from tests.renderer.drawing import MIRROR, drawn, furthest, mask, picture
from tests.renderer.world import EMPTY

pytestmark = pytest.mark.usefixtures("world")

VIEW = {"eye": [5.0, 4.0, 7.0], "target": [0.0, 0.0, 0.0], "fov_y": 50}
RIPPLED: dict[str, Any] = {**MIRROR, "ripple_scale": [0.2, 0.2], "ripple_height": 1.0, "refraction_bias": 0.1}


def seen(time: float, period: float | None = None, **fields: Any) -> np.ndarray[Any, np.dtype[np.uint8]]:
    return picture(camera=VIEW, time=time, period=period, **fields)


@pytest.mark.parametrize("period", [0.5, 3.0, 7.3, 60.0])
@pytest.mark.parametrize("start", [0.0, 1.75])
def test_a_period_later_every_byte_is_the_same(period: float, start: float) -> None:
    assert furthest(seen(start, period), seen(start + period, period)) <= (0 if start == 0 else 1)
    assert furthest(seen(start, period), seen(start - 3 * period, period)) <= 1


def test_the_water_and_the_reed_move_in_between() -> None:
    water = mask(camera=VIEW, time=0.0)

    steps = [seen(step, 3.0) for step in (0.4, 0.8, 2.6)]

    assert min(furthest(seen(0.0, 3.0), later, water) for later in steps) > 20
    assert max(furthest(seen(0.0, 3.0), later, ~water) for later in steps) > 20


def motion(period: float | None, *, steps: int = 12, step: float = 0.25) -> list[float]:
    """How much the water changes in each step, over a period of three seconds."""
    sky = {"scene": EMPTY, "sky": {"model": "gradient", "horizon": [0.9] * 3, "zenith": [0.0] * 3}, "water": RIPPLED}
    frames = [seen(k * step, period, **sky).astype(float) for k in range(steps + 1)]
    return [float(np.abs(b - a).mean()) for a, b in pairwise(frames)]


def test_a_loop_is_as_lively_as_water_that_runs_on() -> None:
    free, loop = motion(None), motion(3.0)

    assert 0.7 < np.mean(loop) / np.mean(free) < 1.4
    assert max(loop) < 2.0 * np.mean(loop), "no jump, at the seam or elsewhere"


def test_a_loop_by_turning_back_the_clock_jumps(monkeypatch: pytest.MonkeyPatch) -> None:
    at = Scroll.at

    def turned_back(velocity: tuple[float, float], time: float, period: float | None) -> Scroll:
        return at(velocity, time if period is None else math.fmod(time, period), None)

    monkeypatch.setattr(Scroll, "at", turned_back)
    monkeypatch.setattr(Scroll, "needs_blend", lambda *_: False)
    loop = motion(3.0)

    assert max(loop) > 1.3 * np.median(loop)


def test_the_documents_scroll_comes_back_by_itself_after_a_hundred_seconds() -> None:
    assert furthest(seen(0.0), seen(100.0)) <= 1
    assert furthest(seen(0.0), seen(50.0), mask(camera=VIEW)) > 20


def late_motion() -> float:
    """How far single steps of a film of the millionth second are from an even flow, as a share of a step."""
    frames = [seen(1e6 + k / 60, water=RIPPLED, scene=EMPTY).astype(float) for k in range(7)]
    steps = [float(np.abs(b - a).mean()) for a, b in pairwise(frames)]
    return float(np.std(steps) / np.mean(steps)) if np.mean(steps) > 0 else 1.0


def test_late_water_is_sharp_and_flows_evenly() -> None:
    assert late_motion() < 0.1
    assert furthest(seen(1e6), seen(0.0)) <= 1, "a million seconds are ten thousand rounds of the scroll"


def test_phases_in_single_precision_would_stutter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scroll, "_phase", lambda tiles: float(np.float32(tiles) % np.float32(1)))

    assert late_motion() > 0.3


@given(st.floats(-1e6, 1e6), st.floats(0.01, 1e4), st.tuples(st.floats(-3, 3), st.floats(-3, 3)))
def test_offsets_lie_in_one_tile_and_weights_in_one(time: float, period: float, velocity: tuple[float, float]) -> None:
    for moment in (Scroll.at(velocity, time, period), Scroll.at(velocity, time, None)):
        assert all(0 <= offset <= 1 for offset in moment.offsets)
        assert 0 <= moment.blend <= 1


@given(st.floats(0.01, 1e4), st.tuples(st.floats(-3, 3), st.floats(-3, 3)))
def test_a_scroll_at_its_period_is_the_scroll_at_zero(period: float, velocity: tuple[float, float]) -> None:
    assert Scroll.at(velocity, period, period) == Scroll.at(velocity, 0.0, period)


@pytest.mark.parametrize("period", [0.5, 3.0, 10.0, 60.0])
def test_wind_swings_whole_turns_in_a_period(period: float) -> None:
    assert Wind.at(period, period) == Wind.at(0.0, period)
    assert Wind.at(period / 3, period) != Wind.at(0.0, period)


def test_wind_is_the_same_in_the_reflection() -> None:
    """The reed and its mirror image stand at one moment, unless the maps are asked for at another."""
    here = drawn(camera=VIEW, time=1.0, msaa=1, water=MIRROR).color
    elsewhen = drawn(camera=VIEW, time=1.0, msaa=1, water=MIRROR, maps={"time": 3.0, "camera": {**VIEW}}).color
    same = drawn(camera=VIEW, time=1.0, msaa=1, water=MIRROR, maps={"time": 1.0, "camera": {**VIEW}}).color
    water = mask(camera=VIEW, time=1.0)

    assert furthest(here, same) == 0
    assert furthest(here, elsewhen, water) > 20
    assert furthest(here, elsewhen, ~water) == 0
