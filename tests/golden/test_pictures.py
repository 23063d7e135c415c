"""The pictures of README, gallery and layers are there, shown, and what today's requests say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PIL import Image

from renderer.encode.image import FORMATS
from renderer.request import FrameRequest
from renderer.scene.catalogue import SCENES
from renderer.water.catalogue import TECHNIQUES
from tests.golden.curves import CURVES
from tests.golden.gallery import COLUMNS, PAGES, ROWS
from tests.golden.pictures import Page, Picture
from tests.renderer.drawing import shared_renderer

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "pictures"
IMAGE_DESCRIPTION = 0x010E
LARGEST = 400_000
"""Bytes: a page must open quickly."""
ALL_OF_THEM = 20_000_000
"""Bytes of all pictures in the repository: a clone must be quick too."""
DECLARED: dict[str, Picture] = {name: picture for page in PAGES for name, picture in page.pictures.items()}
LINK = re.compile(r"\]\((?!https?:)(?P<target>[^)#\s]+)(?:#[^)]*)?\)")


def known(name: str) -> Picture:
    """A picture that can be drawn; the test is skipped where its scene or technique is not in the catalogues."""
    if not DECLARED[name].is_drawable:
        pytest.skip(f"{name}: its scene or its technique is not in the catalogue")
    return DECLARED[name]


@pytest.mark.parametrize(
    ("page", "name"), [pytest.param(page, name, id=name) for page in PAGES for name in page.pictures]
)
def test_a_picture_is_there_and_is_what_its_request_says(page: Page, name: str, is_blessing: bool) -> None:
    path, request = FOLDER / f"{name}.webp", FrameRequest.parse({**page.size, **known(name).request})
    if is_blessing:
        FOLDER.mkdir(parents=True, exist_ok=True)
        path.write_bytes(FORMATS["webp"].encode(shared_renderer().render(request), request.canonical()))

    with Image.open(path) as image:
        size, description = image.size, image.getexif()[IMAGE_DESCRIPTION]

    assert description.encode() == request.canonical()
    assert size == (page.size["width"], page.size["height"])
    assert path.stat().st_size < LARGEST


@pytest.mark.parametrize(
    ("page", "name"), [pytest.param(page, name, id=name) for page in PAGES for name in page.pictures]
)
def test_a_picture_is_shown_on_its_page_with_its_text(page: Page, name: str) -> None:
    path = ROOT / page.path
    place = (FOLDER / f"{name}.webp").relative_to(path.parent)

    assert f"![{page.pictures[name].text}]({place})" in path.read_text(encoding="utf-8")


def test_the_gallery_has_a_place_for_every_technique_and_every_scene() -> None:
    assert set(TECHNIQUES) <= set(COLUMNS)
    assert set(SCENES) <= set(ROWS)


@pytest.mark.parametrize("page", ["README.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))])
def test_every_link_leads_somewhere(page: str, is_blessing: bool) -> None:
    if is_blessing:
        pytest.skip("what it links may be drawn after it")
    path = ROOT / page
    targets = {path.parent / match["target"] for match in LINK.finditer(path.read_text(encoding="utf-8"))}
    lacking = {target.name for target in targets if not target.exists()}
    absent = {f"{name}.webp" for name, picture in DECLARED.items() if not picture.is_drawable}
    absent |= {f"{name}.svg" for name, figure in CURVES.items() if not figure.is_drawable}

    assert lacking <= absent


def test_no_picture_lies_about_unnamed() -> None:
    drawn = {f"{name}.webp" for name in DECLARED} | {f"{name}.svg" for name in CURVES}

    assert {path.name for path in FOLDER.glob("*")} <= drawn


def test_all_pictures_together_are_a_small_download() -> None:
    pictures = [path for folder in (FOLDER, ROOT / "tests" / "golden" / "frames") for path in folder.glob("*")]

    assert sum(path.stat().st_size for path in pictures) < ALL_OF_THEM
