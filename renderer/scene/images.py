"""The library of users' own images: files by the hash of their bytes, read by every process of this user.

It stands in the user's cache folder (``MILLPOND_CACHE``), beside the baked scenes, so that the service, its workers and
the command line see the same images without being told. What is stored are the bytes as they came, once they were
decoded and found right; they are written under a temporary name and renamed, so that a reader never sees half a file.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from renderer.errors import FieldProblem, ImageLibraryFull, InvalidRequest, MissingImage
from renderer.scene.bake import cache_directory
from renderer.scene.image_files import KINDS, ImageCaps, ImageKind, Pixels, image_size, read_image

IMAGE_ID = re.compile(r"[0-9a-f]{64}\Z")
BUDGET = 4 << 30
"""Bytes of all images together."""


class ImageReference(NamedTuple):
    """An image that a request names."""

    id: str
    kind: ImageKind


@dataclass(frozen=True)
class ImageCard:
    """What is known of a stored image."""

    id: str
    """SHA-256, 64 hex digits, of the kind, a zero byte and the file's bytes."""
    kind: ImageKind
    width: int
    """Pixels."""
    height: int
    """Pixels."""


class ImageLibrary:
    """Images in one directory, which need not exist yet. Holds nothing open; any number of processes may share it."""

    def __init__(self, directory: Path, caps: ImageCaps | None = None, budget: int = BUDGET) -> None:
        self.directory = directory
        self.caps = caps or ImageCaps()
        self.budget = budget

    def put(self, data: bytes, kind: str) -> ImageCard:
        """Check, decode and store a file; the same file of the same kind is the same image.

        Raises ``InvalidRequest`` for what is no such image, ``ImageLibraryFull`` where it can't be kept.
        """
        known = known_kind(kind)
        height, width = read_image(data, known, self.caps).shape[:2]
        card = ImageCard(image_id(data, known), known, width, height)
        if self._read(ImageReference(card.id, known)) is None:
            self._write(self._path(card.id, known), data)
        return card

    def kind_of(self, name: str) -> ImageKind | None:
        """The kind of a stored image, None for an id that is not here."""
        return next((kind for kind in KINDS if IMAGE_ID.match(name) and self._path(name, kind).is_file()), None)

    def card(self, name: str) -> ImageCard:
        """What is known of an image. Raises ``MissingImage``."""
        kind = self.kind_of(name)
        if kind is None:
            raise MissingImage(name)
        return ImageCard(name, kind, *image_size(self._sound(ImageReference(name, kind))))

    def load(self, reference: ImageReference) -> Pixels:
        """The pixels as ``read_image`` gives them. Raises ``MissingImage`` also for a file that is damaged."""
        return read_image(self._sound(reference), reference.kind, ImageCaps())

    def _sound(self, reference: ImageReference) -> bytes:
        data = self._read(reference)
        if data is None:
            raise MissingImage(reference.id, reference.kind)
        return data

    def _read(self, reference: ImageReference) -> bytes | None:
        try:
            data = self._path(*reference).read_bytes()
        except OSError:
            return None
        return data if image_id(data, reference.kind) == reference.id else None

    def _path(self, name: str, kind: ImageKind) -> Path:
        return self.directory / f"{name}.{kind}"

    def _used(self) -> int:
        """Bytes of all files; one that another process takes away meanwhile is none."""
        used = 0
        for path in self.directory.iterdir():
            with contextlib.suppress(FileNotFoundError):
                used += path.stat().st_size
        return used

    def _write(self, path: Path, data: bytes) -> None:
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            used = self._used()
            if used + len(data) > self.budget:
                raise ImageLibraryFull(
                    f"The images here have {used} bytes; with this one they would pass {self.budget}."
                )
            handle, temporary = tempfile.mkstemp(prefix=".image-", dir=self.directory)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(data)
                    file.flush()
                    os.fsync(file.fileno())
                Path(temporary).replace(path)
            except BaseException:
                Path(temporary).unlink(missing_ok=True)
                raise
        except OSError as error:
            raise ImageLibraryFull(f"The image can't be stored: {error.strerror or error}.") from error


def known_kind(kind: Any) -> ImageKind:
    """The kind of this name. Raises ``InvalidRequest``."""
    found = next((known for known in KINDS if known == kind), None)
    if found is None:
        raise InvalidRequest((FieldProblem("kind", "unknown kind of image", kind, "one of " + ", ".join(KINDS)),))
    return found


def image_id(data: bytes, kind: ImageKind) -> str:
    """The id of a file as an image of this kind."""
    return hashlib.sha256(kind.encode() + b"\0" + data).hexdigest()


def image_library(caps: ImageCaps | None = None, budget: int = BUDGET) -> ImageLibrary:
    """The library of this user."""
    return ImageLibrary(cache_directory() / "images", caps, budget)
