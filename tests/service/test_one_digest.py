"""One request, one file: by HTTP, in a job, in the client, on the command line, in any process and order."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import httpx
from millpond import Millpond

from tests.service.conftest import ROOT, Server, environment

REQUEST: dict[str, Any] = {"width": 96, "height": 54, "time": 1.25, "period": 0.4, "msaa": 4}
QUERY = "&".join(f"{name}={value}" for name, value in REQUEST.items())
REPEATS = 100
DRAW = """
import hashlib, json, sys
from renderer.encode.image import FORMATS
from renderer.pipeline import Renderer
from renderer.request import FrameRequest

request = FrameRequest.parse(json.loads(sys.argv[1]))
others = [FrameRequest.parse({"width": 33 + i, "height": 17, "time": i}) for i in range(int(sys.argv[3]))]
with Renderer() as renderer:
    for i in range(int(sys.argv[2])):
        for other in others[i : i + 1]:
            renderer.render(other)
        print(hashlib.sha256(FORMATS["png"].encode(renderer.render(request), request.canonical())).hexdigest())
"""


def digests_of_process(threads: str, repeats: int, others: int) -> list[str]:
    """Digests of the frame drawn in a process of its own, with other frames between."""
    arguments = [sys.executable, "-c", DRAW, json.dumps(REQUEST), str(repeats), str(others)]
    run = subprocess.run(
        arguments,
        cwd=ROOT,
        env=environment(LP_NUM_THREADS=threads),
        capture_output=True,
        text=True,
        check=True,
        timeout=150,
    )
    return run.stdout.split()


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def test_a_request_is_one_digest_everywhere(
    server: Server,
    http: httpx.Client,
    start_server: Callable[..., AbstractContextManager[Server]],
    tmp_path: Path,
) -> None:
    with ThreadPoolExecutor(2) as pool:
        drawn = pool.map(digests_of_process, ["0", "1", "2", "0"], [REPEATS // 4] * 4, [0, 3, 7, 1])
        found = [one for process in drawn for one in process]
    assert len(found) == REPEATS

    found.append(digest(http.get(f"/v1/frame.png?{QUERY}").content))
    found.append(digest(http.post("/v1/frame", json=REQUEST).content))
    with Millpond(server.url, timeout=60) as client:
        found.append(digest(client.frame(REQUEST).data))
        with client.turntable_job(REQUEST, outputs=["zip"], frames=2, fps=5.0, sweep=360.0) as job:
            job.wait(progress=False)
            found.append(digest(job.frame(0).data))
    with start_server("--workers=1") as other, httpx.Client(base_url=other.url, timeout=60) as alone:
        found.append(digest(alone.post("/v1/frame", json=REQUEST).content))
    out = tmp_path / "out.png"
    options = [f"--{name}={value}" for name, value in REQUEST.items()]
    subprocess.run(
        [sys.executable, "-m", "service", "frame", str(out), *options],
        cwd=ROOT,
        env=environment(),
        capture_output=True,
        check=True,
        timeout=150,
    )
    found.append(digest(out.read_bytes()))

    assert set(found) == {found[0]}
    assert digest(http.post("/v1/frame", json={**REQUEST, "time": 1.3}).content) != found[0]
