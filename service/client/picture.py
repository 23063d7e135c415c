"""What comes back: pictures, frames with their provenance, and movies."""

from __future__ import annotations

import base64
import io
import json
import os
import re
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from .errors import MillpondError
from .exchange import Reply

_KEYWORD = "millpond"
"""Of the PNG text chunk that carries a frame's request."""
_EXIF_DESCRIPTION = 0x010E
"""Where JPEG and WebP carry it."""
_STAGE = re.compile(r"([\w.-]+)\s*;(?:[^,]*;)?\s*dur\s*=\s*([0-9.]+)")
"""One metric of a Server-Timing header that has a duration."""


class Picture:
    """An image file, and what is in it."""

    def __init__(self, data: bytes, media_type: str = "image/png") -> None:
        self.data = data
        """The file's bytes, as the service sent them."""
        self.media_type = media_type

    @cached_property
    def image(self) -> Image.Image:
        """As a Pillow image. Raises MillpondError for a format that Pillow does not read."""
        try:
            image = Image.open(io.BytesIO(self.data))
            image.load()
        except (UnidentifiedImageError, OSError) as error:
            raise MillpondError(f"Pillow cannot read this {self.media_type}: {error}") from error
        return image

    @property
    def array(self) -> NDArray[np.uint8]:
        """Pixels as uint8 (height, width, 3): sRGB-encoded RGB, top row first; a copy that may be written to."""
        return np.array(self.image.convert("RGB"))

    @property
    def width(self) -> int:
        """Pixels."""
        return self.image.width

    @property
    def height(self) -> int:
        """Pixels."""
        return self.image.height

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the file's bytes unchanged; the path."""
        Path(path).write_bytes(self.data)
        return Path(path)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:  # noqa: FBT001 -- NumPy's protocol
        return np.array(self.array, dtype=dtype, copy=copy)

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        if self.media_type == "image/png":
            return self.data
        file = io.BytesIO()
        self.image.convert("RGB").save(file, "PNG", compress_level=1)
        return file.getvalue()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.media_type}, {len(self.data)} bytes>"


class Frame(Picture):
    """A frame and where it came from."""

    def __init__(self, data: bytes, headers: Mapping[str, str]) -> None:
        super().__init__(data, headers.get("content-type", "image/png").partition(";")[0].strip())
        self.headers = headers
        """The answer's headers, names in lower case."""

    @classmethod
    def of(cls, reply: Reply) -> Frame:
        """The frame that an answer holds."""
        return cls(reply.body, reply.headers)

    @property
    def key(self) -> str | None:
        """The frame's key: equal keys and fingerprints mean equal bytes."""
        return self.headers.get("x-frame-key")

    @property
    def fingerprint(self) -> str | None:
        """What else decides the bits: driver, processor, encoders."""
        return self.headers.get("x-fingerprint")

    @property
    def renderer(self) -> str | None:
        """The driver that drew it."""
        return self.headers.get("x-renderer")

    @property
    def url(self) -> str | None:
        """Path and query, on the service, that show the same frame by GET."""
        return self.headers.get("content-location")

    @property
    def timings(self) -> dict[str, float]:
        """Seconds of each stage: ``queue``, ``render``, ``encode``; zeros where the frame was there already."""
        header = self.headers.get("server-timing", "")
        return {name: float(milliseconds) / 1e3 for name, milliseconds in _STAGE.findall(header)}

    @cached_property
    def request(self) -> dict[str, Any] | None:
        """The resolved request that the file itself carries, or None where it carries none."""
        text = getattr(self.image, "text", {}).get(_KEYWORD) or self.image.getexif().get(_EXIF_DESCRIPTION)
        if not text:
            return None
        try:
            request = json.loads(text)
        except ValueError as error:
            raise MillpondError(f"the request in the image is damaged: {error}") from error
        return request if isinstance(request, dict) else None

    def __repr__(self) -> str:
        return f"<Frame {(self.key or 'without key')[:12]} {self.media_type}, {len(self.data)} bytes>"


class Movie:
    """A product of several frames: a movie, or an archive of images."""

    def __init__(self, data: bytes, media_type: str) -> None:
        self.data = data
        """The file's bytes."""
        self.media_type = media_type

    @classmethod
    def of(cls, reply: Reply) -> Movie:
        """The product that an answer holds."""
        return cls(reply.body, reply.headers.get("content-type", "application/octet-stream").partition(";")[0])

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the file; its path."""
        Path(path).write_bytes(self.data)
        return Path(path)

    def _repr_html_(self) -> str | None:
        """What a notebook shows: a player for a movie."""
        if not self.media_type.startswith("video/"):
            return None
        content = base64.b64encode(self.data).decode()
        return f'<video controls loop src="data:{self.media_type};base64,{content}"></video>'

    def __repr__(self) -> str:
        return f"<Movie {self.media_type}, {len(self.data)} bytes>"
