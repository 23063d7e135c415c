from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from renderer.light import Fog, LightBlock, Sun, ToneMap


def test_a_sun_given_either_way_shines_from_one_place() -> None:
    by_angles = Sun.model_validate({"azimuth": 135.0, "elevation": 38.0})
    east, up, south = (
        np.sin(np.radians(135)) * np.cos(np.radians(38)),
        np.sin(np.radians(38)),
        -np.cos(np.radians(135)) * np.cos(np.radians(38)),
    )

    assert by_angles.towards == pytest.approx((east, up, south))
    assert east > 0, "south-east, as azimuth 135 says"
    assert south > 0
    assert Sun.model_validate({"direction": [7 * east, 7 * up, 7 * south]}).towards == pytest.approx(by_angles.towards)
    assert Sun().towards == pytest.approx(by_angles.towards), "the default"


def test_one_angle_leaves_the_other_at_its_default() -> None:
    sun = Sun.model_validate({"elevation": 10.0})

    assert (sun.azimuth, sun.elevation) == (135.0, 10.0)


@pytest.mark.parametrize(
    ("fields", "path"),
    [
        ({"direction": [0, 0, 0]}, "direction"),
        ({"direction": [1, 0, 0], "azimuth": 3}, ""),
        ({"elevation": 91}, "elevation"),
        ({"intensity": -1}, "intensity"),
        ({"color": [1, 1]}, "color.2"),
        ({"color": None}, "color"),
        ({"shadows": None}, "shadows"),
        ({"colour": None}, "colour"),
        ({"direction": [1, 0, 0], "shadows": None}, "shadows"),
    ],
)
def test_what_is_no_sun_is_one_error(fields: dict[str, Any], path: str) -> None:
    with pytest.raises(ValidationError) as caught:
        Sun.model_validate(fields)
    assert [".".join(str(part) for part in error["loc"]) for error in caught.value.errors()] == [path]


def test_no_sun_is_no_light() -> None:
    block = LightBlock.of(None, (0.1, 0.2, 0.3), 1.5, 1.0)

    assert block.sun_radiance == (0.0, 0.0, 0.0)
    assert block.ambient == (0.1, 0.2, 0.3)
    assert block.water_level == 1.5


def test_the_brightest_sun_that_may_be_asked_for_fits_its_block() -> None:
    sun = Sun.model_validate({"color": [1e4] * 3, "intensity": 1000})

    assert LightBlock.of(sun, (1e4,) * 3, 1e5, 1.0).sun_radiance == (1e7,) * 3


def test_negative_fog_and_unknown_operators_are_refused() -> None:
    for declaration, fields in (
        (Fog, {"density": -1}),
        (Fog, {"height_falloff": -1}),
        (ToneMap, {"operator": "filmic"}),
    ):
        with pytest.raises(ValidationError):
            declaration.model_validate(fields)
