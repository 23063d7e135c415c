"""Image files to upload, sound ones and others."""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image


def file_of(pixels: ArrayLike, form: str = "PNG", **options: Any) -> bytes:
    """Pixels as a file of 8 bits (or grey of 16), written by Pillow."""
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels)).save(file, form, **options)
    return file.getvalue()


def png_of_sixteen_bits(pixels: NDArray[np.uint16]) -> bytes:
    """Pixels (h, w, 1 to 4) as a PNG of 16 bits, which Pillow does not write in colour."""
    height, width, channels = pixels.shape
    color = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in pixels)
    return png(struct.pack(">IIBBBBB", width, height, 16, color, 0, 0, 0), zlib.compress(rows))


def png(head: bytes, data: bytes) -> bytes:
    """A PNG of these contents of its first and its image chunk."""
    chunks = ((b"IHDR", head), (b"IDAT", data), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body)) for name, body in chunks
    )


def even(*color: int, size: tuple[int, int] = (8, 8), dtype: Any = np.uint8) -> NDArray[Any]:
    """An image (h, w, c) of one colour."""
    return np.broadcast_to(np.array(color, dtype), (*size, len(color))).copy()


def painted(seed: int = 3, size: tuple[int, int] = (24, 32), channels: int = 4) -> NDArray[np.uint8]:
    """Random pixels."""
    return np.random.default_rng(seed).integers(0, 256, (*size, channels), dtype=np.uint8)
