"""Image files from outside: checked, decoded and shaped for what they are meant for.

A file is taken by its signature, never by its name; its size is known before a pixel is decoded.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from PIL.ImageFile import ImageFile
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile
from PIL.WebPImagePlugin import WebPImageFile

from renderer.errors import FieldProblem, InvalidRequest

ImageKind = Literal["normal_map", "bias_map", "color_layer"]
KINDS: tuple[ImageKind, ...] = get_args(ImageKind)
Pixels = NDArray[Any]
"""Rows of pixels from the top, uint8 or uint16."""

LARGEST_SIDE = 8192
"""Pixels."""
STRAY = 0.01
"""Share of a normal map's pixels that may point into the water: a few don't make it another kind of image."""
_READERS: dict[str, Callable[[io.BytesIO], ImageFile]] = {
    "PNG": PngImageFile,  # not Image.open: it would judge the size by a bound of its own
    "JPEG": JpegImageFile,
    "WebP": WebPImageFile,
}
_MODES = {"1": "L", "L": "L", "LA": "LA", "P": "RGB", "PA": "RGBA", "RGB": "RGB", "RGBA": "RGBA", "I;16": "I;16"}
"""What an image of each mode is read as; others have no meaning here (CMYK, Lab)."""
_DAMAGE = (OSError, SyntaxError, ValueError, EOFError, LookupError, TypeError, OverflowError, struct.error, zlib.error)


@dataclass(frozen=True)
class ImageCaps:
    """What is read at most."""

    size: int = 64 << 20
    """Bytes of the file."""
    side: int = LARGEST_SIDE
    """Pixels of the longer side."""
    pixels: int = LARGEST_SIDE**2
    """Width times height."""


def refused(message: str, value: Any, bound: str) -> InvalidRequest:
    """The error that blames the file."""
    return InvalidRequest((FieldProblem("file", message, value, bound),))


def read_image(data: bytes, kind: ImageKind, caps: ImageCaps) -> Pixels:
    """The pixels of a file, (h, w, c): normal_map c = 3, bias_map c = 1, color_layer c = 4 of 8 bits, alpha straight.

    Raises ``InvalidRequest`` for what is no still PNG, JPEG or WebP within the caps, or no image of this kind.
    """
    if not data:
        raise refused("the file is empty", "0 bytes", "a PNG, JPEG or WebP image")
    if len(data) > caps.size:
        raise refused("the file is too large", f"{len(data)} bytes", f"<= {caps.size} bytes")
    return _as_kind(_decoded(data, caps), kind)


def image_size(data: bytes) -> tuple[int, int]:
    """Width and height by the head of a file that was read before."""
    width, height = _READERS[_format(data)](io.BytesIO(data)).size
    return width, height


def _format(data: bytes) -> str:
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return "PNG"
    if data.startswith(b"\xff\xd8\xff"):
        return "JPEG"
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return "WebP"
    raise refused("the file is neither PNG nor JPEG nor WebP", f"it begins with {data[:12]!r}", "PNG, JPEG or WebP")


def _decoded(data: bytes, caps: ImageCaps) -> Pixels:
    name = _format(data)
    try:
        image = _READERS[name](io.BytesIO(data))
        _refuse_past_caps(image, caps)
        if name == "PNG":
            _READERS[name](io.BytesIO(data)).verify()  # the checksums of all chunks, which decoding does not ask for
        image.load()
        if name == "PNG" and data[24] == 16:  # bits a channel, in the header: Pillow cuts colours to 8
            image.close()
            return _sixteen_bits(data)
        return _eight_bits(image)
    except InvalidRequest:
        raise
    except MemoryError:
        raise refused("the image needs more memory than there is", f"{len(data)} bytes", "a smaller image") from None
    except _DAMAGE as error:
        reason = str(error) or type(error).__name__
        raise refused(f"the {name} file is truncated or damaged", reason, f"a whole {name} file") from None


def _refuse_past_caps(image: ImageFile, caps: ImageCaps) -> None:
    width, height = image.size
    given = f"{width}×{height}"
    if max(width, height) > caps.side:
        raise refused("the image is too large", given, f"width and height <= {caps.side}")
    if width * height > caps.pixels:
        raise refused("the image is too large", given, f"width * height <= {caps.pixels}")
    frames = getattr(image, "n_frames", 1)
    if frames != 1:
        raise refused("the image is animated", f"{frames} frames", "one frame")
    if image.mode not in _MODES:
        raise refused("the image has colours of another space", image.mode, "grey, RGB or RGBA")


def _eight_bits(image: ImageFile) -> Pixels:
    mode = "RGBA" if image.has_transparency_data and image.mode != "LA" else _MODES[image.mode]
    pixels = np.asarray(image if image.mode == mode else image.convert(mode))
    return pixels.reshape(*pixels.shape[:2], -1)


def _sixteen_bits(data: bytes) -> NDArray[np.uint16]:
    """A PNG's samples, which the file holds big-endian; FFmpeg hands them on as they are."""
    import av  # noqa: PLC0415 -- 50 ms that only an image of 16 bits needs

    try:
        (frame,) = av.CodecContext.create("png", "r").decode(av.Packet(data))
    except av.FFmpegError as error:
        raise ValueError(str(error)) from None
    channels = {"gray16be": 1, "ya16be": 2, "rgb48be": 3, "rgba64be": 4}[frame.format.name]
    (plane,) = frame.planes
    rows = np.frombuffer(memoryview(plane), ">u2").reshape(frame.height, plane.line_size // 2)
    samples: NDArray[np.uint16] = rows[:, : frame.width * channels].astype(np.uint16)
    return samples.reshape(frame.height, frame.width, channels)


def _as_kind(pixels: Pixels, kind: ImageKind) -> Pixels:
    return {"normal_map": _normal_map, "bias_map": _bias_map, "color_layer": _color_layer}[kind](pixels)


def _normal_map(pixels: Pixels) -> Pixels:
    if pixels.shape[2] < 3:
        raise refused("a normal map has three channels", f"{pixels.shape[2]} channels", "an RGB image")
    flat = 128 if pixels.dtype == np.uint8 else 32768
    stray = float(np.mean(pixels[..., 2] <= flat))
    if stray > STRAY:
        message = "the image is no normal map: its normals don't point up, which blue above one half means"
        raise refused(message, f"blue <= {flat} in {stray:.1%} of the pixels", f"in at most {STRAY:.0%}")
    return np.ascontiguousarray(pixels[..., :3])


def _bias_map(pixels: Pixels) -> Pixels:
    if pixels.shape[2] >= 3:
        grey = pixels[..., :1]
        coloured = float(np.mean((pixels[..., 1:3] != grey).any(axis=2)))
        if coloured > 0:
            raise refused("a bias map is grey", f"colour in {coloured:.1%} of the pixels", "red = green = blue")
    return np.ascontiguousarray(pixels[..., :1])


def _color_layer(pixels: Pixels) -> NDArray[np.uint8]:
    if pixels.dtype == np.uint16:
        pixels = ((pixels.astype(np.uint32) + 128) // 257).astype(np.uint8)
    channels = pixels.shape[2]
    color = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    is_opaque = channels in {1, 3}
    alpha = np.full((*pixels.shape[:2], 1), 255, np.uint8) if is_opaque else pixels[..., -1:]
    return np.concatenate([color, alpha], axis=2).astype(np.uint8, copy=False)
