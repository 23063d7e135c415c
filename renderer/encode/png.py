"""PNG in about eight milliseconds a 720p frame, and its text chunks read with suspicion.

One filter for every row (Sub: each byte minus the byte one pixel to its left) is a single NumPy subtraction,
and level 1 of isal compresses what is left. Choosing a filter per row, or Paeth, gained nothing on frames of
water.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from renderer.errors import EncodeError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
REQUEST_KEYWORD = "millpond"
"""Keyword of the text chunk that carries a frame's canonical request."""

_COMPRESSION = 1
"""isal's level: 2 and 3 gave the same size, within 1 %, for up to 1 ms more."""
_SUB = 1
_COLOR_TYPE = {1: 0, 3: 2}
"""PNG's number for grey and RGB, by channels."""
_PERCEPTUAL = 0
_GAMMA = 45455
"""1/2.2 in units of 1/100000: the fall-back for readers that do not know the sRGB chunk."""
_MAX_SIDE = 2**31 - 1

_MAX_KEYWORD = 79
_MAX_TEXT = 1 << 20
"""Bytes of one text chunk that are read; a canonical request takes one to three thousand."""
_MAX_CHUNKS = 1 << 16
_HEADER_SIZE, _CHECKSUM_SIZE = 8, 4


def encode_png(image: NDArray[np.uint8], text: Mapping[str, str] | None = None) -> bytes:
    """An 8-bit PNG file, tagged sRGB; the same input gives the same bytes on one kind of CPU.

    ``image`` is (h, w, 3) RGB, or (h, w) or (h, w, 1) grey, top row first. Each item of ``text`` becomes one
    tEXt chunk; keywords and values are ASCII.

    Raises EncodeError for another shape or type, and for text that a tEXt chunk cannot hold.
    Source: W3C 2025 (PNG, third edition), sections 9.2 (Sub) and 11 (chunks).
    """
    pixels = _pixels(image)
    height, width, channels = pixels.shape
    header = struct.pack(">IIBBBBB", width, height, 8, _COLOR_TYPE[channels], 0, 0, 0)
    return b"".join(
        (
            SIGNATURE,
            *_chunk(b"IHDR", header),
            *_chunk(b"sRGB", bytes([_PERCEPTUAL])),
            *_chunk(b"gAMA", struct.pack(">I", _GAMMA)),
            *(part for item in (text or {}).items() for part in _chunk(b"tEXt", _text(*item))),
            *_chunk(b"IDAT", isal_zlib.compress(_sub_filtered(pixels), _COMPRESSION)),
            *_chunk(b"IEND", b""),
        )
    )


def read_png_text(data: bytes) -> dict[str, str]:
    """The uncompressed text chunks (tEXt) of a PNG file: value by keyword.

    Made for files from strangers: every chunk up to the end of the image must lie within the data and match
    its checksum; the number of chunks and the size of a text are bounded; nothing is decompressed.

    Raises EncodeError that says what is wrong, and at which byte.
    """
    texts: dict[str, str] = {}
    for kind, body, offset in _chunks(data):
        if kind != b"tEXt":
            continue
        if len(body) > _MAX_TEXT:
            raise EncodeError(
                f"the PNG text chunk at byte {offset} has {len(body)} bytes; at most {_MAX_TEXT} are read"
            )
        keyword, separator, value = bytes(body).partition(b"\0")
        if not separator or not 0 < len(keyword) <= _MAX_KEYWORD:
            raise EncodeError(f"the PNG text chunk at byte {offset} has no keyword of 1 to {_MAX_KEYWORD} bytes")
        name = keyword.decode("latin-1")
        if name in texts:
            raise EncodeError(f"the PNG text chunk at byte {offset} repeats the keyword {name!r}")
        texts[name] = value.decode("latin-1")
    return texts


def _pixels(image: NDArray[Any]) -> NDArray[np.uint8]:
    """``image`` as contiguous (h, w, 1 or 3) bytes."""
    shaped = image[:, :, np.newaxis] if image.ndim == 2 else image
    fits = shaped.ndim == 3 and shaped.shape[2] in _COLOR_TYPE and shaped.size > 0
    if not fits or image.dtype != np.uint8 or max(shaped.shape) > _MAX_SIDE:
        raise EncodeError(f"a PNG is made from uint8 (h, w, 3) or (h, w), not from {image.dtype} {image.shape}")
    return np.ascontiguousarray(shaped)


def _sub_filtered(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(h, 1 + w * channels) bytes: each row is its filter's number, then differences modulo 256."""
    height, width, channels = pixels.shape
    rows = pixels.reshape(height, width * channels)
    filtered = np.empty((height, 1 + width * channels), np.uint8)
    filtered[:, 0] = _SUB
    filtered[:, 1 : 1 + channels] = rows[:, :channels]
    np.subtract(rows[:, channels:], rows[:, :-channels], out=filtered[:, 1 + channels :])
    return filtered


def _chunk(kind: bytes, body: bytes) -> tuple[bytes, bytes, bytes, bytes]:
    """A chunk in its four parts; isal's checksum of a megabyte takes 10 µs, zlib's 200."""
    checksum = isal_zlib.crc32(body, isal_zlib.crc32(kind))
    return struct.pack(">I", len(body)), kind, body, struct.pack(">I", checksum)


def _text(keyword: str, value: str) -> bytes:
    """Body of a tEXt chunk."""
    trimmed = keyword.strip(" ") == keyword and "  " not in keyword
    if not (trimmed and 0 < len(keyword) <= _MAX_KEYWORD and keyword.isascii() and keyword.isprintable()):
        raise EncodeError(
            f"{keyword!r} is no PNG keyword: 1 to {_MAX_KEYWORD} printable ASCII letters, single spaces inside"
        )
    if not value.isascii() or "\0" in value or len(keyword) + 1 + len(value) > _MAX_TEXT:
        raise EncodeError(
            f"the text of PNG keyword {keyword!r} must be ASCII without NUL and shorter than {_MAX_TEXT} bytes"
        )
    return f"{keyword}\0{value}".encode("ascii")


def _chunks(data: bytes) -> Iterator[tuple[bytes, memoryview, int]]:
    """Kind, body and offset of each chunk before IEND; raises EncodeError where the file is damaged."""
    if not data.startswith(SIGNATURE):
        raise EncodeError(f"not a PNG file: its {len(data)} bytes do not begin with the signature")
    view = memoryview(data)
    offset = len(SIGNATURE)
    for _ in range(_MAX_CHUNKS):
        if offset + _HEADER_SIZE + _CHECKSUM_SIZE > len(data):
            raise EncodeError(f"the PNG file ends at byte {len(data)} without its last chunk (IEND)")
        length, kind = struct.unpack_from(">I4s", data, offset)
        end = offset + _HEADER_SIZE + length
        if end + _CHECKSUM_SIZE > len(data):
            raise EncodeError(
                f"PNG chunk {kind!r} at byte {offset} claims {length} bytes; the file ends at {len(data)}"
            )
        (checksum,) = struct.unpack_from(">I", data, end)
        if checksum != isal_zlib.crc32(view[offset + 4 : end]):
            raise EncodeError(f"PNG chunk {kind!r} at byte {offset} is damaged: its checksum does not match")
        if kind == b"IEND":
            return
        yield kind, view[offset + _HEADER_SIZE : end], offset
        offset = end + _CHECKSUM_SIZE
    raise EncodeError(f"the PNG file has more than {_MAX_CHUNKS} chunks")
