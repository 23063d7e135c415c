from __future__ import annotations

from typing import Any
from urllib.parse import parse_qsl

import pytest
from hypothesis import HealthCheck, given, settings

from renderer.errors import InvalidRequest
from renderer.query import parse_query, to_query
from renderer.request import FrameRequest
from tests.renderer.asking import Fields, frames


def of(query: str) -> Fields:
    return parse_query(parse_qsl(query, keep_blank_values=True))


@pytest.mark.parametrize(
    ("query", "data"),
    [
        ("", {}),
        ("time=1.5&width=640", {"time": 1.5, "width": 640}),
        ("camera.eye=9,3.2,9&camera.target=0,0.4,0", {"camera": {"eye": [9, 3.2, 9], "target": [0, 0.4, 0]}}),
        ("water=luna&water.ripple_scale=0.06,0.03", {"water": {"technique": "luna", "ripple_scale": [0.06, 0.03]}}),
        ("water.technique=luna&water=luna", {"water": {"technique": "luna"}}),
        ("sun=null&period=null&fog=null", {"sun": None, "period": None, "fog": None}),
        ("sun.shadows=false", {"sun": {"shadows": False}}),
        ("sky=gradient&tonemap=none", {"sky": {"model": "gradient"}, "tonemap": {"operator": "none"}}),
        ("ambient=%23ff8000", {"ambient": "#ff8000"}),
        ("layers=water_mask", {"layers": ["water_mask"]}),
        ("layers=color,water_mask", {"layers": ["color", "water_mask"]}),
        ("time=-1e-3&seed=007", {"time": -1e-3, "seed": 7}),
        ("maps.time=2&maps.camera.orbit.distance=3", {"maps": {"time": 2, "camera": {"orbit": {"distance": 3}}}}),
        ("scene=pond&format=png", {"scene": "pond", "format": "png"}),
        ("width=640&sig=abc&kid=1&exp=99&v=3", {"width": 640}),
        ("camera.eye=[1,2,3]", {"camera": {"eye": [1, 2, 3]}}),
        ("water={%22technique%22:%22luna%22}", {"water": {"technique": "luna"}}),
    ],
)
def test_dotted_pairs_become_the_nested_request(query: str, data: Fields) -> None:
    assert of(query) == data


@pytest.mark.parametrize(
    ("query", "path"),
    [
        ("time=1&time=1", "time"),
        ("water=luna&water=luna", "water"),
        ("camera=null&camera.eye=1,2,3", "camera.eye"),
        ("camera.eye=1,2,3&camera=null", "camera"),
        ("water=luna&water.technique=sea", "water"),
        ("a.b.c.d.e.f.g=1", "a.b.c.d.e.f.g"),
        ("camera..eye=1", "camera..eye"),
        (".=1", "."),
    ],
)
def test_contradictions_are_one_problem_each(query: str, path: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        of(query)
    assert [problem.path for problem in caught.value.problems] == [path]


@pytest.mark.parametrize(
    ("query", "path", "value"),
    [
        ("time=soon", "time", "soon"),
        ("time=nan", "time", "nan"),
        ("time=1e999", "time", float("inf")),
        ("width=100000", "width", 100000),
        ("width=640.0", "width", 640.0),
        ("camera.eye=1,2", "camera.eye.2", None),
        ("camera.eye=1,2,x&camera.target=0,0,0", "camera.eye.2", "x"),
        ("nonsense=1", "nonsense", 1),
        ("water.nonsense=1", "water.nonsense", 1),
        ("water=lunna", "water", "lunna"),
        ("sun.shadows=yes", "sun.shadows", "yes"),
        ("tonemap=", "tonemap.operator", ""),
    ],
)
def test_bad_values_are_told_by_their_dotted_path(query: str, path: str, value: Any) -> None:
    with pytest.raises(InvalidRequest) as caught:
        FrameRequest.parse(of(query))
    assert [(problem.path, problem.value) for problem in caught.value.problems] == [(path, value)]


def test_deep_json_is_no_crash() -> None:
    with pytest.raises(InvalidRequest):
        FrameRequest.parse(of("maps=" + "[" * 100_000))


@settings(max_examples=80, suppress_health_check=[HealthCheck.too_slow])
@given(frames())
def test_a_query_leads_back_to_its_request(fields: Fields) -> None:
    request = FrameRequest.parse(fields)
    again = FrameRequest.parse(of(to_query(request)))

    assert again == request
    assert again.key() == request.key()


def test_the_queries_of_a_scene_with_fog_and_without_sun_lead_back() -> None:
    for fields in ({"fog": {"density": 0.02}}, {"sun": None}, {"fog": None, "sun": None, "maps": None}):
        request = FrameRequest.parse(fields)

        assert FrameRequest.parse(of(to_query(request))) == request
