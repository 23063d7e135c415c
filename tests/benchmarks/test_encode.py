"""What encoding a 720p frame costs. CPU time, so that a busy machine does not blur it."""

from __future__ import annotations

import io
import time

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from pytest_benchmark.fixture import BenchmarkFixture

from renderer.encode.image import encode_jpeg, encode_png, encode_webp, read_png_text
from renderer.encode.movie import MOVIES, MovieWriter
from renderer.encode.sheet import contact_sheet
from tests.renderer.encode_pictures import landscape

pytestmark = pytest.mark.benchmark(timer=time.process_time, min_rounds=10, warmup=True)

REQUEST = {"millpond": '{"scene":"pond"}' * 60}


@pytest.fixture(scope="module")
def frame() -> NDArray[np.uint8]:
    return landscape(720, 1280)


@pytest.mark.benchmark(group="720p image")
def test_png(benchmark: BenchmarkFixture, frame: NDArray[np.uint8]) -> None:
    data = benchmark(encode_png, frame, REQUEST)

    benchmark.extra_info["bytes"] = len(data)


@pytest.mark.benchmark(group="720p image")
@pytest.mark.parametrize("level", [6, 1])
def test_png_by_pillow(benchmark: BenchmarkFixture, frame: NDArray[np.uint8], level: int) -> None:
    def encode() -> int:
        file = io.BytesIO()
        Image.fromarray(frame).save(file, "PNG", compress_level=level)
        return file.tell()

    benchmark.extra_info["bytes"] = benchmark(encode)


@pytest.mark.benchmark(group="720p image")
@pytest.mark.parametrize("encode", [encode_jpeg, encode_webp])
def test_small_formats(benchmark: BenchmarkFixture, frame: NDArray[np.uint8], encode: type) -> None:
    benchmark.extra_info["bytes"] = len(benchmark(encode, frame))


@pytest.mark.benchmark(group="720p image")
def test_reading_the_request_of_a_png(benchmark: BenchmarkFixture, frame: NDArray[np.uint8]) -> None:
    data = encode_png(frame, REQUEST)

    assert benchmark(read_png_text, data) == REQUEST


@pytest.mark.benchmark(group="360p movie, 30 frames")
@pytest.mark.parametrize("container", MOVIES)
def test_movie(benchmark: BenchmarkFixture, container: str) -> None:
    frames = [landscape(360, 640, shift=3.0 * index) for index in range(30)]

    def encode() -> int:
        file = io.BytesIO()
        with MovieWriter(file, 640, 360, 30, container) as movie:
            for picture in frames:
                movie.add(picture)
        return file.tell()

    benchmark.extra_info["bytes"] = benchmark.pedantic(encode, rounds=3, warmup_rounds=1)  # type: ignore[no-untyped-call]


@pytest.mark.benchmark(group="contact sheet, 24 frames of 360p")
def test_sheet(benchmark: BenchmarkFixture) -> None:
    frames = [landscape(360, 640, shift=30.0 * index) for index in range(24)]

    benchmark.pedantic(contact_sheet, (frames,), rounds=3)  # type: ignore[no-untyped-call]


def test_png_costs_a_fifth_of_pillows_fastest(frame: NDArray[np.uint8]) -> None:
    def cost(encode: object) -> float:
        assert callable(encode)
        begun = time.process_time()
        encode()
        return time.process_time() - begun

    ours = min(cost(lambda: encode_png(frame, REQUEST)) for _ in range(12))
    pillows = min(cost(lambda: Image.fromarray(frame).save(io.BytesIO(), "PNG", compress_level=1)) for _ in range(6))

    assert ours < pillows / 5
