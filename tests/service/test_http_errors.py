"""Every refusal is problem+json that names the mistake, and does no harm."""

from __future__ import annotations

import json
import socket
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest

from renderer.water.catalogue import TECHNIQUES
from service.problem_kinds import KINDS
from tests.service.conftest import Server

QUERY = "width=64&height=36"


def problem(answer: httpx.Response, status: int, kind: str) -> dict[str, Any]:
    """The body of a problem, checked for what every problem has."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["cache-control"] == "no-store"
    body: dict[str, Any] = answer.json()
    assert body["type"] == f"/problems/{kind}"
    assert body["title"] == KINDS[kind].title
    assert body["status"] == status
    assert body["detail"]
    assert body["instance"] == answer.request.url.path
    assert body["request_id"] == answer.headers["x-request-id"]
    if status in {429, 503}:
        assert int(answer.headers["retry-after"]) > 0
    return body


def mistakes(answer: httpx.Response) -> list[dict[str, Any]]:
    """The entries of a 422."""
    errors: list[dict[str, Any]] = problem(answer, 422, "invalid-request")["errors"]
    return errors


BAD_BODIES: list[tuple[str, dict[str, Any]]] = [
    ('{"watr": "luna"}', {"path": "watr", "value": "luna"}),
    ('{"water": {"technique": "luna", "refraction_bais": 1}}', {"path": "water.refraction_bais", "value": 1}),
    (
        '{"water": {"technique": "luna", "refraction_bias": 9}}',
        {"path": "water.refraction_bias", "value": 9, "bound": "<= 1.0"},
    ),
    ('{"time": NaN}', {"path": "time", "value": "NaN", "bound": "a finite number"}),
    ('{"time": Infinity}', {"path": "time", "value": "Infinity"}),
    ('{"time": 1e999}', {"path": "time", "value": "Infinity"}),
    ('{"camera": {"eye": [0, NaN, 1], "target": [0, 0, 0]}}', {"path": "camera.eye.1", "value": "NaN"}),
    ('{"width": 100000}', {"path": "width", "value": 100_000, "bound": "<= 8192"}),
    ('{"width": 8192, "height": 8192}', {"path": "width", "value": 8192, "bound": "width * height <= 12441600"}),
    ('{"samples": 65}', {"path": "samples", "value": 65, "bound": "<= 64"}),
    ('{"width": 0}', {"path": "width", "value": 0, "bound": ">= 1"}),
    ('{"width": "64"}', {"path": "width", "value": "64"}),
    ('{"width": 64.5}', {"path": "width", "value": 64.5}),
    ('{"width": true}', {"path": "width", "value": True}),
    (
        '{"camera": {"eye": [1, 2, 3], "target": [1, 2, 3]}}',
        {"path": "camera.target", "value": [1, 2, 3]},
    ),
    (
        '{"camera": {"eye": [0, 9, 0], "target": [0, 0, 0], "up": [0, 1, 0]}}',
        {"path": "camera.up", "value": [0, 1, 0]},
    ),
    ('{"scene": "pnd"}', {"path": "scene", "value": "pnd", "bound": "one of pond, lake, bath"}),
    ('{"water": "lunar"}', {"path": "water", "value": "lunar", "bound": "one of " + ", ".join(TECHNIQUES)}),
    ('{"format": "gif"}', {"path": "format", "value": "gif"}),
    ('{"time": 1, "time": 2}', {"path": "time"}),
    ('{"water": {"technique": "luna", "tile_0": 1, "tile_0": 2}}', {"path": "water.tile_0"}),
    ('{"camera": "\\ud800"}', {"path": "camera"}),
    ('{"scene": "\\ud800"}', {"path": ""}),
    ("[1, 2]", {"path": "", "value": [1, 2]}),
    ('{"x": 1, "x": ' + "[" * 900 + "]" * 900 + "}", {"path": "x"}),
    ('{"water": ' + "[" * 900 + "]" * 900 + "}", {"path": "water"}),
    ('"pond"', {"path": "", "value": "pond"}),
]


@pytest.mark.parametrize(("text", "expected"), BAD_BODIES, ids=[text[:48] for text, _ in BAD_BODIES])
def test_a_bad_body_is_one_mistake_with_path_value_and_bound(
    http: httpx.Client, text: str, expected: dict[str, Any]
) -> None:
    answer = http.post("/v1/frame", content=text, headers={"Content-Type": "application/json"})

    (mistake,) = mistakes(answer)
    assert expected.items() <= mistake.items()
    assert mistake["message"]


@pytest.mark.parametrize(
    ("query", "path"),
    [
        ("watr=luna", "watr"),
        ("time=nan", "time"),
        ("time=1e999", "time"),
        ("width=100000", "width"),
        ("width=1&width=2", "width"),
        ("camera.eye=1,2,3&camera.target=1,2,3", "camera.target"),
        ("scene=pnd", "scene"),
        ("water=lunar", "water"),
        ("water.refraction_bias=-3", "water.refraction_bias"),
        ("time=%ff", ""),
        ("time=", "time"),
        ("format=png,jpeg", "format"),
        ("a.b.c.d.e.f.g.h=1", "a.b.c.d.e.f.g.h"),
        (".=1", "."),
    ],
)
def test_a_bad_query_names_the_field_as_it_was_written(http: httpx.Client, query: str, path: str) -> None:
    (mistake,) = mistakes(http.get(f"/v1/frame?{query}"))

    assert mistake["path"] == path


def test_two_mistakes_are_both_told(http: httpx.Client) -> None:
    found = mistakes(http.post("/v1/frame", json={"tme": 1, "seed": -1}))

    assert sorted(mistake["path"] for mistake in found) == ["seed", "tme"]


def test_suffix_and_format_must_agree(http: httpx.Client) -> None:
    (mistake,) = mistakes(http.get(f"/v1/frame.png?{QUERY}&format=jpeg"))

    assert mistake == {"path": "format", "message": "the name ends in .png", "value": "jpeg", "bound": "png"}


def test_an_unknown_suffix_is_404_with_the_list(http: httpx.Client) -> None:
    body = problem(http.get("/v1/frame.gif"), 404, "not-found")

    assert ".png" in body["detail"]
    assert ".webp" in body["detail"]


def test_fields_of_a_post_stand_in_its_body_alone(http: httpx.Client) -> None:
    (mistake,) = mistakes(http.post("/v1/frame?width=64", json={}))

    assert mistake["path"] == "width"


@pytest.mark.parametrize(
    ("content", "media_type", "status", "kind"),
    [
        (b"{", "application/json", 400, "malformed-body"),
        (b"", "application/json", 400, "malformed-body"),
        (b"\xff\xfe{}", "application/json", 400, "malformed-body"),
        (b"[" * 30_000, "application/json", 400, "malformed-body"),
        (b'{"time": ' + b"9" * 5000 + b"}", "application/json", 400, "malformed-body"),
        (b"{}", "text/plain", 415, "unsupported-media-type"),
        (b"{}", "", 415, "unsupported-media-type"),
        (b"{}", "multipart/form-data; boundary=x", 415, "unsupported-media-type"),
        (b" " * 70_000, "application/json", 413, "too-large"),
    ],
)
def test_bodies_that_are_no_request(
    http: httpx.Client, content: bytes, media_type: str, status: int, kind: str
) -> None:
    answer = http.post("/v1/frame", content=content, headers={"Content-Type": media_type} if media_type else {})

    body = problem(answer, status, kind)
    if status == 413:
        assert body["bound"] == 65_536


def test_a_body_without_a_length_is_cut_off_at_the_cap(http: httpx.Client) -> None:
    def endless() -> Any:
        for _ in range(100):
            yield b" " * 10_000

    try:
        answer = http.post("/v1/frame", content=endless(), headers={"Content-Type": "application/json"})
    except httpx.WriteError:  # the server has closed already
        return
    problem(answer, 413, "too-large")


def test_a_json_suffix_type_is_json(http: httpx.Client) -> None:
    answer = http.post(
        "/v1/frame", content=b'{"width":64,"height":36}', headers={"Content-Type": "application/vnd.x+json"}
    )

    assert answer.status_code == 200


@pytest.mark.parametrize("path", ["/nowhere", "/v1", "/v1/frames", "/v1/frame/", "/problems/nothing", "/docs/x", "//"])
def test_unknown_paths_are_problems(http: httpx.Client, path: str) -> None:
    problem(http.get(f"{http.base_url}".rstrip("/") + path), 404, "not-found")


@pytest.mark.parametrize(
    ("method", "path"), [("PUT", "/v1/frame"), ("DELETE", "/v1/info"), ("GET", "/v1/turntable"), ("POST", "/livez")]
)
def test_a_wrong_method_is_405_with_allow(http: httpx.Client, method: str, path: str) -> None:
    answer = http.request(method, path)

    problem(answer, 405, "method-not-allowed")
    assert answer.headers["allow"]


def test_head_is_get_without_its_body(http: httpx.Client) -> None:
    for path in ("/", "/livez", "/v1/info", "/v1/limits", "/v1/jobs", "/docs"):
        head = http.head(path)
        assert head.status_code == 200, path
        assert not head.content
    assert http.head("/v1/jobs/none").status_code == 404
    assert http.head("/v1/turntable").status_code == 405


def test_an_unknown_host_is_refused(http: httpx.Client) -> None:
    for host in ("evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "[::2]", "[:::]"):
        problem(http.get("/livez", headers={"Host": host}), 421, "unknown-host")
    for host in ("localhost", "LOCALHOST:9", "127.0.0.1", "[::1]:80", "[0:0:0:0:0:0:0:1]"):
        assert http.get("/livez", headers={"Host": host}).status_code == 200


def test_writes_of_foreign_pages_are_refused(http: httpx.Client) -> None:
    foreign: list[dict[str, str]] = [
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site", "Origin": "http://127.0.0.1:1"},
    ]
    for headers in foreign:
        problem(http.post("/v1/jobs", json={}, headers=headers), 403, "cross-origin-write")
        problem(http.post("/v1/frame", json={}, headers=headers), 403, "cross-origin-write")
    own = {"Origin": str(http.base_url).rstrip("/"), "Sec-Fetch-Site": "same-origin"}
    assert http.post("/v1/frame", json={"width": 64, "height": 36}, headers=own).status_code == 200
    assert http.get(f"/v1/frame?{QUERY}", headers=foreign[0]).status_code == 200


def test_a_long_address_is_414(http: httpx.Client) -> None:
    body = problem(http.get("/v1/frame?seed=" + "1" * 20_000), 414, "url-too-long")

    assert body["bound"] == 16_384


def test_what_is_not_http_is_answered_and_closed(server: Server) -> None:
    parts = urlsplit(server.url)
    for bytes_sent in (b"\x16\x03\x01 nonsense\r\n\r\n", b"GET /" + b"x" * 200_000):
        with socket.create_connection((parts.hostname, parts.port), timeout=10) as connection:
            connection.sendall(bytes_sent)
            answer = connection.recv(65_536)
        head, _, body = answer.partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 400 ")
        assert json.loads(body)["type"] == "/problems/malformed-request"


def test_request_ids_are_taken_over_where_they_are_sane(http: httpx.Client) -> None:
    assert http.get("/nowhere", headers={"X-Request-Id": "run-7.a"}).json()["request_id"] == "run-7.a"
    for nonsense in ("", "a b", "x" * 200, '"><script>'):
        assert http.get("/nowhere", headers={"X-Request-Id": nonsense}).json()["request_id"] != nonsense


@pytest.mark.parametrize("name", sorted(KINDS))
def test_every_kind_of_problem_has_its_page(http: httpx.Client, name: str) -> None:
    answer = http.get(KINDS[name].path)

    assert answer.headers["content-type"].startswith("text/html")
    assert str(KINDS[name].status) in answer.text
    assert KINDS[name].path in http.get("/problems").text


def test_bad_input_leaves_the_service_as_it_was(http: httpx.Client, server: Server) -> None:
    workers = [(worker["pid"], worker["restarts"]) for worker in http.get("/v1/info").json()["workers"]]
    for text, _ in BAD_BODIES:
        http.post("/v1/frame", content=text, headers={"Content-Type": "application/json"})

    assert http.get("/readyz").status_code == 200
    assert [(worker["pid"], worker["restarts"]) for worker in http.get("/v1/info").json()["workers"]] == workers
    assert "Traceback" not in server.log_text()
