"""Image formats: one entry of FORMATS for each."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image

from renderer.encode.png import REQUEST_KEYWORD, encode_png, read_png_text
from renderer.errors import EncodeError

__all__ = [
    "FORMATS",
    "REQUEST_KEYWORD",
    "Format",
    "Picture",
    "encode_jpeg",
    "encode_png",
    "encode_webp",
    "encoder_versions",
    "read_png_text",
]

_JPEG_QUALITY = 90
_JPEG_FULL_CHROMA = 0
"""Pillow's name for 4:4:4. Half-size chroma saves 14 % and fringes reeds and stones against the sky."""
_WEBP_QUALITY = 90
_WEBP_METHOD = 2
"""31 ms of CPU for a 720p frame; the default, 4, takes 79 ms for the same size."""
_MAX_EXIF = 65_533 - len(b"Exif\0\0")
"""A JPEG segment holds 65,533 bytes; the same bound serves WebP."""
_LIBRARIES = ("av", "isal", "numpy", "pillow")


class Picture(Protocol):
    """What a format draws from: a frame, or anything that has its arrays."""

    @property
    def color(self) -> NDArray[np.uint8]:
        """(h, w, 3) RGB, sRGB-encoded, top row first."""

    @property
    def layers(self) -> Mapping[str, NDArray[Any]]:
        """Every layer asked for beyond the colour, (h, w) or (h, w, c), by name."""


@dataclass(frozen=True)
class Format:
    """An image file format and how to write it."""

    name: str
    media_type: str
    suffixes: tuple[str, ...]
    """Endings of file names and URLs, without the dot; the first is the one written."""
    bit_depth: int
    """Bits of one stored value."""
    encode: Callable[[Picture, bytes], bytes]
    """``encode(picture, request)``: the file's bytes; ``request`` is the canonical JSON that it carries, or empty."""


def encode_jpeg(image: NDArray[np.uint8], description: str = "") -> bytes:
    """A JPEG of quality 90 with full-size chroma; ``image`` is uint8 (h, w, 3).

    ``description`` is stored as EXIF ImageDescription, and left out where it is longer than a JPEG segment.
    """
    return _through_pillow(
        image, description, "JPEG", quality=_JPEG_QUALITY, subsampling=_JPEG_FULL_CHROMA, optimize=False
    )


def encode_webp(image: NDArray[np.uint8], description: str = "") -> bytes:
    """A lossy WebP of quality 90; ``image`` and ``description`` as for ``encode_jpeg``."""
    return _through_pillow(image, description, "WEBP", quality=_WEBP_QUALITY, method=_WEBP_METHOD)


@cache
def encoder_versions() -> dict[str, str]:
    """Versions of the libraries that decide an encoded file's bytes, for the fingerprint."""
    return {library: version(library) for library in _LIBRARIES}


def _through_pillow(image: NDArray[np.uint8], description: str, name: str, **options: int) -> bytes:
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size:
        raise EncodeError(f"a {name} is made from uint8 (h, w, 3), not from {image.dtype} {image.shape}")
    exif = Image.Exif()
    if description:
        exif[ExifTags.Base.ImageDescription] = description
    metadata = exif.tobytes()
    if not description or len(metadata) > _MAX_EXIF:
        metadata = b""
    file = io.BytesIO()
    try:
        Image.fromarray(image).save(file, name, exif=metadata, **options)
    except (OSError, ValueError) as error:  # a side longer than the format allows
        raise EncodeError(f"{name} cannot be written from {image.dtype} {image.shape}: {error}") from error
    return file.getvalue()


def _png(picture: Picture, request: bytes) -> bytes:
    return encode_png(picture.color, {REQUEST_KEYWORD: request.decode()} if request else {})


def _jpeg(picture: Picture, request: bytes) -> bytes:
    return encode_jpeg(picture.color, request.decode())


def _webp(picture: Picture, request: bytes) -> bytes:
    return encode_webp(picture.color, request.decode())


FORMATS: dict[str, Format] = {
    entry.name: entry
    for entry in (
        Format("png", "image/png", ("png",), 8, _png),
        Format("jpeg", "image/jpeg", ("jpg", "jpeg"), 8, _jpeg),
        Format("webp", "image/webp", ("webp",), 8, _webp),
    )
}
"""Every image format by its name in a request."""
