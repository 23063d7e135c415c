from __future__ import annotations

import io
import json
import threading
import zipfile
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from renderer.encode.verify import verify_movie
from renderer.errors import EncodeError
from renderer.request import FrameRequest
from service.artifacts import artifact_name
from service.errors import (
    ArtifactMissing,
    FrameUnfinished,
    JobUnfinished,
    ProductIncomplete,
    UnknownFrame,
    UnknownProduct,
)
from service.frames import FrameCache, StoredFrame
from service.jobs import Jobs, assembly
from service.jobs.assembly import Archive, frame_name, write_movie, zip_stream
from service.jobs.products import Product
from service.jobs.spec import coarse_to_fine
from tests.service.core import cache_on, eventually, jobs_on, make_inline, turntable
from tests.service.scripted import FINGERPRINT, Seed, begun, open_gate, picture

pytestmark = pytest.mark.anyio


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture
def cache(tmp_path: Path) -> Iterator[FrameCache]:
    with cache_on(make_inline(tmp_path), tmp_path, memory=0) as ready:
        yield ready


@pytest.fixture
def jobs(cache: FrameCache, tmp_path: Path) -> Iterator[Jobs]:
    with jobs_on(cache, tmp_path) as ready:
        yield ready


def _done(jobs: Jobs, frames: int = 5, **fields: object) -> str:
    job_id = jobs.submit(turntable(frames, **fields)).job.id  # type: ignore[arg-type]
    eventually(lambda: jobs.job(job_id).job.state == "succeeded")
    return job_id


# ---------------------------------------------------------------------------------------------------------- archives


def test_the_archive_holds_every_frame_under_a_name_that_sorts(jobs: Jobs) -> None:
    job_id = _done(jobs)
    product = jobs.product(job_id, "result.zip")
    with zipfile.ZipFile(product.path) as archive:
        names = archive.namelist()
        manifest = json.loads(archive.read("manifest.json"))

        assert names == [*(f"frame_{index:08d}.png" for index in range(5)), "manifest.json"]
        assert [archive.read(name) for name in names[:5]] == [picture(64, 36, i / 12.0) for i in range(5)]
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {info.compress_type for info in archive.infolist()} == {zipfile.ZIP_STORED}
        assert {info.flag_bits & 8 for info in archive.infolist()} == {0}  # sizes in front: streams can be unpacked
    assert [entry["file"] for entry in manifest["frames"]] == names[:5]
    assert product.media_type == "application/zip"
    assert product.filename == f"millpond-{job_id}-result.zip"


def test_equal_jobs_have_equal_products(jobs: Jobs, cache: FrameCache) -> None:
    first = jobs.product(_done(jobs), "result.zip")
    cache.artifacts.remove(first.path.name.partition(".")[0])
    second = jobs.product(_done(jobs), "result.zip")

    assert (second.digest, second.etag) == (first.digest, first.etag)


def test_the_manifest_gives_each_frame_its_identity_and_camera(jobs: Jobs) -> None:
    job_id = _done(jobs)
    manifest = json.loads(jobs.product(job_id, "manifest.json").path.read_bytes())
    frames = jobs.store.frames(job_id)
    for entry, frame in zip(manifest["frames"], frames, strict=True):
        request = FrameRequest.parse(entry["request"])
        gl = np.array(entry["camera"]["world_from_camera_opengl"])
        cv = np.array(entry["camera"]["world_from_camera_opencv"])
        # The eye looks at the target: in OpenCV's camera frame it lies in front, in OpenGL's behind −z.
        target = np.array([*request.model_dump()["camera"]["target"], 1.0])

        assert (entry["key"], entry["digest"], entry["fingerprint"]) == (frame.key, frame.digest, FINGERPRINT)
        assert request.key() == entry["key"]
        assert (np.linalg.inv(cv) @ target)[2] > 0 > (np.linalg.inv(gl) @ target)[2]
        x, y, z = (np.array(entry["camera"]["intrinsics"]) @ (np.linalg.inv(cv) @ target)[:3]).tolist()
        assert (x / z, y / z) == pytest.approx((32.0, 18.0))


def test_an_archive_that_is_drained_as_it_grows_is_whole() -> None:
    archive = Archive()
    members = {f"m{index}": bytes([index]) * 1000 * index for index in range(5)}
    parts = [archive.add(name, data) for name, data in members.items()]
    whole = b"".join([*parts, archive.finish()])

    assert all(len(part) > len(data) for part, data in zip(parts, members.values(), strict=True))
    with zipfile.ZipFile(io.BytesIO(whole)) as read:
        assert {name: read.read(name) for name in read.namelist()} == members


async def test_a_stream_of_frames_is_an_archive_with_a_manifest() -> None:
    async def frames() -> AsyncIterator[StoredFrame]:
        for index in range(3):
            yield StoredFrame(f"k{index}", "f", f"d{index}", bytes([index]) * 9, "image/png", "driver")

    chunks = [chunk async for chunk in zip_stream(frames(), "png")]
    with zipfile.ZipFile(io.BytesIO(b"".join(chunks))) as archive:
        manifest = json.loads(archive.read("manifest.json"))

        assert archive.testzip() is None
        assert archive.read(frame_name(2, "png")) == b"\2" * 9
    assert len(chunks) == 4
    assert [entry["key"] for entry in manifest["frames"]] == ["k0", "k1", "k2"]


def test_an_archive_that_came_out_wrong_is_not_handed_out(jobs: Jobs, monkeypatch: pytest.MonkeyPatch) -> None:
    add = Archive.add

    def tear(self: Archive, name: str, data: bytes) -> bytes:
        return add(self, name, data).replace(b"IDAT", b"IDAX")

    monkeypatch.setattr(assembly.Archive, "add", tear)
    with pytest.raises(EncodeError, match="damaged"):
        jobs.product(_done(jobs), "result.zip")


# ---------------------------------------------------------------------------------------------------------- pictures


def test_the_movie_has_every_frame_at_its_time(jobs: Jobs) -> None:
    product = jobs.product(_done(jobs, 7), "result.mp4")

    assert verify_movie(product.path, 7, 12, 64, 36).frames == 7
    assert product.media_type == "video/mp4"


def test_a_movie_that_lacks_a_frame_is_refused(tmp_path: Path) -> None:
    frames = [picture(64, 36, float(i)) for i in range(4)]
    with pytest.raises(EncodeError, match="expected 5"):
        write_movie(tmp_path / "short.mp4", frames, width=64, height=36, fps=12.0, count=5)


def test_a_movie_of_what_is_no_picture_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EncodeError, match="read back"):
        write_movie(tmp_path / "odd.mp4", [b"rubbish"], width=64, height=36, fps=12.0, count=1)


def test_the_contact_sheet_shows_the_job(jobs: Jobs) -> None:
    product = jobs.product(_done(jobs, 30), "contact-sheet.png")
    with Image.open(product.path) as sheet:
        colours = {pixel for _, pixel in sheet.convert("RGB").getcolors(1 << 24) or ()}

        assert sheet.width == 1600
    shown = [0, 29]
    for index in shown:
        with Image.open(io.BytesIO(picture(64, 36, index / 12.0))) as frame:
            assert frame.getpixel((5, 5)) in colours


# ------------------------------------------------------------------------------------------ when and when not


def test_products_wait_for_their_frames(jobs: Jobs, tmp_path: Path) -> None:
    job_id = jobs.submit(turntable(3, Seed.WAIT)).job.id
    for name in ("result.zip", "result.mp4", "contact-sheet.png", "manifest.json"):
        with pytest.raises(JobUnfinished) as unfinished:
            jobs.product(job_id, name)

        assert unfinished.value.progress["total"] == 3
    with pytest.raises(FrameUnfinished):
        jobs.frame(job_id, 0)
    open_gate(tmp_path)
    eventually(lambda: jobs.job(job_id).job.state == "succeeded")
    assert jobs.product(job_id, "result.zip").size > 0
    assert jobs.frame(job_id, 1).data == picture(64, 36, 1 / 12.0)


def test_a_job_with_failed_frames_has_no_product_and_names_them(jobs: Jobs) -> None:
    job_id = jobs.submit(turntable(3, Seed.RAISE)).job.id
    eventually(lambda: jobs.job(job_id).job.state == "failed")
    with pytest.raises(ProductIncomplete) as incomplete:
        jobs.product(job_id, "result.mp4")

    assert incomplete.value.missing == (0, 1, 2)


def test_unknown_products_and_frames_are_refused(jobs: Jobs) -> None:
    job_id = _done(jobs, 2)
    with pytest.raises(UnknownProduct, match=r"result\.zip"):
        jobs.product(job_id, "result.exe")
    with pytest.raises(UnknownFrame):
        jobs.frame(job_id, 2)
    with pytest.raises(UnknownFrame):
        jobs.frame(job_id, -1)


def test_products_that_a_job_names_are_made_ahead(jobs: Jobs, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    make = jobs._products.product

    def noted(job_id: str, name: str) -> Product:
        made.append(name)
        return make(job_id, name)

    monkeypatch.setattr(jobs._products, "product", noted)
    _done(jobs, outputs=["mp4", "zip"])

    eventually(lambda: made == ["result.mp4", "result.zip"])


def test_a_product_is_made_once_however_many_ask(jobs: Jobs, monkeypatch: pytest.MonkeyPatch) -> None:
    job_id = _done(jobs)
    made: list[Path] = []
    write = assembly.write_zip

    def counted(path: Path, *rest: object) -> None:
        made.append(path)
        write(path, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr("service.jobs.products.write_zip", counted)
    threads = [threading.Thread(target=jobs.product, args=(job_id, "result.zip")) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert len(made) == 1


def test_a_frame_that_was_lost_or_damaged_is_drawn_again_as_it_was(
    jobs: Jobs, cache: FrameCache, tmp_path: Path
) -> None:
    job_id = _done(jobs, 3)
    lost, damaged, _ = (
        cache.artifacts.find(artifact_name(record.key, FINGERPRINT)) for record in jobs.store.frames(job_id)
    )
    assert lost is not None
    assert damaged is not None
    lost.path.unlink()
    damaged.path.write_bytes(damaged.path.read_bytes()[:-4])
    before = len(begun(tmp_path))
    product = jobs.product(job_id, "result.zip")

    assert len(begun(tmp_path)) == before + 2
    with zipfile.ZipFile(product.path) as archive:
        assert archive.read(frame_name(0, "png")) == picture(64, 36, 0.0)


def test_a_frame_of_another_version_is_not_passed_off_as_the_old_one(
    jobs: Jobs, cache: FrameCache, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job_id = _done(jobs, 2)
    for record in jobs.store.frames(job_id):
        cache.artifacts.remove(artifact_name(record.key, FINGERPRINT))
    monkeypatch.setattr("renderer.request.source_digest", lambda: "a later version")

    with pytest.raises(ArtifactMissing):
        jobs.frame(job_id, 0)
    with pytest.raises(ProductIncomplete):
        jobs.product(job_id, "result.zip")
    assert len(begun(tmp_path)) == 2


def test_a_damaged_product_is_made_again(jobs: Jobs) -> None:
    job_id = _done(jobs)
    first = jobs.product(job_id, "result.zip")
    first.path.write_bytes(b"rubbish")

    assert jobs.product(job_id, "result.zip").digest == first.digest
    assert first.path.stat().st_size == first.size


@pytest.mark.parametrize("count", [1, 2, 3, 8, 100])
def test_coarse_to_fine_is_every_frame_once(count: int) -> None:
    assert sorted(coarse_to_fine(count)) == list(range(count))
    assert list(coarse_to_fine(8)) == [0, 4, 2, 6, 1, 5, 3, 7]
