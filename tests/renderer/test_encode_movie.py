"""Movies: every frame comes back, colours survive, and damage is found."""

from __future__ import annotations

import io
import itertools
import tracemalloc
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.encode.movie import MOVIES, MovieWriter, movie_size, verify_movie
from renderer.errors import EncodeError
from tests.renderer.encode_pictures import landscape

FRAMES = 24
WIDTH, HEIGHT = 161, 121


def frames(count: int = FRAMES, width: int = WIDTH, height: int = HEIGHT) -> list[NDArray[np.uint8]]:
    """A landscape that passes by."""
    return [landscape(height, width, shift=12.0 * index) for index in range(count)]


def write(path: Path, count: int = FRAMES, fps: float | Fraction = 30) -> Path:
    """A movie of the format that the path's suffix names."""
    with MovieWriter(path, WIDTH, HEIGHT, fps, path.suffix[1:]) as movie:
        for frame in frames(count):
            movie.add(frame)
    return path


def decoded(path: Path) -> list[NDArray[np.uint8]]:
    """Every frame as RGB, by the colour tags of the file."""
    with av.open(str(path)) as container:
        return [np.asarray(frame.to_ndarray(format="rgb24"), np.uint8) for frame in container.decode(video=0)]


@pytest.mark.parametrize("container", MOVIES)
def test_every_frame_is_in_the_movie_in_its_order(tmp_path: Path, container: str) -> None:
    found = decoded(write(tmp_path / f"movie.{container}"))

    assert len(found) == FRAMES
    for index, (frame, original) in enumerate(zip(found, frames(), strict=True)):
        differences = [np.abs(frame[:HEIGHT, :WIDTH].astype(int) - other).mean() for other in frames()]
        assert int(np.argmin(differences)) == index
        assert np.abs(frame[:HEIGHT, :WIDTH].astype(int) - original).mean() < 4.0


@pytest.mark.parametrize("container", MOVIES)
@pytest.mark.parametrize("fps", [30, 24, 60, 12.5, Fraction(30_000, 1001), 240])
def test_verification_agrees_with_what_was_written(tmp_path: Path, container: str, fps: float) -> None:
    facts = verify_movie(write(tmp_path / f"movie.{container}", 7, fps), 7, fps, WIDTH, HEIGHT)

    assert (facts.frames, facts.width, facts.height) == (7, WIDTH + 1, HEIGHT + 1)
    assert facts.seconds == pytest.approx(7 / fps)


@pytest.mark.parametrize("container", MOVIES)
def test_the_same_frames_give_the_same_bytes_every_time(container: str) -> None:
    same, found = frames(6), set()
    random = np.random.default_rng(3)
    litter = [bytearray()] * 16
    for turn in range(30):
        litter[turn % 16] = bytearray(random.bytes(int(random.integers(1, 300_000))))  # never the same memory again
        file = io.BytesIO()
        with MovieWriter(file, WIDTH, HEIGHT, 30, container) as movie:
            for frame in same:
                movie.add(frame)
        found.add(file.getvalue())

    assert len(found) == 1


@pytest.mark.parametrize("container", MOVIES)
def test_a_file_that_cannot_seek_gets_the_same_bytes(tmp_path: Path, container: str) -> None:
    class Pipe(io.BytesIO):
        def seek(self, *_: int) -> int:
            raise io.UnsupportedOperation

    pipe = Pipe()
    with MovieWriter(pipe, WIDTH, HEIGHT, 30, container) as movie:
        for frame in frames(6):
            movie.add(frame)

    assert pipe.getvalue() == write(tmp_path / f"movie.{container}", 6).read_bytes()


@pytest.mark.parametrize("container", MOVIES)
def test_colours_survive_the_round_trip(tmp_path: Path, container: str) -> None:
    colors = np.array(list(itertools.product((0, 51, 102, 153, 204, 255), repeat=3)), np.uint8)
    card = np.kron(colors.reshape(12, 18, 3), np.ones((16, 16, 1), np.uint8))
    path = tmp_path / f"card.{container}"
    with MovieWriter(path, card.shape[1], card.shape[0], 30, container) as movie:
        for _ in range(3):
            movie.add(card)

    for frame in decoded(path):
        assert np.abs(frame[8::16, 8::16].astype(int) - card[8::16, 8::16]).max() <= 5


@pytest.mark.parametrize("container", MOVIES)
def test_the_file_says_which_colours_it_holds(tmp_path: Path, container: str) -> None:
    bt709, limited = 1, 1
    with av.open(str(write(tmp_path / f"movie.{container}", 2))) as file:
        frame = next(file.decode(video=0))

        assert (frame.colorspace, frame.color_range) == (bt709, limited)
        assert (frame.color_primaries, frame.color_trc) == (bt709, bt709)


@pytest.mark.parametrize("container", MOVIES)
@pytest.mark.parametrize("size", [(1, 1), (2, 3), (5, 17), (16, 16)])
def test_odd_sides_repeat_their_last_line(tmp_path: Path, container: str, size: tuple[int, int]) -> None:
    width, height = size
    path = tmp_path / f"odd.{container}"
    with MovieWriter(path, width, height, 10, container) as movie:
        for level in (40, 120, 200):
            movie.add(np.full((height, width, 3), level, np.uint8))

    verify_movie(path, 3, 10, width, height)
    for frame, level in zip(decoded(path), (40, 120, 200), strict=True):
        assert frame.shape == (*movie_size(width, height)[::-1], 3)
        assert np.abs(frame.astype(int) - level).max() <= 4


def test_the_index_of_an_mp4_stands_before_its_frames(tmp_path: Path) -> None:
    data = write(tmp_path / "movie.mp4", 3).read_bytes()

    assert 0 < data.index(b"moov") < data.index(b"mdat")


def test_memory_does_not_grow_with_the_number_of_frames(tmp_path: Path) -> None:
    frame = landscape(180, 320)
    with MovieWriter(tmp_path / "long.mp4", 320, 180, 30) as movie:
        movie.add(frame)
        tracemalloc.start()
        for _ in range(150):
            movie.add(frame)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()

    assert peak < 4 * frame.nbytes


@pytest.mark.parametrize("container", MOVIES)
@pytest.mark.parametrize("kept", [0.0, 0.1, 0.5, 0.9, 0.98])
def test_a_truncated_movie_fails_verification(tmp_path: Path, container: str, kept: float) -> None:
    path = write(tmp_path / f"movie.{container}")
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])

    with pytest.raises(EncodeError, match=r"movie\.\w+ (cannot be decoded|is not the movie)"):
        verify_movie(path, FRAMES, 30, WIDTH, HEIGHT)


def test_damage_in_the_frames_of_an_mp4_fails_verification(tmp_path: Path) -> None:
    path = write(tmp_path / "movie.mp4")
    data = bytearray(path.read_bytes())
    begin = data.index(b"mdat") + len(data) // 3
    data[begin : begin + 200] = bytes(200)
    path.write_bytes(data)

    with pytest.raises(EncodeError, match=r"movie\.mp4 "):
        verify_movie(path, FRAMES, 30, WIDTH, HEIGHT)


@pytest.mark.parametrize(
    ("expected", "message"),
    [
        ((FRAMES + 1, 30, WIDTH, HEIGHT), "24 frames, expected 25"),
        ((FRAMES - 1, 30, WIDTH, HEIGHT), "24 frames, expected 23"),
        ((FRAMES, 25, WIDTH, HEIGHT), "30 frames per second, expected 25"),
        ((FRAMES, 25, WIDTH, HEIGHT), r"frame 1 at 0\.033\d s, expected 0\.0400 s"),
        ((FRAMES, 30, 640, HEIGHT), "162 x 122 pixels, expected 640 x 122"),
    ],
)
@pytest.mark.parametrize("container", MOVIES)
def test_a_movie_that_is_not_the_one_asked_for_fails_verification(
    tmp_path: Path, container: str, expected: tuple[int, float, int, int], message: str
) -> None:
    with pytest.raises(EncodeError, match=message):
        verify_movie(write(tmp_path / f"movie.{container}"), *expected)


def test_a_missing_frame_in_the_middle_fails_verification(tmp_path: Path) -> None:
    path = tmp_path / "gap.mp4"
    with MovieWriter(path, WIDTH, HEIGHT, 30) as movie:
        for index, frame in enumerate(frames()):
            if index == 12:
                movie._frames += 1  # the frame's time passes without it
            else:
                movie.add(frame)

    with pytest.raises(EncodeError, match=r"frame 12 at 0\.4333 s, expected 0\.4000 s"):
        verify_movie(path, FRAMES - 1, 30, WIDTH, HEIGHT)


@pytest.mark.parametrize("content", [b"", b"no movie", b"\0" * 4096])
def test_a_file_that_is_no_movie_fails_verification(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "no.mp4"
    path.write_bytes(content)

    with pytest.raises(EncodeError, match=r"no\.mp4"):
        verify_movie(path, 1, 30, 16, 16)


def test_a_missing_file_fails_verification(tmp_path: Path) -> None:
    with pytest.raises(EncodeError, match="after 0 of 3 frames"):
        verify_movie(tmp_path / "nowhere.mp4", 3, 30, 16, 16)


def leave_by_an_exception(movie: MovieWriter) -> None:
    """Add a frame and fail over something else."""
    movie.add(frames(1)[0])
    raise KeyError


def test_an_exception_leaves_no_file_behind(tmp_path: Path) -> None:
    pipe = io.BytesIO()
    for target in (tmp_path / "half.mp4", pipe):
        with pytest.raises(KeyError), MovieWriter(target, WIDTH, HEIGHT, 30) as movie:
            leave_by_an_exception(movie)

    assert not list(tmp_path.iterdir())
    assert not pipe.getvalue()


def test_a_movie_without_frames_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(EncodeError, match="at least one"), MovieWriter(tmp_path / "none.mp4", 8, 8, 30):
        pass

    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("frame", [landscape(8, 9), landscape(8, 8).astype(np.float32), landscape(8, 8)[:, :, :2]])
def test_a_frame_of_another_size_or_type_is_refused(tmp_path: Path, frame: NDArray[np.uint8]) -> None:
    with MovieWriter(tmp_path / "movie.mp4", 8, 8, 30) as movie:
        movie.add(landscape(8, 8))
        with pytest.raises(EncodeError, match="frame 1 is"):
            movie.add(frame)

    verify_movie(tmp_path / "movie.mp4", 1, 30, 8, 8)


def test_a_closed_movie_takes_no_more_frames(tmp_path: Path) -> None:
    with MovieWriter(tmp_path / "movie.mp4", 8, 8, 30) as movie:
        movie.add(landscape(8, 8))
        movie.close()
        with pytest.raises(EncodeError, match="already closed"):
            movie.add(landscape(8, 8))

    verify_movie(tmp_path / "movie.mp4", 1, 30, 8, 8)


@pytest.mark.parametrize("fps", [0, -1, float("nan"), float("inf")])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, fps: float) -> None:
    with pytest.raises(EncodeError, match="no frame rate"):
        MovieWriter(tmp_path / "movie.mp4", 8, 8, fps)


def test_an_unknown_format_names_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(EncodeError, match="there are mp4, webm"):
        MovieWriter(tmp_path / "movie.avi", 8, 8, 30, "avi")


def test_a_folder_that_is_not_there_is_a_clear_error(tmp_path: Path) -> None:
    with pytest.raises(EncodeError, match="No such file"):
        MovieWriter(tmp_path / "nowhere" / "movie.mp4", 8, 8, 30)
