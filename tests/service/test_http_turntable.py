"""A turntable as an answer: archive or movie, bounded, and stopped when nobody reads it."""

from __future__ import annotations

import io
import json
import time
import zipfile
from contextlib import ExitStack
from typing import Any

import httpx
import pytest

from renderer.encode.png import read_png_text
from tests.service.conftest import Server, movie_frames
from tests.service.test_http_errors import mistakes
from tests.service.test_http_frames import QUERY, SIZE, drawn


def turntable(frames: int, **body: Any) -> dict[str, Any]:
    """The body of a small turntable."""
    return {"frame": dict(SIZE), "turntable": {"frames": frames, "fps": 12}, **body}


def test_a_turntable_is_a_zip_whose_frames_are_the_frames_of_get(http: httpx.Client) -> None:
    answer = http.post("/v1/turntable", json=turntable(4))

    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/zip"
    archive = zipfile.ZipFile(io.BytesIO(answer.content))
    assert archive.testzip() is None
    frames = [name for name in archive.namelist() if name.endswith(".png")]
    assert frames == [f"frame_{index:08d}.png" for index in range(4)]
    for name in frames:
        data = archive.read(name)
        request = json.loads(read_png_text(data)["millpond"])
        assert http.post("/v1/frame", json=request).content == data


@pytest.mark.parametrize(
    ("extra", "headers"),
    [({"outputs": ["mp4"]}, {}), ({"format": "mp4"}, {}), ({}, {"Accept": "video/mp4"})],
)
def test_a_turntable_is_a_movie_where_one_is_asked_for(
    http: httpx.Client, extra: dict[str, Any], headers: dict[str, str]
) -> None:
    answer = http.post("/v1/turntable", json=turntable(6, **extra), headers=headers)

    assert answer.headers["content-type"] == "video/mp4"
    assert movie_frames(answer.content) == 6


def test_a_client_that_leaves_stops_the_turntable(http: httpx.Client, server: Server) -> None:
    before = drawn(http)
    body = turntable(24)
    body["frame"] = {"width": 320, "height": 180, "samples": 4, "seed": 99}
    with httpx.stream("POST", f"{server.url}/v1/turntable", json=body, timeout=60) as answer:
        next(answer.iter_raw())
    settled = -1
    while settled != (settled := drawn(http)):
        time.sleep(1.0)
    assert settled - before < 24


def test_more_sequences_than_there_are_places_for_are_refused(http: httpx.Client, server: Server) -> None:
    body = turntable(24)
    body["frame"] = {"width": 320, "height": 180, "samples": 4, "seed": 98}
    with ExitStack() as streams:
        for _ in range(2):
            stream = httpx.stream("POST", f"{server.url}/v1/turntable", json=body, timeout=60)
            assert streams.enter_context(stream).status_code == 200
        refused = http.post("/v1/turntable", json=body)
        assert refused.status_code == 503
        assert refused.json()["type"] == "/problems/queue-full"
        assert int(refused.headers["retry-after"]) > 0
        assert http.get(f"/v1/frame?{QUERY}").status_code == 200
    deadline = time.monotonic() + 30
    while http.post("/v1/turntable", json=turntable(1)).status_code != 200:
        assert time.monotonic() < deadline
        time.sleep(0.2)


def test_turntable_mistakes_are_told_from_the_body_down(http: httpx.Client) -> None:
    body = {
        "frame": {"water": {"technique": "luna", "tile_0": -1}},
        "turntable": {"frames": 0, "sweeep": 3},
        "output": ["zip"],
    }
    found = mistakes(http.post("/v1/turntable", json=body))

    paths = ["frame.water.tile_0", "output", "turntable.frames", "turntable.sweeep"]
    assert sorted(mistake["path"] for mistake in found) == paths


@pytest.mark.parametrize(
    ("body", "path", "bound"),
    [
        ({"turntable": {"frames": 25}}, "turntable.frames", "<= 24"),
        ({"turntable": {"sweep": 90}}, "turntable.loop", "a multiple of 360"),
        ({"turntable": {"maps_every": 0}}, "turntable.maps_every", ">= 1"),
        ({"outputs": ["avi"]}, "outputs", "[one of zip, mp4]"),
        ({"outputs": ["zip", "mp4"]}, "outputs", "[one of zip, mp4]"),
        ({"outputs": [["zip"]]}, "outputs", "[one of zip, mp4]"),
        ({"format": ["zip"]}, "format", "one of zip, mp4"),
        ({"outputs": ["zip"], "format": "mp4"}, "format", "zip"),
        ({"kind": "sweep"}, "kind", "turntable"),
        ({"frame": 3}, "frame", "an object"),
        ({"frame": {"width": 100_000}}, "frame.width", "<= 8192"),
        ({"turntable": 3}, "turntable", None),
    ],
)
def test_a_bad_turntable_is_refused(http: httpx.Client, body: dict[str, Any], path: str, bound: str | None) -> None:
    (mistake,) = mistakes(http.post("/v1/turntable", json={"turntable": {"frames": 2}, **body}))

    assert mistake["path"] == path
    assert mistake.get("bound") == bound
