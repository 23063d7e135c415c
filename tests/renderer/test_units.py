from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from renderer import units
from renderer.units import FARTHEST, linear_from_srgb, srgb_from_linear


def accepts(kind: Any, value: Any) -> bool:
    try:
        TypeAdapter(kind).validate_python(value)
    except ValidationError:
        return False
    return True


@pytest.mark.parametrize("kind", [units.Number, units.Unit, units.Length, units.Seconds, units.Angle])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_numbers_are_finite(kind: Any, value: float) -> None:
    assert accepts(kind, 0.5)
    assert not accepts(kind, value)


@pytest.mark.parametrize(
    ("kind", "count"), [(units.Vec2, 2), (units.Vec3, 3), (units.Point, 3), (units.Vec4, 4), (units.Mat4, 16)]
)
def test_vectors_have_their_length_and_are_finite(kind: Any, count: int) -> None:
    assert accepts(kind, [0.5] * count)
    assert accepts(kind, np.full(count, 0.5))
    assert not accepts(kind, [0.5] * (count - 1))
    assert not accepts(kind, [0.5] * (count + 1))
    assert not accepts(kind, [0.5] * (count - 1) + [float("nan")])


@pytest.mark.parametrize(("kind", "count"), [(units.Vec2, 2), (units.Point, 3), (units.Direction, 3)])
def test_places_end_where_a_float_no_longer_tells_metres_apart(kind: Any, count: int) -> None:
    assert accepts(kind, [FARTHEST] * count)
    assert not accepts(kind, [FARTHEST * 1.001] + [0.0] * (count - 1))
    assert np.float32(FARTHEST) - np.float32(FARTHEST - 1) == 1


def test_units_reach_the_schema() -> None:
    wanted = {units.Length: "m", units.Seconds: "s", units.Angle: "deg"}

    assert {kind: TypeAdapter(kind).json_schema().get("x-unit") for kind in wanted} == wanted


@pytest.mark.parametrize(
    ("text", "linear"),
    [
        ("#000000", (0.0, 0.0, 0.0)),
        ("#ffffff", (1.0, 1.0, 1.0)),
        ("#808080", (0.2158605001,) * 3),
        ("#0A0a0A", (0.0030352698,) * 3),
        ("#ff8000", (1.0, 0.2158605001, 0.0)),
    ],
)
def test_hex_colours_are_decoded_to_linear_light(text: str, linear: tuple[float, ...]) -> None:
    assert TypeAdapter(units.Color).validate_python(text) == pytest.approx(linear, abs=1e-9)


@pytest.mark.parametrize(
    "value", ["#fff", "808080", "#80808g", "#8080808", "red", "", "#808080\n", [-0.1, 0, 0], [1e5, 0, 0], 3]
)
def test_what_is_no_colour_is_refused(value: Any) -> None:
    assert not accepts(units.Color, value)


@given(st.integers(0, 255))
def test_srgb_survives_the_way_there_and_back(byte: int) -> None:
    assert round(float(srgb_from_linear(np.array(linear_from_srgb(byte / 255)))) * 255) == byte


def test_the_srgb_curve_has_no_step_where_its_parts_meet() -> None:
    below, above = srgb_from_linear(np.array([0.0031307, 0.0031309]))

    assert 0 < above - below < 1e-5
