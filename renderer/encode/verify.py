"""What a movie file really holds: found by decoding every frame of it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av

from renderer.errors import EncodeError

_MAX_DENOMINATOR = 1001
"""Of a frame rate: 30000/1001 is the usual broadcast rate."""
_RATE_TOLERANCE = Fraction(1, 1000)
"""Part of the frame rate by which a container's own statement may miss it: WebM's clock ticks in milliseconds."""


@dataclass(frozen=True)
class MovieFacts:
    """What was found in a movie by decoding every frame of it."""

    frames: int
    fps: Fraction
    width: int
    height: int
    """Size in pixels as stored: even, see ``movie_size``."""
    seconds: float
    codec: str


def movie_size(width: int, height: int) -> tuple[int, int]:
    """(width, height) of a movie made from frames of this size, in pixels: each side rounded up to even."""
    return width + width % 2, height + height % 2


def frame_rate(fps: float | Fraction) -> Fraction:
    """Frames per second as the fraction that containers store; raises EncodeError where it is no rate."""
    try:
        rate = Fraction(fps).limit_denominator(_MAX_DENOMINATOR)
    except (ValueError, OverflowError) as error:
        raise EncodeError(f"{fps} frames per second is no frame rate") from error
    if rate <= 0:
        raise EncodeError(f"{fps} frames per second is no frame rate")
    return rate


def verify_movie(
    path: str | os.PathLike[str], frames: int, fps: float | Fraction, width: int, height: int
) -> MovieFacts:
    """Decode a whole movie and compare it with what was asked for; ``width`` and ``height`` are its frames'.

    Every frame must decode without a repaired or missing part and stand at index / fps seconds (within one
    tick of the container's clock). H.264 in MP4 shows nine of ten flipped bits; VP9 carries no checksum, so a
    damaged but decodable WebM passes. Raises EncodeError that names the expected and the found.
    """
    rate = frame_rate(fps)
    name = Path(path).name
    found = _decoded(Path(path), frames)
    problems = list(found.damage)
    if len(found.stamps) != frames:
        problems.append(f"{len(found.stamps)} frames, expected {frames}")
    if (found.width, found.height) != movie_size(width, height):
        expected = " x ".join(map(str, movie_size(width, height)))
        problems.append(f"{found.width} x {found.height} pixels, expected {expected}")
    if abs(found.rate - rate) > rate * _RATE_TOLERANCE:
        problems.append(f"{float(found.rate):g} frames per second, expected {float(rate):g}")
    for index, stamp in enumerate(found.stamps):
        if abs(stamp - index / rate) > found.tick:
            problems.append(f"frame {index} at {float(stamp):.4f} s, expected {float(index / rate):.4f} s")
            break
    if problems:
        raise EncodeError(f"{name} is not the movie asked for: {'; '.join(problems)}")
    return MovieFacts(frames, rate, found.width, found.height, float(frames / rate), found.codec)


@dataclass(frozen=True)
class _Decoded:
    width: int
    height: int
    rate: Fraction
    tick: Fraction
    """Seconds."""
    codec: str
    stamps: list[Fraction]
    """Seconds at which each frame is shown."""
    damage: list[str]


def _decoded(path: Path, expected: int) -> _Decoded:
    stamps: list[Fraction] = []
    damage: list[str] = []
    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise EncodeError(f"{path.name} holds no video")
            stream = container.streams.video[0]
            stream.codec_context.options = {"err_detect": "explode"}
            tick = stream.time_base or Fraction(1, 1000)
            for frame in container.decode(stream):
                if frame.is_corrupt:
                    damage.append(f"frame {len(stamps)} is damaged")
                if frame.pts is None:
                    damage.append(f"frame {len(stamps)} has no time")
                stamps.append((frame.pts or 0) * tick)
            rate = Fraction(stream.average_rate or 0)
            codec = stream.codec_context.name
            return _Decoded(stream.width, stream.height, rate, tick, codec, stamps, damage)
    except (OSError, ValueError) as error:
        raise EncodeError(f"{path.name} cannot be decoded after {len(stamps)} of {expected} frames: {error}") from error
