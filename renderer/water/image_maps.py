"""Users' images as the textures that water reads.

On the water an image lies as it is seen from above with north (−z) at the top: its columns run along +x and its rows
along +z. A normal map is a tangent-space map with green upwards (the convention of OpenGL: red is the normal's part
along +x, green its part along −z, blue its part along +y).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from renderer.scene.image_files import Pixels
from renderer.scene.images import IMAGE_ID, ImageLibrary, ImageReference, image_library
from renderer.scene.material import Texture
from renderer.units import linear_from_srgb

SIDE = 4096
"""Texels: a larger image is read at half its size or less. On a pond of 40 m a texel is then a centimetre."""
BAND = 256
"""Rows that are converted at a time, which bounds the memory of floats."""
LOWEST_UP = 0.1
"""The least of a normal's part along +y: slopes end at ±10."""
SCALED_OF_BYTE = np.array([65535 * linear_from_srgb(byte / 255) for byte in range(256)], np.float32)
"""sRGB bytes as linear fractions of 65535."""


def image_name(kind: str, built_in: tuple[str, ...]) -> AfterValidator:
    """The check that a text is one of these names, or may be the id of an image of this kind."""

    def check(name: str) -> str:
        if name not in built_in and not IMAGE_ID.match(name):
            bound = " or ".join([*map(repr, built_in), f"the id of an uploaded {kind} (64 hex digits)"])
            raise PydanticCustomError("image_name", "no image has this name", {"bound": bound})
        return name

    return AfterValidator(check)


def image_texture(reference: ImageReference) -> Texture:
    """The texture of an image in this user's library. Raises ``MissingImage``."""
    return _kept(image_library().directory, reference)


@lru_cache(maxsize=4)
def _kept(directory: Path, reference: ImageReference) -> Texture:
    pixels = ImageLibrary(directory).load(reference)
    name = f"{reference.kind} {reference.id}"
    if reference.kind == "normal_map":
        return Texture(name, _converted(pixels, slopes_of_normals))
    if reference.kind == "bias_map":
        return Texture(name, _converted(pixels, _as_it_is), wrap="clamp")
    return Texture(name, _converted(pixels, premultiplied))


def slopes_of_normals(pixels: Pixels) -> NDArray[np.float32]:
    """The slopes (dy/dx, dy/dz) that the normals (h, w, 3) of a tangent-space map mean.

    The middle is 128 of 8 bits and 32768 of 16, so that a map painted flat has slopes of exactly zero; a decoding by
    2c − 1 leaves 0.004 there, with which the whole picture would shift. The mean of the map is kept.
    """
    middle, reach = (128, 127) if pixels.dtype == np.uint8 else (32768, 32767)
    red, green, blue = (pixels[..., channel].astype(np.float32) - middle for channel in range(3))
    up = np.maximum(blue, np.float32(LOWEST_UP * reach))
    # Green points to the image's top, which is −z: a normal (x, y, z) = (r, b, −g) has the slopes −x/y and −z/y.
    return np.stack([0 - red / up, green / up], axis=-1)


def premultiplied(pixels: NDArray[Any]) -> NDArray[np.uint16]:
    """Linear colour times alpha, and alpha, as 16-bit fractions, which may be averaged. From sRGB bytes (h, w, 4)."""
    alpha = pixels[..., 3].astype(np.float32) * np.float32(1 / 255)
    made = np.empty(pixels.shape, np.uint16)
    for channel in range(3):
        made[..., channel] = np.rint(SCALED_OF_BYTE[pixels[..., channel]] * alpha)
    made[..., 3] = pixels[..., 3].astype(np.uint16) * 257
    return made


def _as_it_is(pixels: NDArray[Any]) -> NDArray[Any]:
    return pixels


def _converted(pixels: NDArray[Any], convert: Callable[[NDArray[Any]], NDArray[Any]]) -> NDArray[Any]:
    """The image band by band, brought down to at most ``SIDE`` texels a side by the mean of whole blocks."""
    step = -(-max(pixels.shape[:2]) // SIDE)
    if step > min(pixels.shape[:2]):  # a strip one texel high can't be halved both ways
        step = 1
    rows = pixels.shape[0] // step * step
    bands = [_shrunk(convert(pixels[top : min(top + BAND * step, rows)]), step) for top in range(0, rows, BAND * step)]
    return np.concatenate(bands)


def _shrunk(image: NDArray[Any], step: int) -> NDArray[Any]:
    if step == 1:
        return image
    height, width = image.shape[0] // step, image.shape[1] // step
    total = np.zeros((height, width, image.shape[2]), np.float32 if image.dtype == np.float32 else np.uint32)
    for row in range(step):
        for column in range(step):
            total += image[row : height * step : step, column : width * step : step]
    mean = total / np.float32(step * step)
    return np.asarray(mean if image.dtype == np.float32 else np.rint(mean).astype(image.dtype))
