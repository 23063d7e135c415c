"""Tutorial 29's parameters in the picture: the constant weight, and controls that do what they say (R13, R17)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.water.tut29 import Tut29
from tests.renderer.drawing import GRAZING, STEEP, furthest, mask, picture
from tests.renderer.world import EXTENTS

pytestmark = pytest.mark.usefixtures("world")

WATER: dict[str, Any] = {"technique": "tut29"}
FLAT: dict[str, Any] = {**WATER, "normal_map": "flat"}


# -------------------------------------------------------------------------------------------------- R13: the weight, T3


@pytest.mark.parametrize("camera", [STEEP, GRAZING])
@pytest.mark.parametrize("blend", [0.6, 0.25, 0.0, 1.0])
def test_the_weight_is_the_same_at_every_angle(camera: dict[str, Any], blend: float) -> None:
    shown = picture(camera=camera, water={**WATER, "blend": blend}, layers=["reflection_weight"])
    region = mask(camera=camera)

    assert set(np.unique(shown[region])) == {round(255 * (1 - blend))}
    assert not shown[~region].any()


def test_two_fifths_are_reflected() -> None:
    assert 1 - Tut29().blend == pytest.approx(0.4)


# --------------------------------------------------------------------------------------------------- R17: controls, T29


def away(shown: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    return float(np.abs(shown.astype(float) - other)[mask()].mean())


def test_more_scale_moves_more_and_none_moves_nothing() -> None:
    flat = picture(water=FLAT)
    moves = [away(picture(water={**WATER, "reflect_refract_scale": s}), flat) for s in (0.0, 0.003, 0.01, 0.03, 0.06)]

    assert moves[0] == 0
    assert (np.diff(moves) > 0).all()


def test_more_blend_is_nearer_to_the_refraction() -> None:
    through = picture(water={**WATER, "blend": 1.0})
    gaps = [away(picture(water={**WATER, "blend": b}), through) for b in (0.0, 0.25, 0.6, 0.9, 1.0)]

    assert gaps[-1] == 0
    assert (np.diff(gaps) < 0).all()


def test_the_normal_map_is_chosen_by_name_and_by_seed() -> None:
    pictures = [picture(water={**WATER, "normal_map": name}) for name in ("clouds", "waves", "flat")]
    pictures.append(picture(water=WATER, seed=1))

    assert all(away(a, b) > 0.3 for i, a in enumerate(pictures) for b in pictures[:i])


def test_the_water_is_one_tile_unless_more_are_asked_for() -> None:
    """Twice the tiling on a rectangle of twice the side is the same water."""
    wide = [2 * side for side in EXTENTS]
    once, twice = ({**WATER, "extents": wide, "tiling": t} for t in (1.0, 2.0))
    plain = picture(camera=STEEP, water={**WATER, "extents": [-20.0, 60.0, -20.0, 60.0], "tiling": 2.0})

    assert Tut29().tiling == 1.0
    assert furthest(picture(camera=STEEP, water=WATER), plain, mask(camera=STEEP)) <= 1
    assert furthest(picture(camera=STEEP, water=once), picture(camera=STEEP, water=twice), mask(camera=STEEP)) > 10
