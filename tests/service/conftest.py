"""A real server: its own process, a free loopback port, a folder of its own; started once for the whole run."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

import av
import httpx
import pytest

ROOT = Path(__file__).resolve().parents[2]
START_SECONDS = 150.0
"""A first start on a machine bakes the scene's data."""
STOP_SECONDS = 20.0
SMALL = (
    "--workers=2",
    "--limits.sequence-frames=24",
    "--limits.sequences=2",
    "--limits.job-frames=60",
    "--limits.body-bytes=65536",
    "--log-format=json",
)


@dataclass(frozen=True)
class Server:
    """A running server."""

    url: str
    """Without a slash at its end."""
    folder: Path
    """Its data."""
    log: Path
    process: subprocess.Popen[bytes]

    def log_text(self) -> str:
        """What it has logged so far."""
        return self.log.read_text()


def environment(**variables: str) -> dict[str, str]:
    """The environment without anybody's settings, but with the cache of baked scenes."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MILLPOND_")}
    cache = {"MILLPOND_CACHE": os.environ["MILLPOND_CACHE"]} if "MILLPOND_CACHE" in os.environ else {}
    return {**kept, **cache, **variables}


@contextmanager
def running_server(folder: Path, *options: str, is_awaited: bool = True, **variables: str) -> Iterator[Server]:
    """A server with these options; it is stopped by SIGTERM, and fails the test with its log where it misbehaves."""
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "server.log"
    arguments = [sys.executable, "-m", "service", "serve", "--port=0", f"--data-dir={folder / 'data'}", *options]
    with log.open("wb") as file:
        process = subprocess.Popen(
            arguments, cwd=ROOT, env=environment(**variables), stdout=subprocess.PIPE, stderr=file
        )
    try:
        yield _started(process, folder, log, is_awaited=is_awaited)
    finally:
        code = _stopped(process)
    if code != 0:
        pytest.fail(f"the server ended with {code}\n{log.read_text()[-6000:]}")


def _started(process: subprocess.Popen[bytes], folder: Path, log: Path, *, is_awaited: bool) -> Server:
    assert process.stdout is not None
    line = process.stdout.readline().decode()
    if not line.startswith("Millpond: http://"):
        pytest.fail(f"the server did not start\n{log.read_text()[-6000:]}")
    server = Server(line.split()[1].rstrip("/"), folder / "data", log, process)
    deadline = time.monotonic() + START_SECONDS
    while is_awaited:
        if process.poll() is not None or time.monotonic() > deadline:
            pytest.fail(f"the server was not ready after {START_SECONDS} s\n{log.read_text()[-6000:]}")
        try:
            if httpx.get(f"{server.url}/readyz", timeout=5).status_code == httpx.codes.OK:
                break
        except httpx.TransportError:
            pass
        time.sleep(0.1)
    return server


def _stopped(process: subprocess.Popen[bytes]) -> int:
    process.send_signal(signal.SIGTERM)
    try:
        return process.wait(STOP_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return -signal.SIGKILL
    finally:
        if process.stdout is not None:
            process.stdout.close()


def movie_frames(movie: bytes) -> int:
    """How many frames a movie has, by decoding it."""
    with av.open(io.BytesIO(movie), "r") as container:
        return len(list(container.decode(video=0)))


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """The server that all tests share; nothing that a test does to it may outlive the test."""
    with running_server(tmp_path_factory.mktemp("server"), *SMALL) as started:
        yield started


@pytest.fixture
def start_server(tmp_path: Path) -> Callable[..., AbstractContextManager[Server]]:
    """Starter of a server for one test alone, with the options that it is given."""

    def start(*options: str, **keywords: str | bool) -> AbstractContextManager[Server]:
        return running_server(tmp_path / "server", *options, **keywords)  # type: ignore[arg-type]

    return start


@pytest.fixture(scope="session")
def http(server: Server) -> Iterator[httpx.Client]:
    """A plain HTTP client of the shared server."""
    with httpx.Client(base_url=server.url, timeout=60) as client:
        yield client
