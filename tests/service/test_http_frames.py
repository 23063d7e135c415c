"""One frame over HTTP: identity, formats, caching."""

from __future__ import annotations

import base64
import hashlib
import io
import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from urllib.parse import urlsplit

import httpx
import pytest
from PIL import Image

from renderer.encode.png import read_png_text
from renderer.request import FrameRequest
from tests.service.conftest import Server

SIZE = {"width": 64, "height": 36}
QUERY = "width=64&height=36"


def drawn(http: httpx.Client) -> int:
    """How many frames the workers have drawn."""
    return sum(worker["frames"] for worker in http.get("/v1/info").json()["workers"])


def test_a_frame_is_a_png_of_the_size_asked_for_that_carries_its_request(http: httpx.Client) -> None:
    answer = http.get(f"/v1/frame.png?{QUERY}&time=1.5")

    assert answer.status_code == 200
    assert answer.headers["content-type"] == "image/png"
    assert Image.open(io.BytesIO(answer.content)).size == (64, 36)
    request = FrameRequest.parse(json.loads(read_png_text(answer.content)["millpond"]))
    assert request.key() == answer.headers["x-frame-key"]
    assert request.time == 1.5


def test_headers_say_what_drew_the_frame_and_how_long_it_took(http: httpx.Client) -> None:
    answer = http.get(f"/v1/frame.png?{QUERY}&time=11.25")
    info = http.get("/v1/info").json()

    assert answer.headers["x-renderer"] == info["renderer"]
    assert answer.headers["x-fingerprint"] == info["fingerprint"]
    digest = base64.b64encode(hashlib.sha256(answer.content).digest()).decode()
    assert answer.headers["repr-digest"] == f"sha-256=:{digest}:"
    timing = dict(entry.split(";dur=") for entry in answer.headers["server-timing"].split(", "))
    assert list(timing) == ["queue", "render", "encode"]
    assert float(timing["render"]) > 0
    assert answer.headers["cache-control"] == "public, max-age=86400"
    assert answer.headers["vary"] == "Accept"


def test_get_post_and_content_location_mean_one_frame(http: httpx.Client) -> None:
    body = {
        **SIZE,
        "water": {"technique": "luna", "ripple_scale": [0.05, 0.02]},
        "camera": {"eye": [9, 3.2, 9], "target": [0, 0.4, 0]},
        "time": 1.25,
        "sun": None,
    }
    posted = http.post("/v1/frame", json=body)
    dotted = http.get(
        f"/v1/frame?{QUERY}&water=luna&water.ripple_scale=0.05,0.02&camera.eye=9,3.2,9&camera.target=0,0.4,0"
        "&time=1.25&sun=null"
    )
    told = http.get(posted.headers["content-location"])

    assert posted.headers["x-frame-key"] == dotted.headers["x-frame-key"] == told.headers["x-frame-key"]
    assert posted.headers["etag"] == dotted.headers["etag"] == told.headers["etag"]
    assert posted.content == dotted.content == told.content
    assert not urlsplit(posted.headers["content-location"]).netloc


@pytest.mark.parametrize(
    "spelling",
    [
        "water=luna",
        "water.technique=luna",
        "scene=pond",
        "time=0",
        "time=-0.0",
        "time=0e0",
        "seed=0&format=png",
        "tonemap=aces",
        "camera.up=0,1,0",
    ],
)
def test_every_spelling_of_a_request_has_one_key(http: httpx.Client, spelling: str) -> None:
    plain = http.head(f"/v1/frame?{QUERY}")

    assert http.head(f"/v1/frame?{QUERY}&{spelling}").headers["x-frame-key"] == plain.headers["x-frame-key"]


def test_a_known_etag_is_answered_with_304_and_without_rendering(http: httpx.Client) -> None:
    url = f"/v1/frame.png?{QUERY}&time=777.125"
    etag = http.head(url).headers["etag"]
    before = drawn(http)
    answer = http.get(url, headers={"If-None-Match": f'"other", W/{etag}'})

    assert answer.status_code == 304
    assert answer.headers["etag"] == etag
    assert not answer.content
    assert drawn(http) == before
    assert http.get(url, headers={"If-None-Match": '"other"'}).headers["etag"] == etag
    assert drawn(http) == before + 1


def test_head_tells_what_get_would_without_rendering(http: httpx.Client) -> None:
    url = f"/v1/frame.jpg?{QUERY}&time=778.5"
    before = drawn(http)
    head = http.head(url)

    assert drawn(http) == before
    assert head.status_code == 200
    assert "content-length" not in head.headers
    got = http.get(url)
    for name in ("etag", "x-frame-key", "x-fingerprint", "x-renderer", "content-type", "cache-control", "vary"):
        assert head.headers[name] == got.headers[name]
    again = http.head(url)
    assert again.headers["content-length"] == str(len(got.content))
    assert again.headers["repr-digest"] == got.headers["repr-digest"]


def test_a_frame_is_drawn_once_and_then_kept(http: httpx.Client) -> None:
    url = f"/v1/frame.png?{QUERY}&time=779.5"
    first = http.get(url)
    before = drawn(http)
    second = http.get(url)

    assert second.content == first.content
    assert drawn(http) == before
    assert 'cache;desc="hit"' in second.headers["server-timing"]


@pytest.mark.parametrize(
    ("suffix", "media_type"), [("png", "image/png"), ("jpg", "image/jpeg"), ("webp", "image/webp")]
)
def test_the_suffix_chooses_the_format(http: httpx.Client, suffix: str, media_type: str) -> None:
    answer = http.get(f"/v1/frame.{suffix}?{QUERY}", headers={"Accept": "image/png"})

    assert answer.headers["content-type"] == media_type
    image = Image.open(io.BytesIO(answer.content))
    assert image.get_format_mimetype() == media_type


@pytest.mark.parametrize(
    ("accept", "media_type"),
    [
        ("image/webp", "image/webp"),
        ("image/jpeg, application/problem+json", "image/jpeg"),
        ("image/jpeg;q=0.9, image/png;q=0", "image/jpeg"),
        ("image/webp, */*;q=0.8", "image/png"),
        ("image/webp, image/jpeg", "image/png"),
        ("*/*", "image/png"),
        ("image/jpeg;q=nonsense", "image/png"),
        ("text/html", "image/png"),
    ],
)
def test_an_accept_that_names_exactly_one_chooses_the_format(http: httpx.Client, accept: str, media_type: str) -> None:
    assert http.get(f"/v1/frame?{QUERY}", headers={"Accept": accept}).headers["content-type"] == media_type


def test_format_wins_over_accept(http: httpx.Client) -> None:
    answer = http.get(f"/v1/frame?{QUERY}&format=jpeg", headers={"Accept": "image/webp"})

    assert answer.headers["content-type"] == "image/jpeg"
    posted = http.post("/v1/frame", json={**SIZE, "format": "jpeg"}, headers={"Accept": "image/webp"})
    assert posted.headers["etag"] == answer.headers["etag"]


def test_reserved_fields_do_not_change_the_frame_and_v_makes_it_immutable(http: httpx.Client) -> None:
    plain = http.head(f"/v1/frame?{QUERY}")
    version = http.get("/v1/info").json()["v"]

    signed = http.head(f"/v1/frame?{QUERY}&sig=x&kid=y&exp=9&v={version}")
    assert signed.headers["etag"] == plain.headers["etag"]
    assert "immutable" in signed.headers["cache-control"]
    assert "immutable" not in http.head(f"/v1/frame?{QUERY}&v=older").headers["cache-control"]


def test_content_location_is_left_out_where_it_would_be_too_long(http: httpx.Client) -> None:
    short = http.get(f"/v1/frame.png?{QUERY}")

    assert len(short.headers["content-location"]) < 8192


def test_with_api_keys_frames_are_private_and_need_a_key(
    start_server: Callable[..., AbstractContextManager[Server]],
) -> None:
    with start_server("--workers=1", "--interactive=false", "--api-keys=open-sesame,other") as guarded:
        url = f"{guarded.url}/v1/frame.png?{QUERY}"
        refused = httpx.get(url)
        assert refused.status_code == 401
        assert "bearer" in refused.headers["www-authenticate"].lower()
        assert httpx.get(url, headers={"X-API-Key": "open-sesam"}).status_code == 401
        assert httpx.get(f"{guarded.url}/livez").status_code == 200
        for headers in ({"X-API-Key": "open-sesame"}, {"Authorization": "Bearer other"}):
            answer = httpx.get(url, headers=headers, timeout=60)
            assert answer.status_code == 200
            assert answer.headers["cache-control"].startswith("private,")
        assert "open-sesame" not in guarded.log_text()
