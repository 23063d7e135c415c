"""What a frame of the pond costs: `luna` at 1280x720, one sample, one thread. CPU time: other work does not blur it."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from renderer.pipeline import Renderer
from renderer.request import FrameRequest

# The driver reads it when the process makes its first context: the batch pool's setting, by which figures are quoted.
os.environ["LP_NUM_THREADS"] = "0"

FRAME: dict[str, Any] = {"width": 1280, "height": 720, "msaa": 1, "samples": 1}

pytestmark = pytest.mark.benchmark(timer=time.process_time, group="720p frame")


@pytest.fixture(scope="module")
def drawing() -> Iterator[Renderer]:
    """A warm renderer."""
    with Renderer() as renderer:
        renderer.render(FrameRequest.parse(FRAME))
        yield renderer


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"msaa": 4},
        {"period": 4.0},
        {"sky": "gradient"},
        {"sun": {"shadows": False}},
        {"water": {"ripple_height": 0.0}},
    ],
    ids=["luna", "msaa 4", "period", "gradient sky", "no shadows", "flat"],
)
def test_frame(benchmark: BenchmarkFixture, drawing: Renderer, fields: dict[str, Any]) -> None:
    times = iter(range(1000))

    def draw() -> None:
        drawing.render(FrameRequest.parse({**FRAME, **fields, "time": next(times) / 30}))

    benchmark.pedantic(draw, rounds=9, warmup_rounds=2)  # type: ignore[no-untyped-call]


def test_split_by_pass(benchmark: BenchmarkFixture) -> None:
    """CPU milliseconds of each pass, the median of nine frames, in the benchmark's extra information."""
    with Renderer(measures_passes=True) as measuring:
        parts: list[dict[str, float]] = []

        def draw() -> None:
            parts.append(measuring.render(FrameRequest.parse({**FRAME, "time": len(parts) / 30})).timings)

        benchmark.pedantic(draw, rounds=9, warmup_rounds=2)  # type: ignore[no-untyped-call]
    warm = parts[2:]
    split = {name: round(1000 * float(np.median([part[name] for part in warm])), 1) for name in warm[0]}
    benchmark.extra_info["milliseconds"] = split
    print(f"\nCPU ms by pass, median of {len(warm)} frames (render: wall): {split}")  # noqa: T201 - the figure is wanted

    assert set(split) >= {"shadow", "scene", "maps", "water", "composite"}


@pytest.mark.parametrize("layer", ["reflection_map", "refraction_map"])
def test_map(benchmark: BenchmarkFixture, drawing: Renderer, layer: str) -> None:
    benchmark.pedantic(  # type: ignore[no-untyped-call]
        drawing.render, (FrameRequest.parse({**FRAME, "layers": [layer]}),), rounds=5, warmup_rounds=1
    )
