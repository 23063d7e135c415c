"""Requests: one meaning, one key; what a caller leaves out; every mistake told once, where it was made."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pytest
import rfc8785
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from renderer import request as request_module
from renderer.errors import FieldProblem, InvalidRequest
from renderer.request import LAYERS, FrameRequest
from renderer.scene.catalogue import SCENES
from renderer.scene.sky import ConstantSky
from renderer.water.catalogue import TECHNIQUES
from tests.renderer.asking import Fields, frames, noise
from tests.renderer.world import COPY, DRY, EMPTY, EXTENTS, LEVEL, NAME, OWN, STILL

pytestmark = pytest.mark.usefixtures("world")

GREY_BLUE = list(ConstantSky().color)
EYE = {"eye": [9, 3.2, 9], "target": [0, 0.4, 0]}


def parse(**fields: Any) -> FrameRequest:
    return FrameRequest.parse(fields)


# ------------------------------------------------------------------------------------------------- one meaning, one key


@pytest.mark.parametrize(
    "spellings",
    [
        [{}, {"scene": "pond"}, {"water": "luna"}, {"water": {}}, {"water": {"technique": "luna"}}, {"seed": 0}],
        [{"time": 0}, {"time": 0.0}, {"time": -0.0}, {}],
        [{"time": 100}, {"time": 1e2}],
        [{"camera": EYE}, {"camera": {**EYE, "up": [0, 1, 0]}}, {"camera": {**EYE, "fov_y": 45}}],
        [{"camera": {"position": [1, 2, 3]}}, {"camera": {"position": [1, 2, 3], "yaw": -0.0, "roll": 0}}],
        [{"tonemap": "none"}, {"tonemap": {"operator": "none"}}, {"tonemap": {"operator": "none", "exposure": 0}}],
        [{"sky": "constant"}, {"sky": {"model": "constant"}}, {"sky": {"model": "constant", "color": GREY_BLUE}}],
        [{"ambient": "#ffffff"}, {"ambient": [1, 1, 1]}, {"ambient": "#FFFFFF"}],
        [{"period": None}, {"maps": None}, {}],
        [{"water": {"level": None}}, {"water": {"level": 0}}, {"water": {"extents": None}}, {}],
    ],
)
def test_every_spelling_of_a_request_has_one_key(spellings: list[Fields]) -> None:
    assert len({FrameRequest.parse(fields).key() for fields in spellings}) == 1
    assert len({FrameRequest.parse(fields).canonical() for fields in spellings}) == 1


@pytest.mark.parametrize(
    "fields",
    [
        {"time": 1e-9},
        {"seed": 1},
        {"width": 1281},
        {"water": {"ripple_scale": [0.06, 0.031]}},
        {"camera": {"fov_y": 46}},
        {"sun": None},
        {"sun": {"shadows": False}},
        {"format": "webp"},
        {"layers": ["water_mask"]},
        {"fog": {}},
        {"period": 10},
        {"scene": NAME},
    ],
)
def test_another_meaning_has_another_key(fields: Fields) -> None:
    assert FrameRequest.parse(fields).key() != parse().key()


def test_a_key_is_a_digest_of_request_and_sources(monkeypatch: pytest.MonkeyPatch) -> None:
    key = parse().key()
    monkeypatch.setattr(request_module, "source_digest", lambda: "another version")

    assert len(bytes.fromhex(key)) == 32
    assert parse().key() != key


def test_the_order_of_fields_means_nothing() -> None:
    data: Fields = {"time": 2, "water": {"ripple_height": 0.5, "refraction_bias": 0.2}, "camera": EYE}
    backwards = {"camera": dict(reversed(EYE.items())), "water": dict(reversed(data["water"].items())), "time": 2}

    assert FrameRequest.parse(data).key() == FrameRequest.parse(backwards).key()


@settings(max_examples=80, suppress_health_check=[HealthCheck.too_slow])
@given(frames())
def test_the_canonical_form_leads_back_and_is_rfc_8785(fields: Fields) -> None:
    request = FrameRequest.parse(fields)
    canonical = request.canonical()
    data = json.loads(canonical)

    assert FrameRequest.parse(data) == request
    assert FrameRequest.parse(data).canonical() == canonical
    assert rfc8785.dumps(data) == canonical
    assert b"-0," not in canonical


# -------------------------------------------------------------------------------------------- what is left to the scene


def test_what_a_caller_leaves_out_is_the_scenes_own() -> None:
    request = parse(scene=NAME)
    expected = parse(scene=NAME, **OWN, fog=None, water={"level": LEVEL, "extents": list(EXTENTS)})

    assert request == expected
    assert request.key() == expected.key()


@pytest.mark.parametrize(
    ("partial", "whole"),
    [
        ({"camera": {"fov_y": 30}}, {"camera": {**OWN["camera"], "fov_y": 30}}),
        ({"camera": {"eye": [1, 2, 3]}}, {"camera": {**OWN["camera"], "eye": [1, 2, 3]}}),
        (
            {"camera": {"orthographic": {"height": 9}}},
            {"camera": {"eye": [7, 3.2, 9], "target": [0, 0.3, 0], "orthographic": {"height": 9}}},
        ),
        ({"camera": {"position": [1, 2, 3]}}, {"camera": {"position": [1, 2, 3], "fov_y": 45}}),
        ({"sun": {"elevation": 10}}, {"sun": {**OWN["sun"], "elevation": 10}}),
        (
            {"sun": {"direction": [0, 1, 0]}},
            {"sun": {"direction": [0, 1, 0], "color": [1, 0.95, 0.85], "intensity": 1.0}},
        ),
        ({"sky": {"zenith": [1, 0, 0]}}, {"sky": {**OWN["sky"], "zenith": [1, 0, 0]}}),
        ({"sky": {"model": "constant"}}, {"sky": {"model": "constant", "color": GREY_BLUE}}),
        ({"water": {"extents": DRY}}, {"water": {"level": LEVEL, "extents": DRY}}),
    ],
)
def test_a_partial_object_is_laid_over_the_scenes_own_of_the_same_form(partial: Fields, whole: Fields) -> None:
    assert parse(scene=NAME, **partial) == parse(scene=NAME, **whole)


def test_null_is_no_light_not_the_scenes_own() -> None:
    assert parse(scene=NAME, sun=None).sun is None
    assert parse(scene=NAME).sun is not None


def test_parsing_changes_neither_the_callers_data_nor_the_catalogue() -> None:
    data = {"scene": NAME, "camera": {"fov_y": 30}, "water": {"ripple_height": 2.0}, "tonemap": "none"}
    before, own = json.dumps(data), json.dumps(SCENES[NAME].own)
    FrameRequest.parse(data)

    assert json.dumps(data) == before
    assert json.dumps(SCENES[NAME].own) == own


# --------------------------------------------------------------------------------------------------- every mistake once

NAN, INFINITY = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("fields", "path", "bound"),
    [
        ({"nonsense": 1}, "nonsense", "a field of the schema"),
        ({"<nonsense": 1}, "<nonsense", "a field of the schema"),
        ({"water": {"technique": "luna", "rippling": 1}}, "water.rippling", "a field of the schema"),
        ({"camera": {"fov": 45}}, "camera.fov", "a field of the schema"),
        ({"sun": {"colour": None}}, "sun.colour", "a field of the schema"),
        ({"time": NAN}, "time", "a finite number"),
        ({"time": -INFINITY}, "time", "a finite number"),
        ({"camera": {"eye": [NAN, 0, 0]}}, "camera.eye.0", "a finite number"),
        ({"water": {"refraction_bias": INFINITY}}, "water.refraction_bias", "a finite number"),
        ({"ambient": [0, NAN, 0]}, "ambient.1", "a finite number"),
        ({"width": 100_000}, "width", "<= 16384"),
        ({"height": 0}, "height", ">= 1"),
        ({"width": 640.5}, "width", None),
        ({"width": "640"}, "width", None),
        ({"width": True}, "width", None),
        ({"camera": {"eye": [1, 2, 3], "target": [1, 2, 3]}}, "camera.target", "not the eye's place"),
        ({"camera": {"eye": [0, 5, 0], "target": [0, 0, 0]}}, "camera.up", "not parallel to the view"),
        ({"camera": {"eye": [1e8, 0, 0]}}, "camera.eye.0", "<= 10000000.0"),
        ({"camera": {"orbit": {"target": [0, 0, 0], "distance": -1}}}, "camera.orbit.distance", "> 0.0"),
        ({"camera": {"eye": [1, 2, 3], "yaw": 4}}, "camera", None),
        ({"camera": {"fov_y": 40, "orthographic": {"height": 3}}}, "camera", "one of fov_y, intrinsics, orthographic"),
        ({"camera": {"matrix": [1] * 15}}, "camera.matrix", "length >= 16"),
        ({"camera": {"matrix": [1] * 16}}, "camera.matrix", "orthonormal, determinant +1"),
        ({"camera": None}, "camera", None),
        ({"scene": "pnd"}, "scene", f"one of pond, lake, bath, {NAME}, {STILL}, {COPY}, {EMPTY}"),
        ({"scene": 7}, "scene", None),
        ({"water": "lunna"}, "water", "one of " + ", ".join(TECHNIQUES)),
        ({"water": {"technique": "lunna", "ripple_height": 3}}, "water", "one of " + ", ".join(TECHNIQUES)),
        ({"water": {"refraction_bias": 9}}, "water.refraction_bias", "<= 1.0"),
        ({"water": {"refraction_bias": -1.5}}, "water.refraction_bias", ">= -1.0"),
        ({"water": {"refraction_power": 0}}, "water.refraction_power", "> 0.0"),
        ({"water": {"extents": [1, 0, 0, 1]}}, "water.extents", None),
        ({"water": {"velocity_0": [1e300, 0]}}, "water.velocity_0.0", "<= 10000000.0"),
        ({"sky": "gradiant"}, "sky", "one of constant, gradient, analytic"),
        ({"sky": {"model": "gradient", "turbidity": 2}}, "sky.turbidity", "a field of the schema"),
        ({"sun": {"direction": [0, 0, 0]}}, "sun.direction", "length > 0"),
        ({"sun": {"direction": [0, 1, 0], "azimuth": 5}}, "sun", "one of the two forms"),
        ({"fog": {"density": -1}}, "fog.density", ">= 0.0"),
        ({"msaa": 2}, "msaa", "1 or 4"),
        ({"samples": 65}, "samples", "<= 64"),
        ({"period": 0}, "period", ">= 0.001"),
        (
            {"layers": ["color", "water_mask"]},
            "layers",
            "one of " + ", ".join(LAYERS),
        ),
        (
            {"layers": []},
            "layers",
            "one of " + ", ".join(LAYERS),
        ),
        (
            {"layers": ["colour"]},
            "layers.0",
            ", ".join(f"'{name}'" for name in LAYERS[:-1]) + f" or '{LAYERS[-1]}'",
        ),
        ({"tonemap": "filmic"}, "tonemap.operator", "'none', 'reinhard', 'aces' or 'agx'"),
        ({"format": "bmp"}, "format", "'png', 'jpeg' or 'webp'"),
        ({"maps": {"time": 0}}, "maps.camera", None),
        ({"maps": {"time": NAN, "camera": EYE}}, "maps.time", "a finite number"),
        ({"seed": -1}, "seed", ">= 0"),
    ],
)
def test_one_mistake_is_one_problem_with_path_value_and_bound(fields: Fields, path: str, bound: str | None) -> None:
    with pytest.raises(InvalidRequest) as caught:
        FrameRequest.parse(fields)
    (problem,) = caught.value.problems

    assert problem.path == path
    assert problem.message
    assert problem.bound == bound
    if problem.message != "Field required":
        assert problem.value in written(fields, path)


def written(fields: Any, path: str) -> list[Any]:
    """What may count as the value that a caller wrote there: itself, its name, or what the scene has in its place."""
    for part in path.split("."):
        if isinstance(fields, Mapping):
            fields = fields.get(part)
        elif isinstance(fields, list):
            fields = fields[int(part)]
    if fields is None:
        return [None, (0.0, 1.0, 0.0), [0, 1, 0]]
    return [fields, fields.get("technique")] if isinstance(fields, Mapping) else [fields]


def test_two_mistakes_are_two_problems() -> None:
    with pytest.raises(InvalidRequest) as caught:
        parse(width=0, water={"refraction_bias": 9, "rippling": 1})
    assert sorted(problem.path for problem in caught.value.problems) == [
        "water.refraction_bias",
        "water.rippling",
        "width",
    ]


@pytest.mark.parametrize(("name", "hint"), [("pnd", "did you mean 'pond'?"), ("bath tub", "unknown scene")])
def test_an_unknown_name_proposes_the_nearest(name: str, hint: str) -> None:
    with pytest.raises(InvalidRequest, match=hint.replace("?", r"\?")):
        parse(scene=name)


@pytest.mark.parametrize("data", [None, 3, "pond", [], [{}], {1: 2}, True])
def test_what_is_no_object_is_refused(data: Any) -> None:
    with pytest.raises(InvalidRequest):
        FrameRequest.parse(data)


NAMES = sorted(
    {*FrameRequest.model_fields, "eye", "target", "up", "matrix", "orbit", "distance", "technique", "direction"}
)


@settings(max_examples=200, suppress_health_check=[HealthCheck.too_slow])
@given(st.one_of(noise(NAMES), st.dictionaries(st.sampled_from(NAMES), noise(NAMES), max_size=4)), st.booleans())
def test_no_data_raises_anything_but_invalid_request(data: Any, strict: bool) -> None:
    key, problems = "", tuple[FieldProblem, ...]()
    try:
        key = FrameRequest.parse(data, strict=strict).key()
    except InvalidRequest as refused:
        problems = refused.problems

    assert key or problems
    assert all(str(problem) for problem in problems)


@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
@given(frames(), st.data())
def test_a_sound_request_with_one_field_spoilt_is_refused_there(fields: Fields, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(["time", "width", "samples", "ambient", "layers", "msaa", "seed"]))
    with pytest.raises(InvalidRequest) as caught:
        FrameRequest.parse({**fields, name: data.draw(st.sampled_from([NAN, {}, "x", [None], 1e99]))})
    assert {problem.path.split(".")[0] for problem in caught.value.problems} == {name}
