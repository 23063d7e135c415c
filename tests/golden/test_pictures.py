"""The README's pictures are there, are named in it, and are what today's requests say."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from renderer.encode.image import FORMATS
from renderer.request import FrameRequest
from tests.golden.pictures import PICTURES, SIZE
from tests.renderer.drawing import shared_renderer

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "pictures"
IMAGE_DESCRIPTION = 0x010E
LARGEST = 400_000
"""Bytes: a README must open quickly."""


def request_of(name: str) -> FrameRequest:
    """The request that draws a picture."""
    return FrameRequest.parse({**SIZE, **PICTURES[name].request})


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_there_and_shown(name: str, is_blessing: bool) -> None:
    path, request = FOLDER / f"{name}.webp", request_of(name)
    if is_blessing:
        FOLDER.mkdir(parents=True, exist_ok=True)
        path.write_bytes(FORMATS["webp"].encode(shared_renderer().render(request), request.canonical()))

    with Image.open(path) as image:
        size, description = image.size, image.getexif()[IMAGE_DESCRIPTION]

    assert description.encode() == request.canonical()
    assert size == (SIZE["width"], SIZE["height"])
    assert path.stat().st_size < LARGEST
    assert f"docs/pictures/{name}.webp" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_no_picture_lies_about_unnamed() -> None:
    assert {path.stem for path in FOLDER.glob("*.webp")} == set(PICTURES)
