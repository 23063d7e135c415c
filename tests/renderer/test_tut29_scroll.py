"""Tutorial 29's scroll: exact from the index of the frame at any time, periodic where a period asks for it (R10)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.request import LATEST
from renderer.water.tut29 import Tut29, frame_scroll
from tests.reference.tut29 import summed_translation, translation
from tests.renderer.drawing import PLAIN, STEEP, Picture, broken_shaders, drawn, furthest, mask, picture
from tests.renderer.world import STILL

pytestmark = pytest.mark.usefixtures("world")

WATER: dict[str, Any] = {"technique": "tut29", "reflect_refract_scale": 0.03}
RATES = [60.0, 30.0, 24.0, 29.97]


def phase(time: float, rate: float = 60.0, period: float | None = None) -> float:
    return frame_scroll(time, rate, period).offsets[1]


def shown(time: float, **fields: Any) -> Picture:
    return picture(scene=STILL, camera=STEEP, water=WATER, time=time, **fields)


@pytest.mark.parametrize("frame", [0, 1, 999, 1000, 1001, 10**7, -1])
def test_the_scroll_is_a_thousandth_a_frame_without_its_whole_part(frame: int) -> None:
    assert phase(frame / 60) == translation(frame)
    assert frame_scroll(frame / 60, 60.0, None).offsets[0] == 0, "it moves along y alone"


@pytest.mark.parametrize("rate", RATES)
def test_every_frame_is_hit_at_its_own_time_however_late(rate: float) -> None:
    frames = np.random.default_rng(10).integers(0, int(LATEST * rate), 20_000)

    assert [phase(k / rate, rate) for k in frames.tolist()] == [translation(k) for k in frames.tolist()]
    assert rate == 24.0 or any(int(k / rate * rate) != k for k in frames.tolist()), "rounding would miss some"


def test_between_frames_nothing_moves() -> None:
    assert phase(7.01 / 60) == phase(7.99 / 60) == translation(7)


def test_the_documents_sum_drifts_by_a_frame_in_a_hundred_thousand() -> None:
    assert abs(summed_translation(100_500) - translation(100_500)) > 0.0008
    assert summed_translation(10) == pytest.approx(translation(10), abs=1e-6)


def test_a_frame_rate_of_nothing_stops_the_water() -> None:
    assert phase(1234.5, 0.0) == 0
    assert frame_scroll(1234.5, 0.0, 7.0).blend == 0


def test_a_thousand_frames_later_every_byte_is_the_same() -> None:
    first = shown(0.25)

    assert furthest(shown(0.25 + 1000 / 60), first) == 0
    assert furthest(shown((15 + 10**7) / 60), first) == 0
    assert furthest(shown(0.25 + 999 / 60), first) > 5


@pytest.mark.parametrize("period", [4.0, 1.23, 0.01, 1000 / 60, 12345.678])
@pytest.mark.parametrize("start", [0.0, 0.3, 0.77])
def test_a_period_later_the_scroll_is_the_same(period: float, start: float) -> None:
    first = frame_scroll(start * period, 60.0, period)

    for turns in (1, 2, -1, 7):
        again = frame_scroll(start * period + turns * period, 60.0, period)
        assert again == first
    assert 0 <= first.blend <= 1
    assert all(0 <= offset < 1 for offset in first.offsets)


@pytest.mark.parametrize("period", [4.0, 1.23, 1000 / 60, 2000 / 60])
def test_a_period_later_every_byte_is_the_same(period: float) -> None:
    assert furthest(shown(0.3, period=period), shown(0.3 + period, period=period)) == 0


def test_a_period_of_a_thousand_frames_blends_nothing() -> None:
    for time in (0.0, 0.3, 9.9):
        assert furthest(shown(time, period=1000 / 60), shown(time)) == 0
        assert frame_scroll(time, 60.0, 1000 / 60).blend == 0
    assert Tut29().defines(1000 / 60) == ()
    assert Tut29().defines(4.0) == ("TWO_PHASES",)


def test_a_loop_closes_as_smoothly_as_it_runs() -> None:
    step = 1 / 60
    along = furthest(shown(2.0, period=4.0), shown(2.0 + step, period=4.0))
    closing = furthest(shown(4.0 - step, period=4.0), shown(4.0, period=4.0))

    assert 0 < closing <= 2 * along + 4


def liveliness(time: float) -> float:
    """The standard deviation of the shift, in steps of the layer's 255."""
    fields: dict[str, Any] = {**PLAIN, "camera": STEEP, "water": {**WATER, "tiling": 6.0}}
    layer = drawn(**fields, scene=STILL, time=time, period=4.0, layers=["perturbation"]).color
    return float(layer[mask(camera=STEEP)][:, :2].std())


def loss_halfway() -> float:
    return 1 - liveliness(2.0) / liveliness(0.0)


def test_two_phases_are_as_lively_as_one() -> None:
    assert abs(loss_halfway()) < 0.1


def test_a_plain_mean_of_two_phases_is_calmer() -> None:
    with broken_shaders({"lib/normals.glsl": (" * inversesqrt(later * later + earlier * earlier)", "")}):
        assert loss_halfway() > 0.2
