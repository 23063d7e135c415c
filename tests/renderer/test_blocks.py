from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from pydantic import ValidationError

from renderer.blocks import Block
from renderer.units import Angle, Color, Length, Mat4, Number, Vec2, Vec3, Vec4, Whole


class Sample(Block):
    """Every rule of std140 that members can meet."""

    kind: Literal["sample"] = "sample"
    height: Length = 2.0
    """How high it stands.

    More about it, which no shader needs.
    """
    direction: Vec3 = (1.0, 2.0, 3.0)
    turn: Angle = 180.0
    """A turn."""
    pair: Vec2 = (4.0, 5.0)
    count: Whole = -7
    matrix: Mat4 = tuple(float(v) for v in range(16))
    color: Color = (0.1, 0.2, 0.3)
    last: Vec4 = (6.0, 7.0, 8.0, 9.0)


class Tiny(Block):
    block_name = "Small"

    one: Number = 1.5


class Nothing(Block):
    pass


def test_offsets_follow_std140() -> None:
    offsets = {member.name: member.offset for member in Sample.members()}

    assert offsets == {
        "height": 0,
        "direction": 16,  # a vec3 begins on 16
        "turn": 28,  # and a float fills the rest of its 16
        "pair": 32,
        "count": 40,
        "matrix": 48,
        "color": 112,
        "last": 128,
    }
    assert Sample.size() == 144
    assert Tiny.size() == 16
    assert Nothing.size() == 16


def test_bytes_hold_the_values_where_the_offsets_say() -> None:
    data = Sample().pack()
    floats, whole = np.frombuffer(data, "<f4"), np.frombuffer(data, "<i4")

    assert len(data) == Sample.size()
    assert floats[0] == 2
    assert floats[4:7].tolist() == [1, 2, 3]
    assert floats[7] == np.float32(np.pi)
    assert whole[10] == -7
    assert floats[12:28].reshape(4, 4).T.ravel().tolist() == list(range(16)), "columns, from a matrix given by rows"
    assert floats[32:36].tolist() == [6, 7, 8, 9]


def test_padding_is_zero() -> None:
    padding = np.frombuffer(Sample().pack(), "<f4")[[1, 2, 3, 11, 31]]

    assert not padding.any()


def test_the_source_names_members_units_and_instance() -> None:
    source = Sample.glsl()

    assert source.startswith("layout(std140) uniform Sample\n{\n")
    assert source.endswith("} sample;")
    assert "    float height;  // How high it stands.\n" in source
    assert "    float turn;  // A turn. (radians)\n" in source
    assert "kind" not in source
    assert "More about it" not in source


def test_a_block_may_go_by_another_name() -> None:
    assert "uniform Small\n" in Tiny.glsl()
    assert Tiny.instance_name() == "small"
    assert type("TwoWordsHere", (Block,), {}).instance_name() == "two_words_here"  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "values",
    [
        {"height": float("nan")},
        {"height": "2"},
        {"height": True},
        {"direction": (1.0, 2.0)},
        {"nonsense": 1},
        {"count": 1.5},
    ],
)
def test_what_is_not_declared_is_refused(values: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Sample.model_validate(values)


def test_blocks_do_not_change() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Sample().height = 3.0  # type: ignore[misc]


def test_members_reach_the_schema_with_unit_and_text() -> None:
    schema = Sample.model_json_schema()["properties"]

    assert schema["height"]["x-unit"] == "m"
    assert schema["turn"] == {
        "default": 180.0,
        "description": "A turn.",
        "title": "Turn",
        "type": "number",
        "x-unit": "deg",
    }
