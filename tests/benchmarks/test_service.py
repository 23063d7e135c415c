"""What the service adds to a frame, and what a second worker takes off a turntable. Ratios of one run."""

from __future__ import annotations

import hashlib
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest

from renderer.encode.image import FORMATS
from renderer.request import FrameRequest
from tests.renderer.drawing import shared_renderer
from tests.service.conftest import ROOT, environment, running_server

PAIRS = 20
FRAMES = 48


def test_http_costs_a_tenth_at_most(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A warm 1280x720 frame over HTTP against the same frame drawn and encoded in process, in turn."""
    renderer = shared_renderer()
    ratios = []
    with running_server(tmp_path, "--workers=1") as server, httpx.Client(base_url=server.url, timeout=60) as http:
        for i in range(PAIRS + 3):
            request = FrameRequest.parse({"width": 1280, "height": 720, "msaa": 1, "time": i / 10})
            began = time.perf_counter()
            FORMATS["png"].encode(renderer.render(request), request.canonical())
            in_process = time.perf_counter() - began
            body = {"width": 1280, "height": 720, "msaa": 1, "time": i / 10 + 0.05}
            began = time.perf_counter()
            assert len(http.post("/v1/frame", json=body).content) > 100_000
            ratios.append((time.perf_counter() - began) / in_process)
    ratio = statistics.median(ratios[3:])
    with capsys.disabled():
        sys.stdout.write(f"\nHTTP / in process, 1280x720, median of {PAIRS} pairs: {ratio:.3f}\n")

    assert ratio <= 1.10


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="two workers need two cores")
def test_two_workers_take_half_the_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A turntable's frames by one worker and by two, each on one core; the bytes are the same."""
    seconds: dict[int, float] = {}
    digests: dict[int, list[str]] = {}
    for workers in (1, 2):
        folder = tmp_path / f"frames-{workers}"
        run = subprocess.run(
            [
                *(sys.executable, "-m", "service", "turntable", str(folder), f"--workers={workers}"),
                *(f"--frames={FRAMES}", "--fps=24", "--width=640", "--height=360", "--msaa=1"),
            ],
            cwd=ROOT,
            env=environment(),
            capture_output=True,
            text=True,
            check=True,
            timeout=600,
        )
        seconds[workers] = seconds_of(run.stderr)
        digests[workers] = [hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())]
    ratio = seconds[2] / seconds[1]
    with capsys.disabled():
        sys.stdout.write(f"\ntwo workers / one, {FRAMES} frames of 640x360: {ratio:.3f}\n")

    assert len(digests[1]) == FRAMES
    assert digests[1] == digests[2]
    assert ratio <= 0.56


def seconds_of(text: str) -> float:
    """The seconds that the command says its frames took: "drawn in 1.23 s by"."""
    words = text.split()
    return float(words[words.index("drawn") + 2])
