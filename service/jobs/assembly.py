"""Products of frames: archives, movies, contact sheets, manifests. Made of verified frames, and verified themselves.

Each is a pure function of its frames: no dates, no ids, so that equal jobs have equal products.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from renderer.camera import Camera
from renderer.encode.image import FORMATS, encode_png
from renderer.encode.movie import MOVIES, MovieWriter
from renderer.encode.sheet import contact_sheet, evenly_spaced
from renderer.encode.verify import MovieFacts, verify_movie
from renderer.errors import EncodeError
from renderer.request import FrameRequest
from service.frames import StoredFrame

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest date that an archive can hold, and the date of every member."""
MANIFEST = "manifest.json"
_OPENCV_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""Camera axes x right, y down, z forward from x right, y up, z back; its own inverse."""


@dataclass(frozen=True)
class Member:
    """A frame of a product."""

    index: int
    request: FrameRequest
    key: str
    digest: str
    fingerprint: str

    @property
    def file_name(self) -> str:
        """Its name in an archive."""
        return frame_name(self.index, FORMATS[self.request.format].suffixes[0])


def frame_name(index: int, suffix: str) -> str:
    """The name of a frame's file: eight digits sort rightly in every tool."""
    return f"frame_{index:08d}.{suffix}"


# ---------------------------------------------------------------------------------------------------- archives


class _Tail(io.BytesIO):
    """A file of which only the end is at hand: what was drained is gone, positions go on counting."""

    def __init__(self) -> None:
        super().__init__()
        self._drained = 0

    def tell(self) -> int:
        return self._drained + super().tell()

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        start = offset - self._drained if whence == io.SEEK_SET else offset
        return self._drained + super().seek(start, whence)

    def drain(self) -> bytes:
        data = self.getvalue()
        self._drained += len(data)
        super().seek(0)
        self.truncate()
        return data


class Archive:
    """An archive that is written as it grows: stored members, sizes in front, dates of 1980."""

    def __init__(self) -> None:
        self._tail = _Tail()
        self._zip = zipfile.ZipFile(self._tail, "w", zipfile.ZIP_STORED)

    def add(self, name: str, data: bytes) -> bytes:
        """Append a member; returns the archive's next bytes."""
        info = zipfile.ZipInfo(name, EPOCH)
        info.external_attr = 0o644 << 16
        self._zip.writestr(info, data)
        return self._tail.drain()

    def finish(self) -> bytes:
        """The archive's last bytes."""
        self._zip.close()
        return self._tail.drain()


async def zip_stream(frames: AsyncIterator[StoredFrame], suffix: str) -> AsyncGenerator[bytes, None]:
    """An archive of frames in their order, with a manifest of their identities at its end."""
    archive = Archive()
    identities: list[dict[str, Any]] = []
    async for frame in frames:
        name = frame_name(len(identities), suffix)
        identities.append(_identity(len(identities), name, frame.key, frame.digest, frame.fingerprint))
        yield archive.add(name, frame.data)
    yield archive.add(MANIFEST, _json({"frames": identities})) + archive.finish()


def write_zip(path: Path, members: Sequence[Member], read: Callable[[Member], bytes], manifest: bytes) -> None:
    """An archive of frames and their manifest, written and read back. Raises ``EncodeError``."""
    archive = Archive()
    with path.open("wb") as file:
        for member in members:
            file.write(archive.add(member.file_name, read(member)))
        file.write(archive.add(MANIFEST, manifest) + archive.finish())
    with zipfile.ZipFile(path) as written:
        damaged = written.testzip()
        if damaged is not None or len(written.namelist()) != len(members) + 1:
            raise EncodeError(f"the archive holds {len(written.namelist())} members; damaged: {damaged}")


# ------------------------------------------------------------------------------------------------------- pictures


def write_movie(
    path: Path,
    frames: Iterable[bytes],
    *,
    width: int,
    height: int,
    fps: float,
    count: int,
) -> MovieFacts:
    """A movie of encoded frames, then decoded and compared with ``count``. Raises ``EncodeError``.

    The path's suffix says the container; without one of ``MOVIES`` it is MP4.
    """
    suffix = path.suffix.removeprefix(".")
    container = suffix if suffix in MOVIES else "mp4"
    with MovieWriter(path, width, height, fps, container) as movie:
        for data in frames:
            movie.add(pixels_of(data))
    return verify_movie(path, count, fps, width, height)


def sheet_of(members: Sequence[Member], read: Callable[[Member], bytes]) -> bytes:
    """A contact sheet of some of the frames, evenly spaced, as PNG."""
    shown = [members[place] for place in evenly_spaced(len(members))]
    images = [pixels_of(read(member)) for member in shown]
    times = [member.request.time for member in shown]
    return encode_png(contact_sheet(images, indices=[member.index for member in shown], times=times), {})


def pixels_of(data: bytes) -> NDArray[np.uint8]:
    """An encoded frame's pixels, uint8 (h, w, 3). Raises ``EncodeError``."""
    try:
        with Image.open(io.BytesIO(data)) as image:
            return np.asarray(image.convert("RGB"))
    except (UnidentifiedImageError, OSError, SyntaxError) as error:
        raise EncodeError(f"a frame can't be read back: {error}") from error


# ------------------------------------------------------------------------------------------------------ manifests


def manifest_of(spec: dict[str, Any], members: Iterable[Member]) -> bytes:
    """Every frame's request, key, digest, fingerprint and camera, as JSON."""
    return _json({"conventions": _CONVENTIONS, "job": spec, "frames": list(_described(members))})


_CONVENTIONS = {
    "world": "right-handed, +y up, metres",
    "world_from_camera_opengl": "camera axes x right, y up, z back; row-major",
    "world_from_camera_opencv": "camera axes x right, y down, z forward; row-major",
    "intrinsics": "pixels, origin top left, centres at +0.5",
}


def _described(members: Iterable[Member]) -> Iterator[dict[str, Any]]:
    for member in members:
        yield {
            **_identity(member.index, member.file_name, member.key, member.digest, member.fingerprint),
            "camera": _camera(member.request.view()),
            "request": json.loads(member.request.canonical()),
        }


def _identity(index: int, name: str, key: str, digest: str, fingerprint: str) -> dict[str, Any]:
    return {"index": index, "file": name, "key": key, "digest": digest, "fingerprint": fingerprint}


def _camera(camera: Camera) -> dict[str, Any]:
    pose = camera.world_from_camera
    return {
        "width": camera.width,
        "height": camera.height,
        "is_orthographic": camera.lens.is_orthographic,
        "intrinsics": camera.lens.intrinsics.tolist(),
        "world_from_camera_opengl": pose.tolist(),
        "world_from_camera_opencv": (pose @ _OPENCV_FROM_OPENGL).tolist(),
    }


def _json(value: Any) -> bytes:
    return json.dumps(value, indent=1, sort_keys=True).encode()
