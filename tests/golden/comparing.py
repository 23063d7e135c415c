"""Comparing a picture with its golden one, and a page that shows a person what differs."""

from __future__ import annotations

import html
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.encode.png import encode_png

FOLDER = Path(__file__).parent
FRAMES = FOLDER / "frames"
FAILED = FOLDER / "failed"
"""Where a failed comparison leaves expected, actual, difference and the page; no part of the repository."""
PINNED = "llvmpipe"
"""The driver that the golden pictures hold on."""
TOLERANCE = 3
"""Of 255: the software driver's approximate reciprocals differ by that much between processors."""
AMPLIFICATION = 16

Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Difference:
    """How far a picture is from its golden one."""

    name: str
    largest: int
    """Steps of 255; 255 where the sizes differ."""
    share: float
    """Of the pixels that are past the tolerance."""
    claim: str = ""
    driver: str = ""

    @property
    def is_tolerable(self) -> bool:
        """Whether the pictures count as equal."""
        return self.largest <= TOLERANCE

    def __str__(self) -> str:
        return f"{self.name}: up to {self.largest}/255 off, {self.share:.2%} of the pixels past {TOLERANCE}/255"


def compare(name: str, expected: Picture, actual: Picture, claim: str = "", driver: str = "") -> Difference:
    """The difference of two pictures, (h, w, 3) bytes each."""
    if expected.shape != actual.shape:
        return Difference(name, 255, 1.0, f"{claim} (size {actual.shape}, expected {expected.shape})", driver)
    apart = np.abs(expected.astype(np.int16) - actual).max(axis=-1)
    return Difference(name, int(apart.max()), float((apart > TOLERANCE).mean()), claim, driver)


def decide(*, is_pinned: bool, has_golden: bool, is_ci: bool) -> Literal["compare", "skip", "fail"]:
    """What to do with a picture that was drawn: only the pinned driver compares, and CI must."""
    if is_pinned and has_golden:
        return "compare"
    return "fail" if is_ci else "skip"


def golden(name: str, folder: Path = FRAMES) -> Path:
    """Where a golden picture lies."""
    return folder / f"{name}.png"


def bless(name: str, actual: Picture, request: bytes, folder: Path = FRAMES) -> None:
    """Make a picture the golden one; its file carries its request."""
    folder.mkdir(parents=True, exist_ok=True)
    golden(name, folder).write_bytes(encode_png(actual, {"millpond": request.decode()}))


def read(path: Path) -> Picture:
    """The pixels of a picture file, (h, w, 3)."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def report(difference: Difference, expected: Picture, actual: Picture, folder: Path = FAILED) -> Path:
    """Write expected, actual and difference, and the page that shows all failures; the page's path."""
    folder.mkdir(parents=True, exist_ok=True)
    for kind, picture in (("expected", expected), ("actual", actual), ("difference", amplified(expected, actual))):
        (folder / f"{difference.name}-{kind}.png").write_bytes(encode_png(picture, {}))
    (folder / f"{difference.name}.json").write_text(json.dumps(asdict(difference)))
    return _write_page(folder)


def forget(name: str, folder: Path = FAILED) -> None:
    """Take back what an earlier failure of this name left."""
    if not (folder / f"{name}.json").exists():
        return
    for kind in ("-expected.png", "-actual.png", "-difference.png", ".json"):
        (folder / f"{name}{kind}").unlink(missing_ok=True)
    _write_page(folder)


def amplified(expected: Picture, actual: Picture) -> Picture:
    """The differences, many times as strong; white where the sizes differ."""
    if expected.shape != actual.shape:
        return np.full(actual.shape, 255, np.uint8)
    apart = np.abs(expected.astype(np.int16) - actual)
    return np.asarray(np.clip(apart * AMPLIFICATION, 0, 255), np.uint8)


def _write_page(folder: Path) -> Path:
    failures = [Difference(**json.loads(path.read_text())) for path in sorted(folder.glob("*.json"))]
    rows = "".join(_row(failure) for failure in failures) or "<p>Nothing differs any more.</p>"
    page = folder / "index.html"
    page.write_text(
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>Pictures that differ</title>"
        "<style>body{font:16px/1.5 system-ui;margin:2rem;background:#222;color:#ddd}"
        "figure{display:inline-block;margin:0 1rem 1rem 0}img{max-width:31vw;image-rendering:pixelated}</style>"
        f"<h1>Pictures that differ</h1><p>The difference is shown {AMPLIFICATION} times as strong. "
        f"To accept the new pictures: <code>make bless</code>.</p>{rows}</html>",
        encoding="utf-8",
    )
    return page


def _row(failure: Difference) -> str:
    name = html.escape(failure.name)
    figures = "".join(
        f"<figure><img src='{name}-{kind}.png' alt='{kind}'><figcaption>{kind}</figcaption></figure>"
        for kind in ("expected", "actual", "difference")
    )
    facts = "<br>".join(html.escape(line) for line in (str(failure), failure.claim, failure.driver))
    return f"<h2>{name}</h2><p>{facts}</p>{figures}"
