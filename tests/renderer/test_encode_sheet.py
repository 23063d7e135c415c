"""Contact sheets: which frames they show, where, and that each is there."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.encode.sheet import SHEET_FRAMES, contact_sheet, evenly_spaced
from renderer.errors import EncodeError

BACKGROUND = (38, 39, 41)


def plain(index: int, width: int = 64, height: int = 36) -> NDArray[np.uint8]:
    """A picture of one colour that no other index has."""
    return np.full((height, width, 3), (250 - 9 * index, 9 * index, 120), np.uint8)


@given(st.integers(1, 100_000), st.integers(1, 64))
def test_the_frames_of_a_sheet_are_evenly_spaced(total: int, count: int) -> None:
    chosen = evenly_spaced(total, count)

    assert len(chosen) == min(total, count)
    assert chosen[0] == 0
    assert chosen[-1] == (total - 1 if count > 1 else 0)
    gaps = np.diff(chosen)
    assert not len(gaps) or (gaps.min() >= 1 and gaps.max() - gaps.min() <= 1)


def test_a_sheet_shows_24_frames_unless_told_otherwise() -> None:
    assert len(evenly_spaced(120)) == SHEET_FRAMES == 24


def test_every_picture_is_on_the_sheet_in_reading_order() -> None:
    sheet = contact_sheet([plain(index) for index in range(24)], width=1200)
    corners = []
    for index in range(24):
        rows, columns = np.nonzero((sheet == plain(index)[0, 0]).all(axis=2))
        assert len(rows) == 64 * 36
        corners.append((rows.min(), columns.min()))

    assert corners == sorted(corners)
    assert tuple(sheet[0, 0]) == tuple(sheet[-1, -1]) == BACKGROUND


@settings(deadline=None, max_examples=40)
@given(
    st.integers(1, 30),
    st.integers(1, 90),
    st.integers(1, 90),
    st.one_of(st.none(), st.integers(1, 8)),
    st.integers(200, 900),
)
def test_any_number_of_any_size_fits(count: int, width: int, height: int, columns: int | None, across: int) -> None:
    sheet = contact_sheet([plain(0, width, height)] * count, columns=columns, width=across)

    assert sheet.dtype == np.uint8
    assert sheet.shape[1:] == (across, 3)
    assert (sheet[:, 0] == BACKGROUND).all()
    assert (sheet[:, -1] == BACKGROUND).all()


def test_labels_follow_the_indices_and_times() -> None:
    pictures = [plain(1)] * 3
    bare = contact_sheet(pictures, width=400)
    numbered = contact_sheet(pictures, indices=[0, 60, 119], width=400)
    timed = contact_sheet(pictures, indices=[0, 60, 119], times=[0.0, 2.0, 3.97], width=400)

    assert not np.array_equal(bare, numbered)
    assert not np.array_equal(numbered, timed)
    assert np.array_equal(timed, contact_sheet(pictures, indices=[0, 60, 119], times=[0.0, 2.0, 3.97], width=400))


def test_a_picture_is_made_smaller_and_never_larger() -> None:
    large = contact_sheet([plain(0, 640, 360)] * 2, width=400, columns=2)
    small = contact_sheet([plain(0, 40, 20)], width=400)

    assert 120 < (large[20] == plain(0)[0, 0]).all(axis=1).sum() < 400
    assert (small == plain(0)[0, 0]).all(axis=2).sum() == 40 * 20


@pytest.mark.parametrize(
    ("pictures", "named"),
    [
        ([], {}),
        ([plain(0), plain(0, 65)], {}),
        ([plain(0).astype(np.float32)], {}),
        ([plain(0)[:, :, 0]], {}),
        ([plain(0)], {"indices": [1, 2]}),
        ([plain(0)], {"times": []}),
        ([plain(0)] * 40, {"columns": 40, "width": 100}),
        ([plain(0, 64, 640)] * 9, {"columns": 1, "width": 9000}),
    ],
)  # fmt: skip
def test_what_makes_no_sheet_is_refused(pictures: list[NDArray[np.uint8]], named: dict[str, object]) -> None:
    if named.get("width") == 9000:
        pictures = [np.zeros((3000, 64, 3), np.uint8)] * 9
    with pytest.raises(EncodeError, match="contact sheet"):
        contact_sheet(pictures, **named)  # type: ignore[arg-type]
