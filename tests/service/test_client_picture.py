"""Frames, pictures and the progress bar, from bytes that our own encoders make."""

from __future__ import annotations

import io
import json

import millpond
import numpy as np
import pytest
from millpond.progress import JobProgress, duration
from millpond.shapes import JobFacts
from PIL import Image
from rich.console import Console

from renderer.encode.image import encode_jpeg, encode_png, encode_webp
from tests.renderer.encode_pictures import landscape

REQUEST = {"scene": "pond", "time": 1.25}
PIXELS = landscape(36, 64)
HEADERS = {
    "content-type": "image/png",
    "x-frame-key": "ab" * 32,
    "x-fingerprint": "f1",
    "x-renderer": "llvmpipe (LLVM 15.0.6, 256 bits)",
    "content-location": "/v1/frame.png?time=1.25",
    "server-timing": 'queue;dur=1.50, render;dur=123.4, encode;desc="PNG";dur=8',
}


def frame(data: bytes | None = None, **headers: str) -> millpond.Frame:
    text = {"millpond": json.dumps(REQUEST)}
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return millpond.Frame(encode_png(PIXELS, text) if data is None else data, {**HEADERS, **named})


def test_a_frame_is_an_image_an_array_and_its_provenance() -> None:
    found = frame()

    assert found.image.size == (found.width, found.height) == (64, 36)
    assert found.array.dtype == np.uint8
    assert np.array_equal(found.array, PIXELS)
    assert np.array_equal(np.asarray(found), PIXELS)
    assert (found.key, found.fingerprint) == ("ab" * 32, "f1")
    assert found.renderer == "llvmpipe (LLVM 15.0.6, 256 bits)"
    assert found.url == "/v1/frame.png?time=1.25"
    assert found.request == REQUEST


def test_the_array_may_be_written_to_without_changing_the_frame() -> None:
    found = frame()
    found.array[:] = 0

    assert np.array_equal(found.array, PIXELS)


def test_timings_are_seconds() -> None:
    assert frame().timings == pytest.approx({"queue": 0.0015, "render": 0.1234, "encode": 0.008})
    assert frame(server_timing='queue;dur=0.00, cache;desc="hit"').timings == {"queue": 0.0}
    assert frame(server_timing="").timings == {}


@pytest.mark.parametrize("encode", [encode_jpeg, encode_webp])
def test_other_formats_carry_their_request_too(encode: type) -> None:
    found = frame(encode(PIXELS, json.dumps(REQUEST)), content_type=f"image/{encode.__name__.removeprefix('encode_')}")

    assert found.request == REQUEST
    assert found.array.shape == (36, 64, 3)
    assert np.abs(found.array.astype(int) - PIXELS).mean() < 6


def test_an_image_without_a_request_has_none() -> None:
    assert frame(encode_png(PIXELS)).request is None
    assert frame(encode_png(PIXELS, {"millpond": "[1, 2]"})).request is None
    with pytest.raises(millpond.MillpondError, match="damaged"):
        _ = frame(encode_png(PIXELS, {"millpond": "{"})).request


def test_bytes_that_are_no_image_say_so_when_they_are_looked_at() -> None:
    found = frame(b"no image", content_type="image/x-exr")

    assert found.data == b"no image"
    with pytest.raises(millpond.MillpondError, match="image/x-exr"):
        _ = found.array


def test_a_notebook_shows_a_png_of_every_format() -> None:
    assert frame()._repr_png_() == frame().data
    shown = Image.open(io.BytesIO(frame(encode_jpeg(PIXELS), content_type="image/jpeg")._repr_png_()))
    assert (shown.format, shown.size) == ("PNG", (64, 36))


def test_a_saved_file_is_what_the_service_sent(tmp_path: object) -> None:
    path = frame().save(f"{tmp_path}/pond.png")

    assert path.read_bytes() == frame().data


def test_nothing_prints_its_bytes() -> None:
    assert repr(frame()) == f"<Frame abababababab image/png, {len(frame().data)} bytes>"
    assert repr(millpond.Movie(b"123", "video/mp4")) == "<Movie video/mp4, 3 bytes>"
    assert millpond.Movie(b"123", "application/zip")._repr_html_() is None


FACTS: JobFacts = {
    "id": "a", "kind": "turntable", "state": "running", "frames_per_second": 6.27, "eta_seconds": 185.0,
    "counts": {"total": 120, "done": 30, "failed": 0, "pending": 88, "leased": 2},
    "created": "", "started": None, "finished": None, "links": {}, "error": None,
}  # fmt: skip


def test_the_bar_shows_frames_speed_and_time_left() -> None:
    file = io.StringIO()
    with JobProgress(console=Console(file=file, force_terminal=True, width=120, color_system=None)) as bar:
        bar(FACTS)
    shown = file.getvalue()

    assert all(part in shown for part in ("turntable running", "25%", "30/120", "6.3 frames/s", "3:05 left"))


@pytest.mark.parametrize(("is_wanted", "is_terminal"), [(False, True), (True, False)])
def test_the_bar_is_silent_where_it_is_not_wanted_or_not_seen(is_wanted: bool, is_terminal: bool) -> None:
    file = io.StringIO()
    with JobProgress(is_wanted=is_wanted, console=Console(file=file, force_terminal=is_terminal)) as bar:
        bar(FACTS)

    assert file.getvalue().strip() == ""


@pytest.mark.parametrize(
    ("seconds", "said"), [(0.2, "0 s"), (59.4, "59 s"), (59.6, "1:00"), (185, "3:05"), (3729, "1:02:09")]
)
def test_durations_are_said_as_people_say_them(seconds: float, said: str) -> None:
    assert duration(seconds) == said
