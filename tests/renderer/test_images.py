"""Users' images: what is taken, what is refused, and what is made of them."""

from __future__ import annotations

import hashlib
import io
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from renderer.errors import ImageLibraryFull, InvalidRequest, MissingImage
from renderer.scene.image_files import ImageCaps
from renderer.scene.images import ImageLibrary, ImageReference
from renderer.source_digest import ROOT
from renderer.water import image_maps
from renderer.water.image_maps import image_texture, premultiplied, slopes_of_normals
from tests.reference import normals
from tests.renderer.making_images import even, file_of, painted, png, png_of_sixteen_bits

FLAT = even(128, 128, 255)


def mistake(library: ImageLibrary, data: bytes, kind: str) -> str:
    """What the one mistake says, value and bound included; nothing must be stored for it."""
    with pytest.raises(InvalidRequest) as refusal:
        library.put(data, kind)
    (problem,) = refusal.value.problems
    assert problem.value is not None
    assert problem.bound
    assert not library.directory.exists()
    return f"{problem.path}: {problem.message}; {problem.value}; {problem.bound}"


# -------------------------------------------------------------------------------------------------------- the library


def test_an_id_is_the_hash_of_kind_and_bytes_and_the_bytes_are_kept_as_they_came(images: ImageLibrary) -> None:
    data = file_of(painted())
    card = images.put(data, "color_layer")

    assert card.id == hashlib.sha256(b"color_layer\0" + data).hexdigest()
    assert (card.kind, card.width, card.height) == ("color_layer", 32, 24)
    assert images.put(data, "color_layer") == images.card(card.id) == card
    assert [path.read_bytes() for path in images.directory.iterdir()] == [data]


def test_one_file_of_two_kinds_is_two_images(images: ImageLibrary) -> None:
    ids = {images.put(file_of(FLAT), kind).id: kind for kind in ("normal_map", "color_layer")}

    assert {name: images.kind_of(name) for name in ids} == ids


def test_another_process_reads_what_this_one_stored(images: ImageLibrary) -> None:
    pixels = painted()
    card = images.put(file_of(pixels), "color_layer")
    program = (
        "from renderer.scene.images import *; import sys, hashlib;"
        "pixels = image_library().load(ImageReference(sys.argv[1], 'color_layer'));"
        "print(hashlib.sha256(pixels.tobytes()).hexdigest())"
    )
    command = [sys.executable, "-c", program, card.id]
    told = subprocess.run(command, cwd=ROOT, env={**os.environ}, capture_output=True, text=True, check=True)

    assert told.stdout.strip() == hashlib.sha256(pixels.tobytes()).hexdigest()


@pytest.mark.parametrize("name", ["0" * 64, "../../etc/passwd", "", "A" * 64, "ripples"])
def test_an_image_that_is_not_here_is_named(images: ImageLibrary, name: str) -> None:
    assert images.kind_of(name) is None
    with pytest.raises(MissingImage, match="upload it again"):
        images.load(ImageReference(name, "normal_map"))


def test_a_file_that_was_damaged_on_disk_is_missing_and_is_mended_by_a_new_upload(images: ImageLibrary) -> None:
    data = file_of(FLAT)
    card = images.put(data, "normal_map")
    (path,) = images.directory.iterdir()
    path.write_bytes(data[:-20])
    with pytest.raises(MissingImage):
        images.load(ImageReference(card.id, "normal_map"))

    images.put(data, "normal_map")
    assert np.array_equal(images.load(ImageReference(card.id, "normal_map")), FLAT)


def test_a_full_library_takes_no_more_and_leaves_nothing_behind(tmp_path: Path) -> None:
    first, second = file_of(painted(1)), file_of(painted(2))
    library = ImageLibrary(tmp_path, budget=len(first) + len(second) - 1)
    library.put(first, "color_layer")
    with pytest.raises(ImageLibraryFull):
        library.put(second, "color_layer")

    library.put(first, "color_layer")
    assert len(list(tmp_path.iterdir())) == 1


# ------------------------------------------------------------------------------------------------------ what is taken


def sixteen(channels: int) -> Any:
    return np.random.default_rng(5).integers(0, 65536, (9, 7, channels), dtype=np.uint16)


def test_every_form_of_a_colour_layer_is_its_colours_and_its_alpha(images: ImageLibrary) -> None:
    pixels = painted()
    opaque = np.concatenate([pixels[..., :3], even(255, size=(24, 32))], axis=2)
    grey = np.concatenate([np.repeat(pixels[..., :1], 3, axis=2), opaque[..., 3:]], axis=2)
    palette = io.BytesIO()
    Image.fromarray(even(10, 200, 30)).convert("P", palette=Image.Palette.ADAPTIVE).save(palette, "PNG", transparency=0)
    deep = sixteen(4)
    for data, expected in (
        (file_of(pixels), pixels),
        (file_of(pixels[..., :3]), opaque),
        (file_of(pixels[..., 0]), grey),
        (file_of(pixels[..., :3], "WEBP", lossless=True), opaque),
        (palette.getvalue(), even(10, 200, 30, 0)),
        (png_of_sixteen_bits(deep), np.floor(deep / 257 + 0.5).astype(np.uint8)),
    ):
        card = images.put(data, "color_layer")
        assert np.array_equal(images.load(ImageReference(card.id, "color_layer")), expected)


def test_a_jpeg_is_taken(images: ImageLibrary) -> None:
    card = images.put(file_of(FLAT, "JPEG", quality=95), "normal_map")

    assert np.abs(images.load(ImageReference(card.id, "normal_map")).astype(int) - FLAT).max() <= 2


@pytest.mark.parametrize("channels", [3, 4])
def test_sixteen_bits_of_a_normal_map_are_kept(images: ImageLibrary, channels: int) -> None:
    pixels = sixteen(channels) // 2 + 32768
    card = images.put(png_of_sixteen_bits(pixels), "normal_map")

    assert np.array_equal(images.load(ImageReference(card.id, "normal_map")), pixels[..., :3])


@pytest.mark.parametrize("channels", [1, 2])
def test_sixteen_bits_of_a_bias_map_are_kept(images: ImageLibrary, channels: int) -> None:
    pixels = sixteen(channels)
    card = images.put(png_of_sixteen_bits(pixels), "bias_map")

    assert np.array_equal(images.load(ImageReference(card.id, "bias_map")), pixels[..., :1])


def test_grey_written_in_three_channels_is_a_bias_map(images: ImageLibrary) -> None:
    card = images.put(file_of(np.repeat(painted(channels=1), 3, axis=2)), "bias_map")

    assert np.array_equal(images.load(ImageReference(card.id, "bias_map")), painted(channels=1))


# ----------------------------------------------------------------------------------------------------- what is refused


def animated(form: str) -> bytes:
    file = io.BytesIO()
    first, *others = [Image.fromarray(painted(number)) for number in range(3)]
    first.save(file, form, save_all=True, append_images=others)
    return file.getvalue()


def huge(width: int, height: int) -> bytes:
    """A small PNG whose header promises a great deal."""
    return png(struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0), zlib.compress(bytes(1000)))


def broken_checksum() -> bytes:
    data = bytearray(file_of(painted()))
    place = data.index(b"IEND") - 8
    data[place] ^= 1
    return bytes(data)


def cmyk() -> bytes:
    file = io.BytesIO()
    Image.fromarray(FLAT).convert("CMYK").save(file, "JPEG")
    return file.getvalue()


HOSTILE = [
    (b"", "the file is empty; 0 bytes"),
    (b"just some text, saved as waves.png", "neither PNG nor JPEG nor WebP; it begins with b'just some te'"),
    (b"GIF89a" + bytes(40), "neither PNG nor JPEG nor WebP"),
    (b"<svg xmlns='http://www.w3.org/2000/svg'/>", "neither PNG nor JPEG nor WebP"),
    (file_of(FLAT)[:-30], "the PNG file is truncated or damaged"),
    (file_of(painted(channels=3), "JPEG")[:-300], "the JPEG file is truncated or damaged"),
    (file_of(painted(channels=3), "WEBP")[:-300], "the WebP file is truncated or damaged"),
    (file_of(FLAT)[:20], "the PNG file is truncated or damaged"),
    (png_of_sixteen_bits(sixteen(3))[:-60], "the PNG file is truncated or damaged"),
    (b"\x89PNG\r\n\x1a\n" + os.urandom(400), "the PNG file is truncated or damaged"),
    (b"\xff\xd8\xff" + bytes(400), "the JPEG file is truncated or damaged"),
    (b"RIFF\x40\0\0\0WEBP" + bytes(400), "the WebP file is truncated or damaged"),
    (broken_checksum(), "the PNG file is truncated or damaged"),
    (huge(60_000, 60_000), "the image is too large; 60000×60000; width and height <= 8192"),
    (huge(1, 2**31 - 1), "the image is too large; 1×2147483647; width and height <= 8192"),
    (huge(8192, 8192), "the PNG file is truncated or damaged"),
    (animated("PNG"), "the image is animated; 3 frames; one frame"),
    (animated("WEBP"), "the image is animated; 3 frames; one frame"),
    (cmyk(), "colours of another space; CMYK; grey, RGB or RGBA"),
]


@pytest.mark.parametrize(("data", "words"), HOSTILE, ids=[f"{words[:30]} {len(data)}" for data, words in HOSTILE])
def test_what_is_no_sound_image_is_one_mistake_and_is_not_kept(images: ImageLibrary, data: bytes, words: str) -> None:
    told = mistake(images, data, "color_layer")

    assert told.startswith("file: ")
    assert words in told


@pytest.mark.parametrize(
    ("pixels", "kind", "words"),
    [
        (painted(channels=1)[..., 0], "normal_map", "three channels; 1 channels"),
        (even(128, 255, 128), "normal_map", "no normal map: its normals don't point up, which blue above one half"),
        (painted(channels=3), "bias_map", "a bias map is grey; colour in"),
        (FLAT, "equirect", "kind: unknown kind of image; equirect; one of normal_map, bias_map, color_layer"),
        (FLAT, "", "kind: unknown kind of image; ; one of normal_map, bias_map, color_layer"),
    ],
)
def test_an_image_of_another_kind_is_refused(images: ImageLibrary, pixels: Any, kind: str, words: str) -> None:
    assert words in mistake(images, file_of(pixels), kind)


def test_the_caps_are_told(tmp_path: Path) -> None:
    data = file_of(painted())
    for caps, words in (
        (ImageCaps(size=100), f"the file is too large; {len(data)} bytes; <= 100 bytes"),
        (ImageCaps(side=31), "the image is too large; 32×24; width and height <= 31"),
        (ImageCaps(pixels=767), "the image is too large; 32×24; width * height <= 767"),
    ):
        assert words in mistake(ImageLibrary(tmp_path / "none", caps), data, "color_layer")
    exact = ImageCaps(size=len(data), side=32, pixels=768)
    assert ImageLibrary(tmp_path, exact).put(data, "color_layer").width == 32


# ----------------------------------------------------------------------------------------------- what is made of them


@pytest.mark.parametrize(("color", "dtype"), [((128, 128, 255), np.uint8), ((32768, 32768, 65535), np.uint16)])
def test_a_map_painted_flat_has_slopes_of_exactly_zero(color: tuple[int, int, int], dtype: Any) -> None:
    slopes = slopes_of_normals(even(*color, dtype=dtype))

    assert slopes.dtype == np.float32
    assert slopes.shape == (8, 8, 2)
    assert (slopes == 0).all()


def test_slopes_are_those_of_the_painted_normals_green_to_the_north() -> None:
    wanted = np.array([[0.5, -0.25], [-1.5, 0.75], [0.0, 0.3]])
    x, y, z = np.moveaxis(normals.of_slope(wanted), -1, 0)
    tangent = np.stack([x, -z, y], axis=-1)  # red to the east, green to the north (-z), blue up
    painted_map = np.rint(32768 + 32767 * tangent).astype(np.uint16)[None]

    assert np.abs(slopes_of_normals(painted_map)[0] - wanted).max() < 4e-4
    assert np.abs(slopes_of_normals(np.rint(128 + 127 * tangent).astype(np.uint8)[None])[0] - wanted).max() < 0.06


def test_the_mean_of_a_normal_map_is_kept(images: ImageLibrary) -> None:
    card = images.put(file_of(even(148, 128, 250)), "normal_map")
    slopes = image_texture(ImageReference(card.id, "normal_map")).image

    assert np.abs(slopes.mean(axis=(0, 1)) - [-20 / 122, 0]).max() < 1e-6


def test_colours_are_linear_and_multiplied_by_alpha() -> None:
    made = premultiplied(np.array([[[255, 188, 0, 255], [255, 188, 0, 51], [255, 255, 255, 0]]], np.uint8)) / 65535

    green = ((188 / 255 + 0.055) / 1.055) ** 2.4
    assert np.abs(made[0] - [[1, green, 0, 1], [0.2, 0.2 * green, 0, 0.2], [0, 0, 0, 0]]).max() < 1e-5


@pytest.mark.parametrize("shape", [(50, 70), (64, 64), (33, 16), (1, 200)])
def test_a_large_image_is_brought_down_by_the_mean_of_blocks(
    images: ImageLibrary, monkeypatch: pytest.MonkeyPatch, shape: tuple[int, int]
) -> None:
    pixels = painted(size=shape, channels=1)
    card = images.put(file_of(pixels[..., 0]), "bias_map")
    monkeypatch.setattr(image_maps, "SIDE", 40)
    monkeypatch.setattr(image_maps, "BAND", 7)
    image_maps._kept.cache_clear()
    made = image_texture(ImageReference(card.id, "bias_map")).image
    image_maps._kept.cache_clear()
    step = 1 if shape in {(33, 16), (1, 200)} else 2
    height, width = shape[0] // step, shape[1] // step
    blocks = pixels[: height * step, : width * step, 0].reshape(height, step, width, step).mean(axis=(1, 3))

    assert made.shape == (height, width, 1)
    assert np.abs(made[..., 0] - blocks).max() <= 0.5
