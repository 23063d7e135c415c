"""Users' images over HTTP, by the client and on the command line: one server, real files."""

from __future__ import annotations

import hashlib
import io
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import millpond
import numpy as np
import pytest
from millpond.uploads import file_bytes, png_of
from PIL import Image

from renderer.scene.bake import cache_directory
from renderer.scene.image_files import KINDS, ImageCaps, read_image
from service.__main__ import main
from tests.renderer.making_images import even, file_of, painted, png_of_sixteen_bits
from tests.service.conftest import ROOT, Server, environment, running_server
from tests.service.test_http_errors import mistakes, problem

SMALL = {"width": 64, "height": 36}
FLAT = even(128, 128, 255)
TOP: dict[str, Any] = {**SMALL, "camera": {"eye": [0, 9, 4], "target": [0, 0, 0]}}


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache with this machine's baked scenes and no images."""
    folder = tmp_path_factory.mktemp("cache")
    for path in cache_directory().glob("*.npz"):
        (folder / path.name).symlink_to(path)
    return folder


@pytest.fixture(scope="module")
def picky(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Iterator[Server]:
    """A server that takes small images only."""
    options = ("--workers=1", "--limits.image-bytes=65536", "--limits.image-side=300", "--limits.image-pixels=60000")
    with running_server(tmp_path_factory.mktemp("images"), *options, MILLPOND_CACHE=str(cache)) as server:
        yield server


@pytest.fixture
def door(picky: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=picky.url, timeout=60) as client:
        yield client


def sent(door: httpx.Client, data: bytes, kind: str, name: str = "image.png") -> httpx.Response:
    return door.post("/v1/images", files={"file": (name, data)}, data={"kind": kind})


def kept(cache: Path) -> set[str]:
    return {path.name for path in (cache / "images").glob("*")}


def test_an_upload_is_answered_with_its_id_again_and_again(door: httpx.Client, cache: Path) -> None:
    data = file_of(painted())
    answers = [sent(door, data, "color_layer", name) for name in ("a.png", "../../b", "c.png")]
    name = hashlib.sha256(b"color_layer\0" + data).hexdigest()

    assert [answer.status_code for answer in answers] == [201, 201, 201]
    assert all(answer.json() == {"id": name, "kind": "color_layer", "width": 32, "height": 24} for answer in answers)
    assert f"{name}.color_layer" in kept(cache)


def test_a_frame_names_an_image_and_shows_it_by_post_by_get_and_in_a_job(door: httpx.Client, picky: Server) -> None:
    name = sent(door, file_of(even(230, 20, 20)), "color_layer").json()["id"]
    plain = Image.open(io.BytesIO(door.post("/v1/frame", json=TOP).raise_for_status().content))
    water = {"technique": "luna", "refraction_bias": 1.0, "color_layers": [{"image": name}]}
    answer = door.post("/v1/frame", json={**TOP, "water": water}).raise_for_status()
    red, green, _ = np.asarray(Image.open(io.BytesIO(answer.content)), float).mean(axis=(0, 1))

    assert red > 1.5 * green
    assert np.asarray(plain, float).mean(axis=(0, 1))[0] < red
    again = door.get(answer.headers["content-location"])
    assert again.headers["x-frame-key"] == answer.headers["x-frame-key"]
    assert again.content == answer.content
    with millpond.Millpond(picky.url) as client:
        job = client.turntable_job({**TOP, "water": water}, frames=2, fps=2.0).wait(progress=False, timeout=60)
        assert job.frame(0).array[..., 0].mean() > 1.5 * job.frame(0).array[..., 1].mean()


@pytest.mark.parametrize("kind", KINDS)
def test_an_unknown_image_is_a_mistake_of_its_field_that_tells_the_way_out(door: httpx.Client, kind: str) -> None:
    name = "e" * 64
    value = [{"image": name}] if kind == "color_layer" else name
    field = "color_layers" if kind == "color_layer" else kind
    path = "water.color_layers.0.image" if kind == "color_layer" else f"water.{kind}"
    for answer, place in (
        (door.post("/v1/frame", json={**SMALL, "water": {field: value}}), path),
        (door.post("/v1/jobs", json={"kind": "turntable", "frame": {"water": {field: value}}}), f"frame.{path}"),
    ):
        (mistake,) = mistakes(answer)
        assert (mistake["path"], mistake["value"]) == (place, name)
        assert "POST /v1/images" in mistake["message"]
        assert kind in mistake["bound"]


def test_an_image_of_another_kind_is_no_image_for_the_field(door: httpx.Client) -> None:
    name = sent(door, file_of(FLAT), "normal_map").json()["id"]

    (mistake,) = mistakes(door.get("/v1/frame", params={"water.bias_map": name}))
    assert mistake["path"] == "water.bias_map"
    assert "this image is a normal_map" in mistake["message"]
    assert door.get("/v1/frame", params={"water.normal_map": name, **SMALL}).status_code == httpx.codes.OK


@pytest.mark.parametrize(
    ("data", "kind", "words"),
    [
        (b"", "normal_map", "the file is empty"),
        (b"not an image at all", "normal_map", "neither PNG nor JPEG nor WebP"),
        (file_of(FLAT)[:-25], "normal_map", "truncated or damaged"),
        (file_of(painted(channels=3)), "bias_map", "a bias map is grey"),
        (file_of(np.zeros((301, 2), np.uint8)), "bias_map", "width and height <= 300"),
        (file_of(np.zeros((250, 250), np.uint8)), "bias_map", "width * height <= 60000"),
    ],
)
def test_what_is_no_such_image_is_422_with_value_and_bound(
    door: httpx.Client, cache: Path, data: bytes, kind: str, words: str
) -> None:
    before = kept(cache)
    (mistake,) = mistakes(sent(door, data, kind))

    assert mistake["path"] == "file"
    assert words in f"{mistake['message']}; {mistake['bound']}"
    assert mistake["value"]
    assert kept(cache) == before


def test_a_form_without_its_parts_is_told_all_at_once(door: httpx.Client) -> None:
    part = {"file": ("a.png", file_of(FLAT))}
    for given, paths in (
        ({"files": part}, ["kind"]),
        ({"files": part, "data": {"kind": "equirect"}}, ["kind"]),
        ({"files": part, "data": {"kind": "normal_map", "name": "x"}}, ["name"]),
        ({"files": {"image": part["file"]}, "data": {"kind": "normal_map"}}, ["file", "image"]),
        ({"files": {"kind": part["file"]}}, ["file", "kind"]),
    ):
        assert sorted(mistake["path"] for mistake in mistakes(door.post("/v1/images", **given))) == paths
    (mistake,) = mistakes(door.post("/v1/images", files=part, data={"kind": "normal_map"}, params={"kind": "bias_map"}))
    assert mistake["path"] == "kind"


def test_what_is_no_form_is_refused_by_its_type(door: httpx.Client) -> None:
    problem(door.post("/v1/images", json={"kind": "normal_map"}), 415, "unsupported-media-type")
    for body, kind in (
        (b"nothing of the sort", "multipart/form-data; boundary=x"),
        (b"--x\r\n\r\n", "multipart/form-data"),
        (
            b'--x\r\nContent-Disposition: form-data; name="kind"\r\n\r\n' + b"a" * 5000,
            "multipart/form-data; boundary=x",
        ),
    ):
        problem(door.post("/v1/images", content=body, headers={"Content-Type": kind}), 400, "malformed-body")


def test_a_file_over_the_cap_is_413_also_where_its_length_is_not_told(door: httpx.Client, cache: Path) -> None:
    before = kept(cache)
    for size in (65_537, 80_000, 3_000_000):
        body = problem(sent(door, b"\x89PNG\r\n\x1a\n" + bytes(size - 8), "normal_map"), 413, "too-large")
        assert body["bound"] == 65_536

    host, port = urlsplit(str(door.base_url)).netloc.split(":")
    with socket.create_connection((host, int(port)), timeout=20) as wire:
        head = (
            f"POST /v1/images HTTP/1.1\r\nHost: {host}\r\nTransfer-Encoding: chunked\r\n"
            "Content-Type: multipart/form-data; boundary=x\r\n\r\n"
        )
        opening = b'--x\r\nContent-Disposition: form-data; name="file"; filename="a"\r\n\r\n'
        wire.sendall(head.encode() + f"{len(opening):x}\r\n".encode() + opening + b"\r\n")
        for _ in range(9):
            wire.sendall(b"2710\r\n" + bytes(10_000) + b"\r\n")
        assert wire.recv(4096).startswith(b"HTTP/1.1 413")
    assert kept(cache) == before


def test_the_limits_are_listed(door: httpx.Client) -> None:
    found = door.get("/v1/limits").json()

    assert (found["image_bytes"], found["image_side"], found["image_pixels"]) == (65_536, 300, 60_000)
    assert found["image_library_bytes"] > 0


def test_an_image_that_vanishes_after_the_check_is_told_by_its_id(door: httpx.Client, cache: Path) -> None:
    name = sent(door, file_of(even(99, 98, 97, 96)), "color_layer").json()["id"]
    path = cache / "images" / f"{name}.color_layer"
    path.write_bytes(b"damaged")
    body = problem(door.post("/v1/frame", json={**SMALL, "water": {"color_layers": name}}), 422, "missing-image")

    assert name in body["detail"]
    path.unlink()


# -------------------------------------------------------------------------------------------------------- the client


def test_the_client_uploads_paths_bytes_pictures_and_arrays(picky: Server, tmp_path: Path) -> None:
    path = tmp_path / "flat.png"
    path.write_bytes(file_of(FLAT))
    with millpond.Millpond(picky.url) as client:
        image = client.upload_image(path, "normal_map")
        assert image["id"] == hashlib.sha256(b"normal_map\0" + path.read_bytes()).hexdigest()
        assert (
            client.upload_image(str(path), "normal_map")
            == client.upload_image(path.read_bytes(), "normal_map")
            == image
        )
        for source in (Image.fromarray(FLAT), FLAT, even(32768, 32768, 65535, size=(1, 5), dtype=np.uint16)):
            facts = client.upload_image(source, "normal_map")
            assert len(facts["id"]) == 64
        assert (facts["width"], facts["height"]) == (5, 1)
        with pytest.raises(millpond.InvalidRequest, match="no normal map") as refusal:
            client.upload_image(np.zeros((4, 4, 3), np.uint8), "normal_map")
        assert refusal.value.errors[0].path == "file"


async def test_the_asyncio_client_uploads_too(picky: Server) -> None:
    async with millpond.AsyncMillpond(picky.url) as client:
        image = await client.upload_image(even(60)[..., 0], "bias_map")
        frame = await client.frame(water={"bias_map": image["id"]}, **SMALL)  # type: ignore[arg-type]

    assert frame.request is not None
    assert frame.request["water"]["bias_map"] == image["id"]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [None, 1, 2, 3, 4])
def test_the_clients_png_holds_the_array_bit_by_bit(channels: int | None, dtype: Any) -> None:
    rng = np.random.default_rng(1)
    pixels = rng.integers(0, np.iinfo(dtype).max + 1, (7, 5) if channels is None else (7, 5, channels)).astype(dtype)
    data = png_of(pixels)
    whole = pixels[..., None] if channels is None else pixels
    if dtype == np.uint16:
        assert data[:33] == png_of_sixteen_bits(whole)[:33]
        grey = read_image(data, "bias_map", ImageCaps()) if channels in {None, 1, 2} else None
        assert grey is None or np.array_equal(grey, whole[..., :1])
    else:
        with Image.open(io.BytesIO(data)) as image:
            image.load()
            assert np.array_equal(np.asarray(image).reshape(whole.shape), whole)


@pytest.mark.parametrize("source", [3, np.zeros((2, 2)), np.zeros((2, 2, 5), np.uint8), np.zeros(4, np.uint8), None])
def test_what_is_no_image_is_refused_before_anything_is_sent(source: Any) -> None:
    with pytest.raises(TypeError, match="an image is"):
        file_bytes(source)


# -------------------------------------------------------------------------------------------------- the command line


def test_an_image_added_by_the_command_line_is_the_servers_too(door: httpx.Client, cache: Path, tmp_path: Path) -> None:
    path = tmp_path / "layer.png"
    path.write_bytes(file_of(even(12, 34, 56, 255)))
    command = [sys.executable, "-m", "service", "image", "add", str(path), "--kind", "color_layer"]
    told = subprocess.run(
        command, cwd=ROOT, env=environment(MILLPOND_CACHE=str(cache)), capture_output=True, text=True, check=True
    )
    name = told.stdout.split()[0]

    assert door.post("/v1/frame", json={**SMALL, "water": {"color_layers": name}}).status_code == httpx.codes.OK
    assert sent(door, path.read_bytes(), "color_layer").json()["id"] == name


def test_mistakes_on_the_command_line_are_told_and_keep_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MILLPOND_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "text.png"
    path.write_text("no image")
    for arguments, words in (
        (["add", str(path), "--kind", "normal_map"], "the file is neither PNG nor JPEG nor WebP"),
        (["add", str(path), "--kind", "moss"], "one of normal_map, bias_map, color_layer"),
        (["add", str(path)], "--kind is needed"),
        (["add", str(tmp_path / "none.png"), "--kind=bias_map"], "can't be read"),
        (["drop", str(path), "--kind=bias_map"], "millpond image add FILE"),
    ):
        assert main(["image", *arguments]) == 2
        assert words in capsys.readouterr().err
    assert not (tmp_path / "cache").exists()
    assert main(["frame", "out.png", "--water.bias-map", "f" * 64]) == 2
    assert "water.bias_map: no image here has this id" in capsys.readouterr().err
    shutil.rmtree(tmp_path / "cache", ignore_errors=True)
