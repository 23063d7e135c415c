"""The comparison finds what it is there to find, and says so to a person."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.encode.png import read_png_text
from tests.golden.comparing import TOLERANCE, Picture, amplified, bless, compare, decide, forget, golden, read, report
from tests.renderer.drawing import asked, broken_shaders, drawn
from tests.renderer.world import registered

VIEW: dict[str, Any] = {"width": 240, "height": 135, "msaa": 4, "time": 1.5}


def view() -> Picture:
    with registered():
        return drawn(**VIEW).color


def test_the_same_frame_is_the_same_picture() -> None:
    assert compare("x", view(), view()).largest == 0


@pytest.mark.parametrize(
    ("file", "change"),
    [
        ("passes/scene.frag", ("vec3 n = normalize(normal_world)", "vec3 n = -normalize(normal_world)")),
        ("passes/composite.frag", ("encoded = srgb_by_roots(c)", "encoded = srgb_by_roots(srgb_by_roots(c))")),
        ("water/luna.glsl", ("n.y *= point.up.y", "n = -n * point.up.y")),
    ],
    ids=["flipped normals", "double sRGB", "flipped ripples"],
)
def test_a_broken_shader_fails(file: str, change: tuple[str, str]) -> None:
    expected = view()
    with broken_shaders({file: change}):
        difference = compare("x", expected, view())

    assert not difference.is_tolerable
    assert difference.share > 0.05


@pytest.mark.parametrize(("down", "right"), [(0, 1), (1, 0), (0, -1), (-1, 0)])
def test_a_shift_by_one_pixel_fails(down: int, right: int) -> None:
    expected = view()
    with registered():
        eye = asked(**VIEW)
        lens = eye.view().lens
        k = {"fx": lens.fx, "fy": lens.fy, "cx": lens.cx + right, "cy": lens.cy + down}
        moved = drawn(**VIEW, camera={"intrinsics": k}).color
    rolled = np.roll(expected, (down, right), axis=(0, 1))

    assert not compare("x", expected, moved).is_tolerable
    assert not compare("x", expected, rolled).is_tolerable


def test_the_tolerance_is_three_steps_and_not_four() -> None:
    grey = np.full((4, 6, 3), 100, np.uint8)
    near, far = grey.copy(), grey.copy()
    near[1, 2, 0] += TOLERANCE
    far[1, 2, 0] -= TOLERANCE + 1

    assert compare("x", grey, near).is_tolerable
    assert not compare("x", grey, far).is_tolerable
    assert compare("x", grey, far).share == pytest.approx(1 / 24)
    assert not compare("x", grey, np.full((4, 5, 3), 100, np.uint8)).is_tolerable


@pytest.mark.parametrize(
    ("is_pinned", "has_golden", "is_ci", "verdict"),
    [
        (True, True, False, "compare"),
        (True, True, True, "compare"),
        (False, True, False, "skip"),
        (True, False, False, "skip"),
        (False, True, True, "fail"),
        (True, False, True, "fail"),
    ],
)
def test_only_the_pinned_driver_compares_and_ci_requires_it(
    is_pinned: bool, has_golden: bool, is_ci: bool, verdict: str
) -> None:
    assert decide(is_pinned=is_pinned, has_golden=has_golden, is_ci=is_ci) == verdict


def test_a_failure_leaves_three_pictures_and_a_page_that_shows_them(tmp_path: Path) -> None:
    expected, actual = np.zeros((4, 6, 3), np.uint8), np.full((4, 6, 3), 9, np.uint8)
    page = report(compare("pond <1>", expected, actual, "claim & more", "driver 1.0"), expected, actual, tmp_path)
    text = page.read_text()

    assert {path.name for path in tmp_path.glob("pond*.png")} == {
        f"pond <1>-{k}.png" for k in ("expected", "actual", "difference")
    }
    assert (read(tmp_path / "pond <1>-difference.png") == 9 * 16).all()
    assert (read(tmp_path / "pond <1>-actual.png") == actual).all()
    assert "up to 9/255 off, 100.00% of the pixels" in text
    assert "claim &amp; more" in text
    assert "driver 1.0" in text
    assert len(re.findall("<img", text)) == 3


def test_a_page_shows_all_failures_until_each_is_mended(tmp_path: Path) -> None:
    expected, actual = np.zeros((4, 6, 3), np.uint8), np.full((4, 7, 3), 9, np.uint8)
    for name in ("a", "b"):
        page = report(compare(name, expected, actual), expected, actual, tmp_path)

    assert page.read_text().count("<h2>") == 2
    forget("a", tmp_path)
    assert re.findall("<h2>(.*?)</h2>", page.read_text()) == ["b"]
    forget("b", tmp_path)
    assert "Nothing differs" in page.read_text()
    assert [path.name for path in tmp_path.iterdir()] == ["index.html"]


def test_a_blessed_picture_carries_its_request(tmp_path: Path) -> None:
    picture = np.arange(72, dtype=np.uint8).reshape(4, 6, 3)
    bless("pond", picture, b'{"scene":"pond"}', tmp_path)

    assert (read(golden("pond", tmp_path)) == picture).all()
    assert read_png_text(golden("pond", tmp_path).read_bytes()) == {"millpond": '{"scene":"pond"}'}
    assert compare("pond", read(golden("pond", tmp_path)), picture).largest == 0


def test_differences_are_shown_many_times_as_strong() -> None:
    expected, actual = np.zeros((1, 2, 3), np.uint8), np.array([[[1, 0, 0], [0, 0, 100]]], np.uint8)

    assert amplified(expected, actual).tolist() == [[[16, 0, 0], [0, 0, 255]]]
