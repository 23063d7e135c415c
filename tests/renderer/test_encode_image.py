"""PNG, JPEG and WebP: what Pillow reads back, and what hostile files do."""

from __future__ import annotations

import contextlib
import io
import json
import struct
import subprocess
import sys
import zlib
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray
from PIL import Image

from renderer.encode.image import FORMATS, Format, encode_jpeg, encode_webp, encoder_versions
from renderer.encode.png import REQUEST_KEYWORD, SIGNATURE, encode_png, read_png_text
from renderer.errors import EncodeError
from tests.renderer.encode_pictures import landscape

REQUEST = json.dumps({"scene": "pond", "water": {"technique": "luna"}, "time": 1.25}).encode()

pictures = st.tuples(st.integers(1, 40), st.integers(1, 40)).flatmap(lambda size: arrays.arrays(np.uint8, (*size, 3)))
grey_pictures = st.tuples(st.integers(1, 40), st.integers(1, 40)).flatmap(lambda size: arrays.arrays(np.uint8, size))
printable = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=400)


@dataclass
class Drawn:
    """A picture that did not come from a renderer."""

    color: NDArray[np.uint8]
    layers: dict[str, NDArray[np.generic]] = field(default_factory=dict)


def opened(data: bytes) -> Image.Image:
    """The image as Pillow reads it, every byte of it checked."""
    with Image.open(io.BytesIO(data)) as image:
        image.verify()
    image = Image.open(io.BytesIO(data))
    image.load()
    return image


def chunk(kind: bytes, body: bytes) -> bytes:
    """A PNG chunk, checksummed by zlib rather than by the code under test."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


@settings(deadline=None)
@given(pictures)
@example(np.array([[[1, 2, 3]]], np.uint8))
@example(np.zeros((1, 7, 3), np.uint8))
@example(np.full((7, 1, 3), 255, np.uint8))
def test_pillow_reads_a_colour_png_bit_for_bit(picture: NDArray[np.uint8]) -> None:
    image = opened(encode_png(picture))

    assert image.mode == "RGB"
    assert np.array_equal(np.asarray(image), picture)


@settings(deadline=None)
@given(grey_pictures)
@example(np.array([[200]], np.uint8))
def test_pillow_reads_a_grey_png_bit_for_bit(picture: NDArray[np.uint8]) -> None:
    image = opened(encode_png(picture))

    assert image.mode == "L"
    assert np.array_equal(np.asarray(image), picture)
    assert encode_png(picture[:, :, np.newaxis]) == encode_png(picture)


@pytest.mark.parametrize("shape", [(1, 1), (719, 1279), (720, 1280), (2, 5001)])
def test_pillow_reads_large_and_odd_pngs_bit_for_bit(shape: tuple[int, int]) -> None:
    picture = landscape(*shape)

    assert np.array_equal(np.asarray(opened(encode_png(picture))), picture)


def test_a_view_with_gaps_is_encoded_like_its_copy() -> None:
    picture = landscape(33, 47)[::-2, ::3]

    assert encode_png(picture) == encode_png(picture.copy())


def test_a_png_is_tagged_srgb_and_with_its_gamma() -> None:
    image = opened(encode_png(landscape(3, 3)))

    assert image.info["srgb"] == 0
    assert image.info["gamma"] == pytest.approx(1 / 2.2, rel=1e-4)


def test_the_checksums_are_those_of_zlib() -> None:
    data = encode_png(landscape(9, 9), {"millpond": "{}"})
    offset = len(SIGNATURE)
    kinds = []
    while offset < len(data):
        length, kind = struct.unpack_from(">I4s", data, offset)
        end = offset + 12 + length
        assert data[offset:end] == chunk(kind, data[offset + 8 : end - 4])
        kinds.append(kind)
        offset = end

    assert kinds == [b"IHDR", b"sRGB", b"gAMA", b"tEXt", b"IDAT", b"IEND"]


@settings(deadline=None)
@given(st.dictionaries(printable.map(str.strip).filter(lambda key: 0 < len(key) < 80 and "  " not in key), printable))
def test_text_comes_back_as_it_went_in(text: dict[str, str]) -> None:
    data = encode_png(landscape(2, 2), text)

    assert read_png_text(data) == text
    assert {key: str(value) for key, value in opened(data).text.items()} == text  # type: ignore[attr-defined]


def test_the_png_of_a_request_holds_the_request_and_no_other_text() -> None:
    data = FORMATS["png"].encode(Drawn(landscape(4, 5)), REQUEST)

    assert read_png_text(data) == {REQUEST_KEYWORD: REQUEST.decode()}


@pytest.mark.parametrize(
    "text",
    [{"": "a"}, {"k" * 80: "a"}, {" a": "b"}, {"a  b": "c"}, {"a\n": "b"}, {"é": "a"}, {"a": "é"}, {"a": "b\0c"},
     {"a": "b" * 2**20}],
)  # fmt: skip
def test_text_that_a_chunk_cannot_hold_is_refused(text: dict[str, str]) -> None:
    with pytest.raises(EncodeError, match="keyword"):
        encode_png(landscape(2, 2), text)


@pytest.mark.parametrize(
    "picture",
    [np.zeros((0, 4, 3), np.uint8), np.zeros((4, 4, 4), np.uint8), np.zeros((4, 4, 3)), np.zeros(4, np.uint8),
     np.zeros((4, 4, 3), np.uint16), np.zeros((1, 4, 4, 3), np.uint8)],
)  # fmt: skip
def test_arrays_that_are_no_8_bit_picture_are_refused(picture: NDArray[np.uint8]) -> None:
    with pytest.raises(EncodeError, match="uint8"):
        encode_png(picture)


def test_every_flipped_bit_of_the_text_is_noticed() -> None:
    data = encode_png(landscape(2, 2), {"millpond": '{"time":1}'})
    begin = data.index(b"tEXt")
    for bit in range(8 * begin, 8 * (begin + 4 + len('millpond\0{"time":1}') + 4)):
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8

        with pytest.raises(EncodeError, match="damaged"):
            read_png_text(bytes(damaged))


def test_a_flipped_bit_of_the_pixels_is_noticed() -> None:
    data = bytearray(encode_png(landscape(9, 9)))
    data[data.index(b"IDAT") + 20] ^= 1

    with pytest.raises(EncodeError, match=r"IDAT.*checksum"):
        read_png_text(bytes(data))


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_a_cut_file_is_refused(cut: int) -> None:
    data = encode_png(landscape(9, 9), {"millpond": "{}"})

    with pytest.raises(EncodeError, match=r"ends at|claims|signature"):
        read_png_text(data[: cut % len(data)])


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=200), st.booleans())
def test_a_strangers_bytes_give_text_or_a_clear_error(junk: bytes, has_signature: bool) -> None:
    with contextlib.suppress(EncodeError):
        texts = read_png_text(SIGNATURE + junk if has_signature else junk)

        assert all(isinstance(value, str) for value in texts.values())


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (chunk(b"tEXt", b"no separator"), "no keyword"),
        (chunk(b"tEXt", b"\0empty keyword"), "no keyword"),
        (chunk(b"tEXt", b"k" * 80 + b"\0long keyword"), "no keyword"),
        (chunk(b"tEXt", b"a\0b") + chunk(b"tEXt", b"a\0c"), "repeats the keyword 'a'"),
        (chunk(b"tEXt", b"a\0" + b"b" * 2**20), "at most 1048576"),
        (struct.pack(">I4s", 2**32 - 1, b"tEXt") + b"a\0b" + bytes(9), "claims 4294967295 bytes"),
        (chunk(b"junk", b"") * (2**16 + 1), "more than 65536 chunks"),
        (b"", "without its last chunk"),
    ],
)
def test_each_hostile_file_is_refused_with_its_reason(body: bytes, message: str) -> None:
    with pytest.raises(EncodeError, match=message):
        read_png_text(SIGNATURE + body + (chunk(b"IEND", b"") if body else b""))


def test_compressed_text_is_left_alone() -> None:
    bomb = chunk(b"zTXt", b"millpond\0\0" + zlib.compress(bytes(10_000_000)))

    assert read_png_text(SIGNATURE + bomb + chunk(b"tEXt", b"a\0b") + chunk(b"IEND", b"")) == {"a": "b"}


@pytest.mark.parametrize("entry", FORMATS.values(), ids=FORMATS)
def test_every_format_is_what_its_entry_says(entry: Format) -> None:
    picture = landscape(60, 81)
    image = opened(entry.encode(Drawn(picture), REQUEST))

    assert image.get_format_mimetype() == entry.media_type  # type: ignore[attr-defined]
    assert entry.bit_depth == 8
    assert image.size == (81, 60)
    difference = np.abs(np.asarray(image.convert("RGB")).astype(int) - picture)
    assert difference.mean() < (1e-9 if entry.name == "png" else 4.0)
    assert (difference > 0).any() == (entry.name != "png")


@pytest.mark.parametrize("entry", FORMATS.values(), ids=FORMATS)
def test_every_format_carries_the_request(entry: Format) -> None:
    image = opened(entry.encode(Drawn(landscape(20, 30)), REQUEST))
    bare = opened(entry.encode(Drawn(landscape(20, 30)), b""))

    text = getattr(image, "text", {}).get(REQUEST_KEYWORD) or image.getexif()[0x010E]
    assert text == REQUEST.decode()
    assert not getattr(bare, "text", {})
    assert not bare.getexif()


@pytest.mark.parametrize("entry", FORMATS.values(), ids=FORMATS)
def test_the_same_picture_gives_the_same_bytes_in_another_process(entry: Format) -> None:
    here = entry.encode(Drawn(landscape(64, 48)), REQUEST)
    program = (
        "import sys; from tests.renderer.test_encode_image import *;"
        f"sys.stdout.buffer.write(FORMATS[{entry.name!r}].encode(Drawn(landscape(64, 48)), REQUEST))"
    )
    there = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True).stdout

    assert here == entry.encode(Drawn(landscape(64, 48)), REQUEST)
    assert here == there


def test_a_request_too_long_for_exif_is_left_out() -> None:
    image = opened(encode_jpeg(landscape(8, 8), "x" * 70_000))

    assert not image.getexif()


@pytest.mark.parametrize("encode", [encode_jpeg, encode_webp])
@pytest.mark.parametrize("shape", [(0, 4, 3), (4, 4, 7), (4, 4)])
def test_pillow_formats_refuse_what_they_cannot_hold(encode: type, shape: tuple[int, ...]) -> None:
    with pytest.raises(EncodeError, match="is made from uint8"):
        encode(np.zeros(shape, np.uint8))


def test_a_webp_larger_than_its_format_allows_is_refused() -> None:
    with pytest.raises(EncodeError, match="WEBP"):
        encode_webp(np.zeros((1, 16_384, 3), np.uint8))


def test_the_versions_name_every_encoder() -> None:
    versions = encoder_versions()

    assert versions["numpy"] == np.__version__
    assert set(versions) == {"av", "isal", "numpy", "pillow"}
