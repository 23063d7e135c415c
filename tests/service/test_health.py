"""Alive, ready, and what the server says of itself."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import httpx
import pytest

from renderer.scene.catalogue import SCENES
from renderer.water.catalogue import TECHNIQUES
from service.settings import Limits
from tests.service.conftest import Server


def client_of(server: Server) -> httpx.Client:
    """A client of a test's own server."""
    return httpx.Client(base_url=server.url, timeout=30)


def test_a_ready_server_is_alive_and_every_worker_has_drawn_its_canary(http: httpx.Client) -> None:
    live, ready = http.get("/livez"), http.get("/readyz")

    assert live.status_code == ready.status_code == 200
    assert live.headers["cache-control"] == ready.headers["cache-control"] == "no-store"
    workers = http.get("/v1/info").json()["workers"]
    assert len(workers) == 3
    assert len({worker["canary"] for worker in workers}) == 1
    assert None not in {worker["canary"] for worker in workers}


def test_info_names_versions_driver_and_fingerprint(http: httpx.Client) -> None:
    info = http.get("/v1/info").json()

    assert info["renderer"]
    assert isinstance(info["software"], bool)
    assert re.fullmatch(r"[0-9a-f]+", info["fingerprint"])
    assert info["ready"] is True
    assert info["limits"]["sequence_frames"] == 24
    assert {worker["lane"] for worker in info["workers"]} == {"interactive", "batch"}


def test_limits_tell_every_cap(http: httpx.Client) -> None:
    limits = http.get("/v1/limits").json()

    assert set(limits) == set(Limits.model_fields)
    assert limits["job_frames"] == 60


def test_catalogues_give_schema_defaults_and_citation(http: httpx.Client) -> None:
    techniques = {entry["name"]: entry for entry in http.get("/v1/techniques").json()["techniques"]}
    scenes = {entry["name"]: entry for entry in http.get("/v1/scenes").json()["scenes"]}

    assert set(techniques) == set(TECHNIQUES)
    for entry in techniques.values():
        assert entry["source"]
        assert set(entry["defaults"]) == set(entry["schema"]["properties"])
    assert set(scenes) == set(SCENES)
    assert {entry["name"] for entry in http.get("/v1/formats").json()["formats"]} >= {"png", "jpeg", "webp"}
    assert "color" in {entry["name"] for entry in http.get("/v1/layers").json()["layers"]}


def test_the_openapi_document_refers_only_to_what_it_holds(http: httpx.Client) -> None:
    document = http.get("/openapi.json").json()

    def references(value: Any) -> set[str]:
        if isinstance(value, dict):
            own = {value["$ref"]} if isinstance(value.get("$ref"), str) else set()
            return own.union(*(references(item) for item in value.values()))
        return set().union(*(references(item) for item in value)) if isinstance(value, list) else set()

    held = {f"#/components/schemas/{name}" for name in document["components"]["schemas"]}
    assert references(document) <= held
    operations = [entry["operationId"] for path in document["paths"].values() for entry in path.values()]
    assert len(set(operations)) == len(operations)
    assert "/v1/frame" in document["paths"]


@pytest.mark.parametrize("path", ["/", "/docs", "/problems"])
def test_pages_need_no_other_host(http: httpx.Client, path: str) -> None:
    answer = http.get(path)

    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", answer.text)
    assert "default-src 'none'" in answer.headers["content-security-policy"]


def test_links_of_the_pages_lead_somewhere(http: httpx.Client) -> None:
    for path in ("/", "/docs"):
        for link in re.findall(r'href="(/[^"]*)"', http.get(path).text):
            assert http.get(link).status_code == 200, link


def test_a_stopped_worker_makes_the_server_unready_and_leaves_it_alive(
    start_server: Callable[..., AbstractContextManager[Server]],
) -> None:
    with (
        start_server("--workers=1", "--interactive=false") as server,
        httpx.Client(base_url=server.url, timeout=30) as client,
    ):
        worker = client.get("/v1/info").json()["workers"][0]
        os.kill(worker["pid"], signal.SIGSTOP)
        deadline = time.monotonic() + 15
        while client.get("/readyz").status_code == 200 and time.monotonic() < deadline:
            time.sleep(0.1)
        ready = client.get("/readyz")

        assert ready.status_code == 503
        assert ready.headers["content-type"] == "application/problem+json"
        assert int(ready.headers["retry-after"]) > 0
        assert ready.json()["type"] == "/problems/not-ready"
        assert client.get("/livez").status_code == 200

        deadline = time.monotonic() + 60
        while client.get("/readyz").status_code != 200 and time.monotonic() < deadline:
            time.sleep(0.2)
        after = client.get("/v1/info").json()["workers"][0]
        assert after["pid"] != worker["pid"]
        assert client.get("/v1/frame?width=64&height=36").status_code == 200


def test_without_a_device_the_server_lives_and_readiness_says_what_is_missing(
    start_server: Callable[..., AbstractContextManager[Server]],
) -> None:
    with (
        start_server("--workers=1", "--interactive=false", "--require=gpu", is_awaited=False) as server,
        httpx.Client(base_url=server.url, timeout=30) as client,
    ):
        assert client.get("/livez").status_code == 200
        deadline = time.monotonic() + 60
        while (ready := client.get("/readyz")).json().get("type") != "/problems/no-device":
            if ready.status_code == 200:
                pytest.skip("this machine has a GPU")
            assert time.monotonic() < deadline, ready.text
            time.sleep(0.2)

        assert ready.status_code == 503
        assert "gpu" in ready.json()["detail"]
        frame = client.get("/v1/frame?width=64&height=36")
        assert frame.status_code == 503
        assert frame.json()["type"] == "/problems/no-device"
        assert int(frame.headers["retry-after"]) > 0


def test_sigterm_ends_the_server_and_every_worker(
    start_server: Callable[..., AbstractContextManager[Server]],
) -> None:
    with start_server("--workers=1") as server:
        pids = [worker["pid"] for worker in httpx.get(f"{server.url}/v1/info").json()["workers"]]
        body = {"frame": {"width": 320, "height": 180}, "kind": "turntable", "turntable": {"frames": 60}}
        assert httpx.post(f"{server.url}/v1/jobs", json=body).status_code == 202
        began = time.monotonic()
        server.process.send_signal(signal.SIGTERM)
        code = server.process.wait(20)

        assert code == 0
        assert time.monotonic() - began < 12
        for pid in pids:
            with pytest.raises(ProcessLookupError):
                os.kill(pid, 0)
