"""Movies: frames in, one at a time; a complete file out. One entry of MOVIES for each container.

The same frames give the same bytes with the same libraries: one encoder thread (the decisions of x264 and VP9
depend on how many there are), no macroblock tree in x264 (with AVX-512 one file in four differed from the others:
6 frames of 161 x 121, 100 times), no dates and no random identifiers in the container.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

import av
import numpy as np
from av.container import OutputContainer
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc, Interpolation
from av.video.stream import VideoStream
from numpy.typing import NDArray

from renderer.encode.verify import MovieFacts, frame_rate, movie_size, verify_movie
from renderer.errors import EncodeError

__all__ = ["MOVIES", "MovieFacts", "MovieFormat", "MovieWriter", "movie_size", "verify_movie"]

_RESAMPLING = Interpolation.AREA | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INP | Interpolation.BITEXACT
"""Chroma is the rounded mean of its four pixels: within 3/255 after a round trip, 2.4 ms for a 720p frame."""


@dataclass(frozen=True)
class MovieFormat:
    """A movie file format and how to write it."""

    name: str
    media_type: str
    suffixes: tuple[str, ...]
    """Endings of file names and URLs, without the dot; the first is the one written."""
    codec: str
    """FFmpeg's name of the encoder."""
    codec_options: Mapping[str, str] = field(default_factory=dict)
    container_options: Mapping[str, str] = field(default_factory=dict)
    pixel_format: str = "yuv420p"


MOVIES: dict[str, MovieFormat] = {
    entry.name: entry
    for entry in (
        MovieFormat(
            name="mp4",
            media_type="video/mp4",
            suffixes=("mp4",),
            codec="libx264",
            # Without the macroblock tree, 20 gives the size and error that 18 gives with it.
            codec_options={"crf": "20", "preset": "faster", "x264-params": "mbtree=0"},
            # The index stands in front, so that a browser plays before it has the whole file.
            container_options={"movflags": "+faststart"},
        ),
        MovieFormat(
            name="webm",
            media_type="video/webm",
            suffixes=("webm",),
            codec="libvpx-vp9",
            codec_options={"crf": "24", "b": "0", "deadline": "good", "cpu-used": "4"},
        ),
    )
}
"""Every movie format by its name in a request."""


class MovieWriter:
    """Writes a movie of constant frame rate; holds one frame at a time.

    ``target`` is a path, or a writable binary file that need not be seekable: it gets the whole movie on close,
    because the index in front of an MP4 is known only then. Sides are made even by repeating the last column
    or row (4:2:0 stores one colour for four pixels, and cropping would lose a line of the picture).
    sRGB-encoded RGB is stored as BT.709 of limited range and tagged so.

    Leaving the ``with`` block by an exception removes what was written to a path and gives nothing to a file.

    Raises EncodeError for a frame of another size or type, a movie without frames, and where FFmpeg fails.
    """

    def __init__(
        self,
        target: str | os.PathLike[str] | BinaryIO,
        width: int,
        height: int,
        fps: float | Fraction,
        container: str = "mp4",
    ) -> None:
        if container not in MOVIES:
            raise EncodeError(f"there is no movie format {container!r}; there are {', '.join(MOVIES)}")
        self._format = MOVIES[container]
        self._shape = (height, width, 3)
        self._rate = frame_rate(fps)
        self._frames = 0
        self._is_closed = False
        self._file = None if isinstance(target, str | os.PathLike) else target
        self._path = Path(target) if isinstance(target, str | os.PathLike) else _temporary_path()
        self._container: OutputContainer | None = None
        try:
            self._path.open("wb").close()  # FFmpeg opens it with the first packet; a bad path is better known now
            self._container = av.open(
                str(self._path),
                "w",
                format=container,
                options={"fflags": "+bitexact", **self._format.container_options},
            )
            self._stream = self._open_stream(self._container)
        except (OSError, ValueError) as error:
            self._discard()
            raise EncodeError(
                f"cannot write a {container} of {width} x {height} pixels, {fps} frames per second: {error}"
            ) from error

    @property
    def frames(self) -> int:
        """How many frames were added."""
        return self._frames

    def add(self, rgb: NDArray[np.uint8]) -> None:
        """Append one frame: uint8 (height, width, 3), sRGB-encoded, top row first."""
        if rgb.shape != self._shape or rgb.dtype != np.uint8:
            raise EncodeError(
                f"frame {self._frames} is {rgb.dtype} {rgb.shape}; the movie's frames are uint8 {self._shape}"
            )
        height, width, _ = rgb.shape
        even = np.pad(rgb, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24").reformat(
            format=self._format.pixel_format,
            dst_colorspace=Colorspace.ITU709,
            src_color_range=ColorRange.JPEG,
            dst_color_range=ColorRange.MPEG,
            interpolation=_RESAMPLING,
            threads=1,
        )
        frame.pts, frame.time_base = self._frames, 1 / self._rate
        self._encode(frame)
        self._frames += 1

    def close(self) -> None:
        """Write what the encoder still holds and the index; the file is complete after this."""
        if self._is_closed:
            return
        if not self._frames:
            self._discard()
            raise EncodeError("a movie needs at least one frame")
        try:
            self._encode(None)
            if self._container is not None:
                self._container.close()
            self._is_closed = True
            if self._file is not None:
                with self._path.open("rb") as finished:
                    shutil.copyfileobj(finished, self._file)
                self._path.unlink()
        except (OSError, ValueError) as error:
            self._discard()
            raise EncodeError(
                f"the {self._format.name} could not be finished after {self._frames} frames: {error}"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self._discard()

    def _open_stream(self, container: OutputContainer) -> VideoStream:
        height, width, _ = self._shape
        stream = container.add_stream(self._format.codec, rate=self._rate, options=dict(self._format.codec_options))
        if not isinstance(stream, VideoStream):
            raise TypeError(f"{self._format.codec} is no video encoder")
        stream.width, stream.height = movie_size(width, height)
        stream.pix_fmt = self._format.pixel_format
        codec = stream.codec_context
        codec.thread_count = 1
        codec.time_base = 1 / self._rate
        codec.color_range = ColorRange.MPEG
        codec.colorspace = Colorspace.ITU709
        codec.color_primaries = ColorPrimaries.BT709
        codec.color_trc = ColorTrc.BT709
        codec.open()
        return stream

    def _encode(self, frame: av.VideoFrame | None) -> None:
        if self._is_closed or self._container is None:
            raise EncodeError("the movie is already closed")
        try:
            self._container.mux(self._stream.encode(frame))
        except (OSError, ValueError) as error:
            raise EncodeError(f"the encoder failed at frame {self._frames}: {error}") from error

    def _discard(self) -> None:
        self._is_closed = True
        if self._container is not None:
            with contextlib.suppress(OSError, ValueError):  # the file goes; another exception is on its way
                self._container.close()
        self._path.unlink(missing_ok=True)


def _temporary_path() -> Path:
    handle, name = tempfile.mkstemp(prefix="millpond-", suffix=".movie")
    os.close(handle)
    return Path(name)
