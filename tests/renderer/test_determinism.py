"""One request, one picture: twice, in another order, after other sizes, in other processes, with other threads."""

from __future__ import annotations

import hashlib
import json
import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.pipeline import Renderer
from tests.renderer.drawing import asked

pytestmark = pytest.mark.usefixtures("world")

ROOT = Path(__file__).resolve().parents[2]
REQUESTS: list[dict[str, Any]] = [
    {},
    {"time": 1.7},
    {"time": 1.7, "period": 3.1},
    {"sun": {"azimuth": 40.0, "elevation": 30.0}, "time": 0.6},
    {"width": 97, "height": 61, "msaa": 1},
    {"samples": 3, "shutter": 0.2},
    {"fog": {"density": 0.03}, "tonemap": "agx", "seed": 5},
    {"layers": ["reflection_map"]},
    {"sky": "constant", "camera": {"eye": [3.0, -0.5, 3.0], "target": [0.0, 1.0, 0.0]}},
]


def digests(renderer: Renderer, order: list[int]) -> dict[int, str]:
    return {i: hashlib.sha256(renderer.render(asked(**REQUESTS[i])).color.tobytes()).hexdigest() for i in order}


def test_the_same_request_gives_the_same_bytes_in_any_order(renderer: Renderer) -> None:
    order = list(range(len(REQUESTS)))
    expected = digests(renderer, order)

    for seed in range(4):
        random.Random(seed).shuffle(order)  # noqa: S311 - an order, no secret
        assert digests(renderer, order) == expected


def test_a_renderer_without_a_past_draws_the_same(renderer: Renderer) -> None:
    expected = digests(renderer, list(range(len(REQUESTS))))

    for i in range(len(REQUESTS)):
        with Renderer() as fresh:
            assert digests(fresh, [i])[i] == expected[i], REQUESTS[i]


def test_shadows_kept_from_another_moment_are_the_same_shadows(renderer: Renderer) -> None:
    """What sways casts a shadow: kept over time, it must not remember the wind of the frame that drew it first."""
    low = {"sun": {"azimuth": 60.0, "elevation": 15.0}}
    pictures = []
    for first in (0.0, 0.45, 1.1):
        renderer._shadows.forget("test")
        renderer.render(asked(**low, time=first))
        pictures.append(renderer.render(asked(**low, time=2.0)).color)

    assert all(np.array_equal(pictures[0], other) for other in pictures[1:])


DRAW = """
import hashlib, json, sys
from renderer.pipeline import Renderer
from tests.renderer.drawing import asked
from tests.renderer.world import registered
with registered(), Renderer() as renderer:
    pictures = [renderer.render(asked(**fields)).color for fields in json.loads(sys.argv[1])]
    print(json.dumps([hashlib.sha256(picture.tobytes()).hexdigest() for picture in pictures]))
"""


@pytest.mark.parametrize("threads", ["0", "1", "2"])
def test_fresh_processes_with_any_number_of_threads_draw_the_same(renderer: Renderer, threads: str) -> None:
    chosen = REQUESTS[:6]
    run = subprocess.run(
        [sys.executable, "-c", DRAW, json.dumps(chosen)],
        cwd=ROOT,
        env={**os.environ, "LP_NUM_THREADS": threads, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "0"},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )

    assert json.loads(run.stdout) == list(digests(renderer, list(range(6))).values())


def test_the_clock_on_the_wall_has_no_say(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = digests(renderer, [0, 2])
    monkeypatch.setattr("time.time", lambda: 0.0)
    monkeypatch.setattr("time.time_ns", lambda: 0)

    assert digests(renderer, [0, 2]) == expected


def test_different_requests_give_different_pictures(renderer: Renderer) -> None:
    assert len(set(digests(renderer, list(range(len(REQUESTS)))).values())) == len(REQUESTS)
