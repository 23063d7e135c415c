"""Bakes on disk: what is read is what was built, damage is healed, processes build once."""

from __future__ import annotations

import math
import multiprocessing
import time
from pathlib import Path

import numpy as np
import pytest

from renderer.scene import bake
from renderer.scene.material import Material, Texture
from renderer.scene.mesh import Mesh
from renderer.scene.scene import Scene, SceneObject


def small_scene(bend: float = 0.0) -> Scene:
    """Two triangles, one with a level of detail, and two textures."""
    mesh = Mesh.build(np.array([[0, 0, 0], [1, bend, 0], [0, 0, 1.0]]), np.array([[0, 2, 1]]))
    stone = Material("stone", albedo=(0.5, 0.25, 1.0), detail_map="grain", detail_tile=0.7)
    leaf = Material("leaf", "foliage", albedo_map="leaf", alpha_cutoff=0.5, is_two_sided=True, translucency=0.4)
    return Scene(
        "small",
        (
            SceneObject("one", mesh, stone, frozenset({"rock", "terrain"}), map_mesh=mesh.transformed(2 * np.eye(4))),
            SceneObject("two", mesh, leaf, casts_shadow=False, in_maps=False, detail_distance=7.0),
        ),
        {
            "grain": Texture("grain", np.arange(64, dtype=np.uint8).reshape(4, 4, 4)),
            "leaf": Texture("leaf", np.ones((2, 2, 4), np.float32), is_srgb=True, wrap="clamp", mipmaps="coverage"),
        },
    )


def same(one: Scene, two: Scene) -> bool:
    """Whether two scenes hold the same objects and textures."""
    arrays = bake.packed(one), bake.packed(two)
    return arrays[0].keys() == arrays[1].keys() and all(np.array_equal(arrays[0][k], arrays[1][k]) for k in arrays[0])


def refuse() -> Scene:
    """A builder that must not be called."""
    raise AssertionError("built, though the bake was there")


def test_what_is_read_is_what_was_built(tmp_path: Path) -> None:
    built = bake.baked_scene("small", "k", tmp_path / "new", small_scene)
    read = bake.baked_scene("small", "k", tmp_path / "new", refuse)
    assert same(built, read)
    assert [part.material for part in read.objects] == [part.material for part in built.objects]
    assert [part.tags for part in read.objects] == [part.tags for part in built.objects]
    assert [part.detail_distance for part in read.objects] == [math.inf, 7.0]
    assert read.objects[1].map_mesh is None
    assert read.textures["leaf"].mipmaps == "coverage"
    assert read.textures["leaf"].image.dtype == np.float32


def test_another_key_is_another_bake(tmp_path: Path) -> None:
    bake.baked_scene("small", "a", tmp_path, small_scene)
    other = bake.baked_scene("small", "b", tmp_path, lambda: small_scene(0.5))
    assert not same(other, bake.baked_scene("small", "a", tmp_path, refuse))


@pytest.mark.parametrize("damage", ["truncated", "flipped", "empty", "foreign"])
def test_a_damaged_bake_is_built_anew(tmp_path: Path, damage: str) -> None:
    bake.baked_scene("small", "k", tmp_path, small_scene)
    path = tmp_path / "small-k.npz"
    whole = path.read_bytes()
    at = whole.index(bytes(range(64)))
    spoilt = {
        "truncated": whole[: len(whole) // 2],
        "flipped": whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :],
        "empty": b"",
        "foreign": b"not a bake at all",
    }
    path.write_bytes(spoilt[damage])

    healed = bake.baked_scene("small", "k", tmp_path, small_scene)

    assert same(healed, small_scene())
    assert same(bake.baked_scene("small", "k", tmp_path, refuse), healed)


def test_where_nothing_can_be_written_the_scene_is_built(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("no directory")
    assert same(bake.baked_scene("small", "k", blocked / "cache", small_scene), small_scene())


def test_old_bakes_go_and_nothing_temporary_stays(tmp_path: Path) -> None:
    for key in "abcdef":
        bake.baked_scene("small", key, tmp_path, small_scene)
        time.sleep(0.01)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"small.lock", "small-d.npz", "small-e.npz", "small-f.npz"}


def test_processes_that_start_together_build_once(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=_bake_slowly, args=(tmp_path,)) for _ in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
    assert [worker.exitcode for worker in workers] == [0, 0, 0]
    assert len(list(tmp_path.glob("built-*"))) == 1


def test_the_key_knows_sources_and_facts(tmp_path: Path) -> None:
    source = tmp_path / "a.py"
    source.write_text("one")
    first = bake.source_key([source], 1)
    assert bake.source_key([source], 2) != first
    source.write_text("two")
    assert bake.source_key([source], 1) != first


def test_the_directory_is_the_settings_or_the_users_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    monkeypatch.delenv("MILLPOND_CACHE", raising=False)
    assert bake.cache_directory() == Path("/somewhere/millpond")
    monkeypatch.setenv("MILLPOND_CACHE", "/elsewhere")
    assert bake.cache_directory() == Path("/elsewhere")


def _bake_slowly(directory: Path) -> None:
    def build() -> Scene:
        (directory / f"built-{multiprocessing.current_process().pid}").touch()
        time.sleep(1.0)
        return small_scene()

    assert same(bake.baked_scene("small", "k", directory, build), small_scene())
