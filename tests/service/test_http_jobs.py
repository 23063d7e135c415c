"""Jobs over HTTP: submitted once, followed, cancelled, fetched whole or in part."""

from __future__ import annotations

import io
import json
import time
import zipfile
from typing import Any

import httpx
import pytest
from PIL import Image

from tests.service.conftest import Server, movie_frames
from tests.service.test_http_errors import mistakes, problem

PATIENCE = 60.0


def job_body(frames: int, **fields: Any) -> dict[str, Any]:
    """A small turntable; another ``seed`` makes its frames others than those of other tests."""
    seed = fields.pop("seed", 0)
    return {
        "kind": "turntable",
        "frame": {"width": 64, "height": 36, "seed": seed},
        "turntable": {"frames": frames, "fps": 12},
        **fields,
    }


def ended(http: httpx.Client, path: str) -> dict[str, Any]:
    """The job once it has ended."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        job: dict[str, Any] = http.get(path).json()
        if job["state"] not in {"queued", "running"}:
            return job
        time.sleep(0.1)
    pytest.fail(f"the job did not end within {PATIENCE} s: {job}")


@pytest.fixture(scope="module")
def finished(http: httpx.Client) -> str:
    """The path of a job of five frames that has succeeded."""
    answer = http.post("/v1/jobs", json=job_body(5, outputs=["mp4"]))
    assert answer.status_code == 202
    path = answer.headers["location"]
    assert ended(http, path)["state"] == "succeeded"
    return str(path)


def test_a_job_is_accepted_with_its_place_and_ends_with_every_frame(http: httpx.Client) -> None:
    answer = http.post("/v1/jobs", json=job_body(3, seed=31))

    assert answer.status_code == 202
    job = answer.json()
    assert answer.headers["location"] == f"/v1/jobs/{job['id']}" == job["links"]["self"]
    assert answer.headers["cache-control"] == "no-store"
    assert job["state"] in {"queued", "running"}
    assert job["counts"]["total"] == 3
    done = ended(http, answer.headers["location"])
    assert done["state"] == "succeeded"
    assert done["counts"] == {"total": 3, "done": 3, "failed": 0, "pending": 0, "leased": 0}
    assert done["frames_per_second"] > 0


def test_frames_of_a_job_are_those_of_get(http: httpx.Client, finished: str) -> None:
    listed = http.get(f"{finished}/frames").json()["frames"]

    assert [frame["index"] for frame in listed] == [0, 1, 2, 3, 4]
    for frame in listed:
        answer = http.get(frame["url"])
        assert answer.status_code == 200
        assert answer.headers["x-frame-key"] == frame["key"]
        request = json.loads(Image.open(io.BytesIO(answer.content)).info["millpond"])
        again = http.post("/v1/frame", json=request)
        assert again.content == answer.content
        assert again.headers["etag"] == answer.headers["etag"]
        known = http.get(frame["url"], headers={"If-None-Match": answer.headers["etag"]})
        assert known.status_code == 304


def test_frames_come_in_pages(http: httpx.Client, finished: str) -> None:
    first = http.get(f"{finished}/frames", params={"limit": 3}).json()
    rest = http.get(f"{finished}/frames", params={"limit": 3, "cursor": first["next"]}).json()

    assert [frame["index"] for frame in (*first["frames"], *rest["frames"])] == [0, 1, 2, 3, 4]
    assert rest["next"] is None


def test_products_hold_every_frame(http: httpx.Client, finished: str) -> None:
    archive = zipfile.ZipFile(io.BytesIO(http.get(f"{finished}/result.zip").content))
    assert archive.testzip() is None
    assert len([name for name in archive.namelist() if name.endswith(".png")]) == 5
    assert movie_frames(http.get(f"{finished}/result.mp4").content) == 5
    sheet = http.get(f"{finished}/contact-sheet.png")
    assert sheet.headers["content-type"] == "image/png"
    assert Image.open(io.BytesIO(sheet.content)).width > 64


def test_products_are_sent_in_ranges(http: httpx.Client, finished: str) -> None:
    url = f"{finished}/result.zip"
    whole = http.get(url)
    size = len(whole.content)
    etag = whole.headers["etag"]
    assert whole.headers["accept-ranges"] == "bytes"

    for given, start, stop in [("0-99", 0, 100), ("100-", 100, size), ("-7", size - 7, size), ("5-999999999", 5, size)]:
        part = http.get(url, headers={"Range": f"bytes={given}", "If-Range": etag})
        assert part.status_code == 206
        assert part.headers["content-range"] == f"bytes {start}-{stop - 1}/{size}"
        assert part.content == whole.content[start:stop]
    past = http.get(url, headers={"Range": f"bytes={size}-"})
    problem(past, 416, "range-not-satisfiable")
    assert past.headers["content-range"] == f"bytes */{size}"
    for ignored in ("bytes=5-2", "lines=1-2", "bytes=-", "bytes=0-1,4-5"):
        assert http.get(url, headers={"Range": ignored}).content == whole.content
    changed = http.get(url, headers={"Range": "bytes=0-9", "If-Range": '"older"'})
    assert changed.status_code == 200
    assert http.get(url, headers={"If-None-Match": etag}).status_code == 304
    head = http.head(url)
    assert head.headers["content-length"] == str(size)
    assert not head.content


def test_an_idempotency_key_makes_one_job_of_two_requests(http: httpx.Client) -> None:
    key = {"Idempotency-Key": "one-and-the-same"}
    first = http.post("/v1/jobs", json=job_body(2), headers=key)
    second = http.post("/v1/jobs", json=job_body(2), headers=key)
    other = http.post("/v1/jobs", json=job_body(3), headers=key)

    assert second.status_code == 202
    assert second.json()["id"] == first.json()["id"]
    body = problem(other, 422, "idempotency-conflict")
    assert body["errors"][0]["path"] == "Idempotency-Key"
    (mistake,) = mistakes(http.post("/v1/jobs", json=job_body(2), headers={"Idempotency-Key": "x" * 300}))
    assert mistake["path"] == "Idempotency-Key"


def test_jobs_come_in_pages_newest_first(http: httpx.Client, finished: str) -> None:
    for seed in (1, 2):
        ended(http, http.post("/v1/jobs", json=job_body(1, seed=seed)).headers["location"])
    seen: list[dict[str, Any]] = []
    cursor = None
    while True:
        query = {"limit": "2", "state": "succeeded", **({"cursor": cursor} if cursor else {})}
        page = http.get("/v1/jobs", params=query).json()
        assert len(page["jobs"]) <= 2
        seen += page["jobs"]
        cursor = page["next"]
        if cursor is None:
            break

    assert len({job["id"] for job in seen}) == len(seen) >= 3
    assert [job["created"] for job in seen] == sorted((job["created"] for job in seen), reverse=True)
    assert finished.rpartition("/")[2] in {job["id"] for job in seen}


def test_a_cancelled_job_stops_and_says_so(http: httpx.Client) -> None:
    body = job_body(60, seed=7)
    body["frame"] |= {"width": 320, "height": 180, "samples": 2}
    path = http.post("/v1/jobs", json=body).headers["location"]
    early = http.get(f"{path}/result.zip")
    told = problem(early, 409, "job-unfinished")
    assert told["progress"]["total"] == 60
    assert int(early.headers["retry-after"]) > 0
    problem(http.get(f"{path}/frames/59.png"), 409, "job-unfinished")

    cancelled = http.post(f"{path}/cancel")
    assert cancelled.status_code == 200
    assert cancelled.json()["state"] == "cancelled"
    assert http.post(f"{path}/cancel").json()["state"] == "cancelled"
    late = http.get(f"{path}/result.mp4")
    assert late.status_code == 409
    assert "retry-after" not in late.headers
    done = http.get(path).json()["counts"]["done"]
    time.sleep(1.0)
    assert http.get(path).json()["counts"]["done"] <= done + 2
    assert done < 60


def test_a_finished_job_cannot_be_cancelled(http: httpx.Client, finished: str) -> None:
    body = problem(http.post(f"{finished}/cancel"), 409, "job-state")

    assert body["state"] == "succeeded"


@pytest.mark.parametrize("tail", ["", "/frames", "/frames/0.png", "/result.zip", "/contact-sheet.png"])
def test_an_unknown_job_is_404(http: httpx.Client, tail: str) -> None:
    problem(http.get(f"/v1/jobs/0000000000000000{tail}"), 404, "unknown-job")
    problem(http.post("/v1/jobs/0000000000000000/cancel"), 404, "unknown-job")


@pytest.mark.parametrize(
    ("tail", "kind"),
    [
        ("/frames/5.png", "unknown-frame"),
        ("/frames/-1.png", "unknown-frame"),
        ("/frames/one.png", "unknown-frame"),
        ("/frames/99999999999999999999.png", "unknown-frame"),
        ("/frames/0.jpg", "not-found"),
        ("/result.avi", "unknown-product"),
    ],
)
def test_what_a_job_does_not_have_is_404(http: httpx.Client, finished: str, tail: str, kind: str) -> None:
    problem(http.get(f"{finished}{tail}"), 404, kind)


@pytest.mark.parametrize(
    ("body", "path", "bound"),
    [
        ({"kind": "dataset"}, "kind", "turntable"),
        ({}, "kind", None),
        ({"kind": "turntable", "turntable": {"frames": 61}}, "turntable.frames", "60"),
        ({"kind": "turntable", "turntable": {"sweep": 90}}, "turntable.loop", "360"),
        ({"kind": "turntable", "frame": {"water": {"tile_0": -1}}}, "frame.water.tile_0", ">"),
        ({"kind": "turntable", "frame": {"width": 100_000}}, "frame.width", "8192"),
        ({"kind": "turntable", "outputs": ["avi"]}, "outputs.0", "mp4"),
        ({"kind": "turntable", "frames": 3}, "frames", None),
    ],
)
def test_a_bad_job_is_refused_before_it_is_one(
    http: httpx.Client, body: dict[str, Any], path: str, bound: str | None
) -> None:
    before = len(http.get("/v1/jobs", params={"limit": 1000}).json()["jobs"])
    (mistake,) = mistakes(
        http.post("/v1/jobs", json=body if "turntable" in body else {**body, "turntable": {"frames": 2}})
    )

    assert mistake["path"] == path
    assert bound is None or bound in mistake["bound"]
    assert len(http.get("/v1/jobs", params={"limit": 1000}).json()["jobs"]) == before


@pytest.mark.parametrize(
    ("query", "path"),
    [("state=asleep", "state"), ("cursor=bogus", "cursor"), ("limit=0", "limit"), ("limit=x", "limit")],
)
def test_a_bad_page_is_refused(http: httpx.Client, query: str, path: str) -> None:
    (mistake,) = mistakes(http.get(f"/v1/jobs?{query}"))

    assert mistake["path"] == path


def test_the_log_has_a_line_a_frame_and_no_query(http: httpx.Client, server: Server) -> None:
    answer = http.get("/v1/frame.png?width=64&height=36&seed=424242", headers={"X-Request-Id": "look-for-me"})
    lines = [json.loads(line) for line in server.log_text().splitlines()]

    (line,) = [line for line in lines if line["event"] == "frame" and line["request_id"] == "look-for-me"]
    assert line["key"] == answer.headers["x-frame-key"]
    assert line["render_ms"] > 0
    assert "424242" not in server.log_text()
