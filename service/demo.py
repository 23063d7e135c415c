"""The demonstration that ``make demo`` runs: a service, its client, frames, and a turntable on every core."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import millpond
import psutil
from millpond import Millpond
from rich.console import Console

from renderer.encode.verify import verify_movie

OUT = Path("out/demo")
TURNTABLE: millpond.Turntable = {"frames": 96, "fps": 24.0}
SIZE = {"width": 640, "height": 360}
START_SECONDS = 120.0
"""How long a first start may take: it bakes the scene."""
STILLS: dict[str, dict[str, Any]] = {
    "frame": {},
    "evening": {
        "sun": {"azimuth": 262, "elevation": 9, "color": [1.0, 0.66, 0.38], "intensity": 1.6},
        "ambient": [0.2, 0.2, 0.26],
        "tonemap": {"operator": "aces", "exposure": 0.7},
    },
    "low": {"camera": {"eye": [9.5, 1.1, 6.5], "target": [-3, 0.7, -4], "fov_y": 50}, "time": 3.0},
}
"""The single pictures: name, and how each differs from the default request."""


def main() -> int:
    """Run the demonstration; 0 where everything was made and verified."""
    console = Console()
    OUT.mkdir(parents=True, exist_ok=True)
    with service(console) as url, Millpond(url, timeout=600.0) as client:
        info = client.info()
        console.print(f"driver      {info['renderer']}")
        for name, request in STILLS.items():
            began = time.perf_counter()
            frame = client.frame({"width": 1280, "height": 720, **request})
            wrote(console, frame.save(OUT / f"{name}.png"), f"{time.perf_counter() - began:.2f} s over HTTP")
        turntable(console, client)
    console.print("stopped     the service has ended; everything above is in out/demo/")
    return 0


def turntable(console: Console, client: Millpond) -> None:
    """Run the turntable job, fetch what it made, and verify the movie by decoding it."""
    psutil.cpu_percent(percpu=True)
    began = time.perf_counter()
    job = client.turntable_job(SIZE, outputs=["mp4"], **TURNTABLE)
    job.wait()
    seconds = time.perf_counter() - began
    load = psutil.cpu_percent(percpu=True)
    count = int(TURNTABLE["frames"])
    movie = job.result("mp4", OUT / "turntable.mp4")
    facts = verify_movie(movie, count, TURNTABLE["fps"], SIZE["width"], SIZE["height"])
    wrote(console, movie, f"{facts.frames} frames, verified by decoding")
    wrote(console, job.contact_sheet(OUT / "contact-sheet.png"), "the same frames at a glance")
    console.print(
        f"turntable   {count} frames in {seconds:.1f} s: {count / seconds:.1f} frames/s, "
        f"cores at {', '.join(f'{share:.0f} %' for share in load)}",
    )


@contextmanager
def service(console: Console) -> Iterator[str]:
    """A service of our own on a free loopback port, stopped in the end."""
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    with tempfile.TemporaryDirectory(prefix="millpond-demo-") as data, (OUT / "service.log").open("wb") as log:
        process = subprocess.Popen(  # noqa: S603 - our own program
            [sys.executable, "-m", "service", "serve", "--host", "127.0.0.1", "--port", str(port)],
            env={**os.environ, "MILLPOND_DATA_DIR": data},
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        try:
            began = time.perf_counter()
            wait_until_ready(url, process)
            console.print(f"service     {url}, ready after {time.perf_counter() - began:.1f} s")
            yield url
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(timeout=30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def wait_until_ready(url: str, process: subprocess.Popen[bytes]) -> None:
    """Return once every worker has drawn its canary."""
    deadline = time.monotonic() + START_SECONDS
    with Millpond(url, timeout=10.0) as client:
        while time.monotonic() < deadline:
            if process.poll() is not None:
                raise SystemExit(f"the service ended at once; see {OUT / 'service.log'}")
            if client.ready():
                return
            time.sleep(0.2)
    raise SystemExit(f"the service was not ready within {START_SECONDS:.0f} s; see {OUT / 'service.log'}")


def wrote(console: Console, path: Path, note: str) -> None:
    """Say what was written."""
    console.print(f"wrote       {path} ({path.stat().st_size / 1000:,.0f} kB): {note}")


def free_port() -> int:
    """A loopback port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


if __name__ == "__main__":
    raise SystemExit(main())
