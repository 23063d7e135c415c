from __future__ import annotations

import errno
import hashlib
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from service.artifacts import ArtifactStore, LocalArtifacts, artifact_name
from service.errors import ArtifactMissing, StoreUnavailable

NAME = artifact_name("ab" * 32, "a driver")
STORES: dict[str, Callable[[Path], ArtifactStore]] = {"local": LocalArtifacts}


@pytest.fixture(params=STORES)
def store(request: pytest.FixtureRequest, tmp_path: Path) -> ArtifactStore:
    return STORES[request.param](tmp_path / "artifacts")


@pytest.fixture
def local(tmp_path: Path) -> LocalArtifacts:
    return LocalArtifacts(tmp_path / "artifacts", budget=1000)


# ------------------------------------------------------------------------------------------ the contract of all stores


def test_what_was_put_is_read_back_with_its_checksum(store: ArtifactStore) -> None:
    put = store.put(NAME, b"pixels")
    found, data = store.read(NAME)

    assert data == b"pixels"
    assert found.digest == put.digest == hashlib.sha256(b"pixels").hexdigest()
    assert found.size == 6
    assert store.find(NAME) == store.verified(NAME) == found


def test_what_was_not_put_is_missing(store: ArtifactStore) -> None:
    assert store.find(NAME) is None
    assert store.verified(NAME) is None
    with pytest.raises(ArtifactMissing):
        store.read(NAME)


def test_putting_twice_is_putting_once(store: ArtifactStore) -> None:
    assert store.put(NAME, b"pixels") == store.put(NAME, b"pixels")


def test_a_finished_artifact_is_never_overwritten(store: ArtifactStore) -> None:
    store.put(NAME, b"first")
    store.put(NAME, b"second")

    assert store.read(NAME)[1] == b"first"


def test_names_that_differ_only_by_their_end_are_apart(store: ArtifactStore) -> None:
    store.put("abcd", b"one")

    assert store.find("abcde") is None
    assert store.find("abc0") is None


def test_a_removed_artifact_is_missing(store: ArtifactStore) -> None:
    store.put(NAME, b"pixels")
    store.remove(NAME)
    store.remove(NAME)

    assert store.find(NAME) is None


def test_a_name_can_not_lead_out_of_the_store(store: ArtifactStore) -> None:
    with pytest.raises(ValueError, match="not an artifact's name"):
        store.put("../../etc/passwd", b"")


def test_many_threads_put_one_name_without_a_tear(store: ArtifactStore) -> None:
    data = os.urandom(100_000)
    threads = [threading.Thread(target=store.put, args=(NAME, data)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert store.read(NAME)[1] == data


# ------------------------------------------------------------------------------------------------ the local directory


def test_the_fingerprint_is_part_of_the_name() -> None:
    assert artifact_name("k" * 64, "one driver") != artifact_name("k" * 64, "another")
    assert artifact_name("k" * 64, "one driver").startswith("k" * 64)


def _truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[3] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize("damage", [_truncate, _flip])
@pytest.mark.parametrize("look", ["read", "verified"])
def test_a_damaged_artifact_is_removed_and_missing(
    local: LocalArtifacts, damage: Callable[[Path], None], look: str
) -> None:
    path = local.put(NAME, b"pixels").path
    damage(path)

    if look == "read":
        with pytest.raises(ArtifactMissing):
            local.read(NAME)
    else:
        assert local.verified(NAME) is None
    assert not path.exists()
    assert local.put(NAME, b"pixels").path.read_bytes() == b"pixels"


def test_sound_bytes_replace_damaged_ones(local: LocalArtifacts) -> None:
    _flip(local.put(NAME, b"pixels").path)
    local.put(NAME, b"pixels")

    assert local.read(NAME)[1] == b"pixels"


def test_a_writer_that_fails_leaves_nothing(local: LocalArtifacts) -> None:
    def fail() -> None:
        with local.writing(NAME) as path:
            path.write_bytes(b"half of")
            raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        fail()

    assert local.find(NAME) is None
    assert [path for path in local.root.rglob("*") if path.is_file()] == []


def test_bytes_are_on_the_disk_before_their_name_is(local: LocalArtifacts, monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[str] = []
    monkeypatch.setattr(os, "fsync", lambda _: steps.append("fsync"))
    rename = Path.rename

    def noted(self: Path, target: Path) -> Path:
        steps.append("rename")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", noted)
    local.put(NAME, b"pixels")

    assert steps == ["fsync", "rename", "fsync"]


def test_a_full_disk_is_said_to_be_full(local: LocalArtifacts, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StoreUnavailable, match="No space left") as refusal:
        local.put(NAME, b"pixels")

    assert refusal.value.retry_after > 0
    assert local.find(NAME) is None


def test_files_left_by_dead_processes_are_dropped_once_they_are_old(tmp_path: Path) -> None:
    first = LocalArtifacts(tmp_path, budget=1000)
    fresh, stale = tmp_path / "tmp" / "fresh", tmp_path / "tmp" / "stale"
    for path in (fresh, stale):
        path.write_bytes(b"half of")
    os.utime(stale, (time.time() - 7200, time.time() - 7200))
    LocalArtifacts(tmp_path)

    assert stale.exists()  # only the process that keeps the budget cleans up
    LocalArtifacts(tmp_path, budget=1000)
    assert fresh.exists()
    assert not stale.exists()
    assert first.trim() == 0


# --------------------------------------------------------------------------------------------------------- the budget


def _used_at(local: LocalArtifacts, name: str, seconds_ago: float) -> None:
    artifact = local.find(name)
    assert artifact is not None
    os.utime(artifact.path, (time.time() - seconds_ago,) * 2)


def test_the_least_recently_used_go_first(local: LocalArtifacts) -> None:
    for age, name in enumerate(("newest", "middle", "oldest")):
        local.put(name, bytes(400))
        _used_at(local, name, 100 * age + 50)
    local.read("oldest")

    before = local.is_over_budget
    removed = local.trim()

    assert (before, removed, local.is_over_budget) == (True, 400, False)
    assert local.find("middle") is None
    assert local.find("oldest") is not None
    assert local.find("newest") is not None


def test_what_is_pinned_stays_over_the_budget(local: LocalArtifacts) -> None:
    for age, name in enumerate(("free", "held-1", "held-2", "held-3")):
        local.put(name, bytes(400))
        _used_at(local, name, 100 * age)

    assert local.trim(lambda name: name.startswith("held")) == 400
    assert local.find("free") is None
    assert all(local.find(f"held-{i}") for i in (1, 2, 3))


def test_bytes_of_other_processes_count(tmp_path: Path) -> None:
    keeper, worker = LocalArtifacts(tmp_path, budget=1000), LocalArtifacts(tmp_path)
    keeper.trim()
    worker.put(NAME, bytes(1500))

    before = keeper.is_over_budget
    keeper.grew(1500)

    assert (before, keeper.is_over_budget) == (False, True)
    assert keeper.trim() == 1500


def test_a_store_without_a_budget_never_trims(tmp_path: Path) -> None:
    worker = LocalArtifacts(tmp_path)
    worker.put(NAME, bytes(1500))

    assert not worker.is_over_budget
    assert worker.trim() == 0
