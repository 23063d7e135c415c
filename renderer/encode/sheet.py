"""Contact sheets: a job at a glance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from renderer.errors import EncodeError

SHEET_FRAMES = 24
"""How many frames a contact sheet shows."""

_BACKGROUND = (38, 39, 41)
"""A dark grey without hue, so that it colours no picture."""
_INDEX_INK = (222, 222, 220)
_TIME_INK = (140, 141, 143)
_MARGIN = 0.016
"""Of the sheet's width: border, and with half of it the gap between pictures."""
_LABEL = 0.011
"""Of the sheet's width: height of the letters."""
_MIN_LETTERS = 9
"""Pixels: smaller ones cannot be read."""
_MAX_SIDE = 16_384
"""Pixels of the sheet's width and height."""
_SHAPE_OF_SHEET = 2.0
"""Width by height that the choice of columns aims at: a sheet that fits a screen."""

_HOLES = 3.0
"""How much empty places count, as a part of all, against a shape that is off by that factor (logarithm)."""


def evenly_spaced(total: int, count: int = SHEET_FRAMES) -> list[int]:
    """At most ``count`` indices of ``total`` frames, the first and the last among them, equally far apart."""
    if total <= count:
        return list(range(total))
    return [round(position * (total - 1) / (count - 1)) for position in range(count)] if count > 1 else [0]


def contact_sheet(
    images: Sequence[NDArray[np.uint8]],
    *,
    indices: Sequence[int] | None = None,
    times: Sequence[float] | None = None,
    columns: int | None = None,
    width: int = 1600,
) -> NDArray[np.uint8]:
    """A grid of thumbnails with their frame numbers and times: uint8 (height, ``width``, 3).

    ``images`` are uint8 (h, w, 3) of one size; a sequence that loads them one by one keeps memory small.
    ``indices`` are their frame numbers (0, 1, … where left out), ``times`` their seconds. Pictures are made
    smaller where they must be and never larger.

    Raises EncodeError for no image at all, images of different sizes, or a sheet without room for them.
    """
    if not images:
        raise EncodeError("a contact sheet needs at least one image")
    numbers = range(len(images)) if indices is None else indices
    if len(numbers) != len(images) or (times is not None and len(times) != len(images)):
        raise EncodeError(f"a contact sheet of {len(images)} images needs as many indices and times")
    first = _checked(images[0], images[0].shape)
    layout = _Layout(len(images), first.shape[1] / first.shape[0], columns, width, first.shape[1])
    sheet = Image.new("RGB", (width, layout.height), _BACKGROUND)
    pen = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(layout.letters)
    digits = len(str(max(numbers)))
    for place, number in enumerate(numbers):
        x, y = layout.corner(place)
        thumbnail = Image.fromarray(_checked(images[place], first.shape))
        sheet.paste(thumbnail.resize(layout.thumbnail, Image.Resampling.LANCZOS), (x, y))
        below = y + layout.thumbnail[1] + layout.letters // 2
        pen.text((x, below), f"{number:0{digits}d}", fill=_INDEX_INK, font=font)
        if times is not None:
            right = x + layout.thumbnail[0]
            pen.text((right, below), f"{times[place]:.2f} s", fill=_TIME_INK, font=font, anchor="ra")
    return np.asarray(sheet)


class _Layout:
    """Where everything stands, in pixels."""

    def __init__(self, count: int, aspect: float, columns: int | None, width: int, largest: int) -> None:
        self.columns = max(1, min(count, columns or _columns(count, aspect)))
        self.letters = max(_MIN_LETTERS, round(width * _LABEL))
        self.margin = max(4, round(width * _MARGIN))
        self.gap = self.margin // 2
        room = (width - 2 * self.margin - (self.columns - 1) * self.gap) // self.columns
        thumbnail_width = min(room, largest)
        self.thumbnail = (thumbnail_width, max(1, round(thumbnail_width / aspect)))
        self.row = self.thumbnail[1] + 2 * self.letters + self.gap
        rows = -(-count // self.columns)
        self.height = 2 * self.margin + rows * self.row - self.gap
        used = self.columns * (thumbnail_width + self.gap) - self.gap
        self.left = (width - used) // 2
        if room < 1 or width > _MAX_SIDE or self.height > _MAX_SIDE:
            raise EncodeError(
                f"{count} images in {self.columns} columns do not fit a contact sheet {width} pixels wide"
            )

    def corner(self, place: int) -> tuple[int, int]:
        """(x, y) of the top left corner of a thumbnail."""
        row, column = divmod(place, self.columns)
        return self.left + column * (self.thumbnail[0] + self.gap), self.margin + row * self.row


def _columns(count: int, aspect: float) -> int:
    """A number of columns near the wanted shape that leaves few places empty."""
    # c columns and count / c rows of cells 1 : 1 / aspect make a sheet c : count / c / aspect.
    wanted = math.sqrt(_SHAPE_OF_SHEET * count / aspect)
    return min(
        range(1, count + 1),
        key=lambda columns: _HOLES * (-count % columns) / count + abs(math.log(columns / wanted)),
    )


def _checked(image: NDArray[Any], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or image.shape != shape:
        raise EncodeError(f"a contact sheet shows uint8 {shape} images, not {image.dtype} {image.shape}")
    return image
