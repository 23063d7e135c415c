"""Images on their way to the service: whatever the caller has, as a file's bytes, in a form."""

from __future__ import annotations

import hashlib
import io
import os
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

ImageSource = str | os.PathLike[str] | bytes | Image.Image | NDArray[np.uint8] | NDArray[np.uint16]
"""A path, a file's bytes, a picture, or its pixels."""

_PNG_COLORS = {1: 0, 2: 4, 3: 2, 4: 6}
"""PNG's colour type by the number of channels (ISO/IEC 15948, section 11.2.2)."""


def file_bytes(source: ImageSource) -> bytes:
    """A file's bytes as they are, anything else as PNG. Raises TypeError for what is no image, OSError for no file."""
    if isinstance(source, bytes | bytearray | memoryview):
        return bytes(source)
    if isinstance(source, str | os.PathLike):
        return Path(source).read_bytes()
    if isinstance(source, Image.Image):
        file = io.BytesIO()
        source.save(file, "PNG")
        return file.getvalue()
    if isinstance(source, np.ndarray):
        return png_of(source)
    raise TypeError(f"an image is a path, bytes, a PIL image or an array, not {type(source).__name__}")


def png_of(pixels: NDArray[Any]) -> bytes:
    """An array of uint8 or uint16, (h, w) or (h, w, 1 to 4), as a PNG of as many bits (ISO/IEC 15948)."""
    array = pixels[..., None] if pixels.ndim == 2 else pixels
    if array.dtype not in (np.uint8, np.uint16) or array.ndim != 3 or array.shape[2] not in _PNG_COLORS:
        shape = f"{pixels.dtype} {pixels.shape}"
        raise TypeError(f"an image is an array of uint8 or uint16, (h, w) or (h, w, 1 to 4), not {shape}")
    height, width, channels = array.shape
    samples = array.astype(array.dtype.newbyteorder(">")).view(np.uint8).reshape(height, -1)
    rows = np.concatenate([np.zeros((height, 1), np.uint8), samples], axis=1)  # each begins with its filter: none
    head = struct.pack(">IIBBBBB", width, height, 8 * array.itemsize, _PNG_COLORS[channels], 0, 0, 0)
    chunks = (_chunk(b"IHDR", head), _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)), _chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def form(fields: Mapping[str, str], file: bytes) -> tuple[str, bytes]:
    """Content type and body of a form with these fields and one file (RFC 7578).

    Equal uploads are equal bytes: the boundary is the file's digest, which no file is known to hold itself.
    """
    boundary = f"millpond-{hashlib.sha256(file).hexdigest()}"
    parts = [
        f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n{value}\r\n'.encode()
        for name, value in fields.items()
    ]
    head = (
        f'--{boundary}\r\nContent-Disposition: form-data; name="file"; filename="image"\r\n'
        "Content-Type: application/octet-stream\r\n\r\n"
    )
    body = b"".join([*parts, head.encode(), file, f"\r\n--{boundary}--\r\n".encode()])
    return f"multipart/form-data; boundary={boundary}", body


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
