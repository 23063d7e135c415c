"""Artifacts: bytes by name, in a local directory.

A file is ``<root>/<ab>/<name>.<sha256>``: its own name carries the checksum, so that data and checksum appear in
one rename and a plain file can be served as it stands. ``LocalArtifacts`` may be opened by many processes at once
on one directory; only one of them should ``trim``.
"""

from __future__ import annotations

import errno
import hashlib
import logging
import os
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from time import time
from typing import Protocol

from service.errors import ArtifactMissing, StoreUnavailable

log = logging.getLogger(__name__)

_NAME = re.compile(r"[0-9A-Za-z][0-9A-Za-z_-]{3,159}")
_DIGEST = re.compile(r"[0-9a-f]{64}")
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO}
_STALE_SECONDS = 3600.0
"""Age at which a temporary file belongs to a process that died."""


@dataclass(frozen=True)
class Artifact:
    """Where an artifact lies, and what it must hash to."""

    name: str
    digest: str
    """SHA-256 of the bytes, hex."""
    size: int
    """Bytes."""
    path: Path


class ArtifactStore(Protocol):
    """Bytes by name; the seam behind which a bucket can stand."""

    def put(self, name: str, data: bytes) -> Artifact:
        """Store the bytes; what is there already and sound stays. Raises ``StoreUnavailable``."""

    def find(self, name: str) -> Artifact | None:
        """The artifact, its bytes unread, or None."""

    def read(self, name: str) -> tuple[Artifact, bytes]:
        """The artifact and its bytes, verified. Raises ``ArtifactMissing``."""

    def verified(self, name: str) -> Artifact | None:
        """The artifact if its bytes are sound; a damaged one is removed, and is missing."""

    def remove(self, name: str) -> None:
        """Forget the artifact, if there is one."""


def artifact_name(key: str, fingerprint: str) -> str:
    """The name of what a key gives under a fingerprint."""
    return f"{key}-{hashlib.sha256(fingerprint.encode()).hexdigest()[:16]}"


class LocalArtifacts:
    """An artifact store in a directory, with a budget in bytes.

    ``budget`` None lets it grow: workers open the store so, and leave the trimming to the service.
    """

    def __init__(self, root: Path, budget: int | None = None) -> None:
        self._root = root
        self._temporary = root / "tmp"
        self._budget = budget
        self._temporary.mkdir(parents=True, exist_ok=True)
        self._serial = count()
        self._lock = threading.Lock()
        self._used: int | None = None
        if budget is not None:
            self._drop_stale()

    @property
    def root(self) -> Path:
        """The directory."""
        return self._root

    def put(self, name: str, data: bytes) -> Artifact:
        """Store the bytes; what is there already and sound stays. Raises ``StoreUnavailable``."""
        digest = hashlib.sha256(data).hexdigest()
        with self._passing_file(name) as path:
            with path.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            return self._commit(name, digest, path)

    @contextmanager
    def writing(self, name: str) -> Iterator[Path]:
        """A temporary file to write; on leaving it becomes the artifact, unless an exception leaves.

        Raises ``StoreUnavailable`` where the disk is full or read-only.
        """
        with self._passing_file(name) as path:
            yield path
            self._commit(name, _synced(path), path)

    @contextmanager
    def _passing_file(self, name: str) -> Iterator[Path]:
        _check(name)
        path = self._temporary / f"{name}.{os.getpid()}.{threading.get_ident()}.{next(self._serial)}"
        try:
            yield path
        except OSError as error:
            if error.errno in _FULL:
                message = f"The artifacts can't be written: {error.strerror}."
                raise StoreUnavailable(message, retry_after=30) from error
            raise
        finally:
            path.unlink(missing_ok=True)

    def find(self, name: str) -> Artifact | None:
        """The artifact, its bytes unread, or None."""
        found = self._all(name)
        return found[0] if found else None

    def read(self, name: str) -> tuple[Artifact, bytes]:
        """The artifact and its bytes, verified. Raises ``ArtifactMissing``."""
        for artifact in self._all(name):
            with suppress(FileNotFoundError):
                data = artifact.path.read_bytes()
                if hashlib.sha256(data).hexdigest() == artifact.digest:
                    self._touch(artifact)
                    return artifact, data
                self._condemn(artifact)
        raise ArtifactMissing(name)

    def read_fresh(self, name: str, digest: str) -> bytes:
        """The bytes that a worker has reported just now; they are not hashed a second time.

        Raises ``ArtifactMissing``.
        """
        _check(name)
        try:
            return (self._root / name[:2] / f"{name}.{digest}").read_bytes()
        except FileNotFoundError as error:
            raise ArtifactMissing(name) from error

    def verified(self, name: str) -> Artifact | None:
        """The artifact if its bytes are sound; a damaged one is removed, and is missing."""
        for artifact in self._all(name):
            with suppress(FileNotFoundError):
                with artifact.path.open("rb") as file:
                    digest = hashlib.file_digest(file, "sha256").hexdigest()
                if digest == artifact.digest:
                    self._touch(artifact)
                    return artifact
                self._condemn(artifact)
        return None

    def remove(self, name: str) -> None:
        """Forget the artifact, if there is one."""
        for artifact in self._all(name):
            artifact.path.unlink(missing_ok=True)

    # ---------------------------------------------------------------------------------------------- the budget

    def grew(self, size: int) -> None:
        """Count bytes that another process has put."""
        with self._lock:
            if self._used is not None:
                self._used += size

    @property
    def is_over_budget(self) -> bool:
        """Whether ``trim`` has something to do, as far as this process knows."""
        if self._budget is None:
            return False
        with self._lock:
            return self._used is None or self._used > self._budget

    def trim(self, is_pinned: Callable[[str], bool] = lambda _: False) -> int:
        """Remove the least recently used artifacts that nobody pins until the budget is kept.

        Returns the bytes removed. Costs one look at every file.
        """
        if self._budget is None:
            return 0
        entries = sorted(self._entries())
        used = sum(size for _, size, _ in entries)
        removed = 0
        for _, size, path in entries:
            if used - removed <= self._budget:
                break
            if not is_pinned(path.name.partition(".")[0]):
                path.unlink(missing_ok=True)
                removed += size
        with self._lock:
            self._used = used - removed
        if used - removed > self._budget:
            log.warning("artifacts: %d bytes are pinned, over the budget of %d", used - removed, self._budget)
        return removed

    # ------------------------------------------------------------------------------------------------- hidden

    def _entries(self) -> Iterator[tuple[float, int, Path]]:
        for shard in self._root.iterdir():
            if shard == self._temporary or not shard.is_dir():
                continue
            for path in shard.iterdir():
                with suppress(FileNotFoundError):
                    facts = path.stat()
                    yield facts.st_mtime, facts.st_size, path

    def _all(self, name: str) -> list[Artifact]:
        """Every file of the name, the oldest first: what was stored first stands."""
        _check(name)
        prefix = f"{name}."
        found: list[tuple[float, Artifact]] = []
        with suppress(FileNotFoundError), os.scandir(self._root / name[:2]) as entries:
            for entry in entries:
                digest = entry.name.removeprefix(prefix)
                if entry.name.startswith(prefix) and _DIGEST.fullmatch(digest):
                    with suppress(FileNotFoundError):
                        facts = entry.stat()
                        artifact = Artifact(name, digest, facts.st_size, Path(entry.path))
                        found.append((facts.st_ctime, artifact))
        return [artifact for _, artifact in sorted(found, key=lambda item: (item[0], item[1].digest))]

    def _commit(self, name: str, digest: str, path: Path) -> Artifact:
        there = self.find(name)
        if there is not None and there.digest != digest and (there := self.verified(name)) is not None:
            # The promise is one key, one picture: the first one stands, and the log tells of the second.
            log.error("artifact %s was made again with other bytes: %s, not %s", name, digest, there.digest)
            return there
        shard = self._root / name[:2]
        shard.mkdir(exist_ok=True)
        stored = Artifact(name, digest, path.stat().st_size, shard / f"{name}.{digest}")
        path.rename(stored.path)
        _sync_folder(shard)
        if there is None:
            self.grew(stored.size)
        return stored

    def _touch(self, artifact: Artifact) -> None:
        """Remember the use: the time of modification is the time of last use here."""
        with suppress(OSError):
            os.utime(artifact.path)

    def _condemn(self, artifact: Artifact) -> None:
        log.error("artifact %s is damaged (%d bytes): removed", artifact.name, artifact.size)
        artifact.path.unlink(missing_ok=True)

    def _drop_stale(self) -> None:
        for path in self._temporary.iterdir():
            with suppress(FileNotFoundError):
                if time() - path.stat().st_mtime > _STALE_SECONDS:
                    path.unlink()


def _check(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise ValueError(f"not an artifact's name: {name!r}")


def _synced(path: Path) -> str:
    """The file's digest, once its bytes are on the disk."""
    with path.open("rb+") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        os.fsync(file.fileno())
    return digest


def _sync_folder(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
