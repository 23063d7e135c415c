"""Baked scenes on disk: built once for each version of their sources, read by every process after that.

A bake is one uncompressed ``.npz``; its members carry checksums. What is damaged, short or foreign is
built anew. Writers take a lock, so that processes that start together build once, and they rename a
finished file into place, so that a reader never sees half a one.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.scene.material import Material, Texture
from renderer.scene.mesh import Mesh
from renderer.scene.scene import Scene, SceneObject

Arrays = Mapping[str, NDArray[Any]]

VERSIONS_KEPT = 3
"""Bakes of one scene that stay on disk: those of a few checkouts side by side."""

_VERTEX_PARTS = {"position": np.float32, "normal": np.float32, "uv": np.float32, "color": np.float16}
_DAMAGE = (OSError, ValueError, KeyError, EOFError, AttributeError, zipfile.BadZipFile)


def cache_directory() -> Path:
    """Where bakes are kept: ``MILLPOND_CACHE``, else ``millpond`` in the user's cache."""
    chosen = os.environ.get("MILLPOND_CACHE")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "millpond"


def source_key(sources: Iterable[Path], *facts: object) -> str:
    """A digest of source files and of whatever else decides a bake: its seed, NumPy's version."""
    digest = hashlib.sha256(repr((np.__version__, *facts)).encode())
    for path in sorted(sources):
        digest.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:24]


def baked_scene(name: str, key: str, directory: Path, build: Callable[[], Scene]) -> Scene:
    """The scene from ``directory``, or built and put there; where nothing can be written, just built."""
    path = directory / f"{name}-{key}.npz"
    found = _read(path)
    if found is not None:
        return found
    with contextlib.ExitStack() as stack:
        try:
            directory.mkdir(parents=True, exist_ok=True)
            stack.enter_context(_locked(directory / f"{name}.lock"))
        except OSError:
            return build()
        found = _read(path)
        if found is not None:
            return found
        scene = build()
        with contextlib.suppress(OSError):
            _write(path, packed(scene))
            _forget_old(directory, name)
    return scene


def packed(scene: Scene) -> dict[str, NDArray[Any]]:
    """The scene as a few large arrays and one JSON description."""
    meshes: list[Mesh] = []
    objects = []
    for part in scene.objects:
        numbers = [len(meshes)]
        meshes.append(part.mesh)
        if part.map_mesh is not None:
            numbers.append(len(meshes))
            meshes.append(part.map_mesh)
        objects.append(
            {
                "name": part.name,
                "meshes": numbers,
                "material": asdict(part.material),
                "tags": sorted(part.tags),
                "casts_shadow": part.casts_shadow,
                "in_maps": part.in_maps,
                "detail_distance": part.detail_distance,
            },
        )
    textures = [
        {
            "name": key,
            "texture": texture.name,
            "is_srgb": texture.is_srgb,
            "wrap": texture.wrap,
            "mipmaps": texture.mipmaps,
            "blends_mipmaps": texture.blends_mipmaps,
        }
        for key, texture in scene.textures.items()
    ]
    about = json.dumps({"name": scene.name, "objects": objects, "textures": textures})
    every = Mesh.merge(meshes)
    arrays: dict[str, NDArray[Any]] = {
        "about": np.frombuffer(about.encode(), np.uint8),
        "sizes": np.array([(len(mesh.position), len(mesh.index)) for mesh in meshes], np.int64).reshape(-1, 2),
        "index": np.concatenate([mesh.index for mesh in meshes] or [every.index]),
    }
    arrays |= {part: getattr(every, part).astype(kind) for part, kind in _VERTEX_PARTS.items()}
    arrays |= {f"texture{number}": part.image for number, part in enumerate(scene.textures.values())}
    return arrays


def unpacked(arrays: Arrays) -> Scene:
    """The scene that :func:`packed` described. Raises ``ValueError`` or ``KeyError`` for what is no such thing."""
    about = json.loads(arrays["about"].tobytes())
    vertex_end, index_end = (np.cumsum(column).tolist() for column in arrays["sizes"].T)
    vertices = {part: arrays[part].astype(np.float32, copy=False) for part in _VERTEX_PARTS}
    meshes = []
    for number in range(len(vertex_end)):
        span = slice(vertex_end[number - 1] if number else 0, vertex_end[number])
        faces = slice(index_end[number - 1] if number else 0, index_end[number])
        meshes.append(Mesh(**{part: array[span] for part, array in vertices.items()}, index=arrays["index"][faces]))
    objects = tuple(
        SceneObject(
            name=part["name"],
            mesh=meshes[part["meshes"][0]],
            material=Material(**{**part["material"], "albedo": tuple(part["material"]["albedo"])}),
            tags=frozenset(part["tags"]),
            casts_shadow=part["casts_shadow"],
            map_mesh=meshes[part["meshes"][1]] if len(part["meshes"]) > 1 else None,
            in_maps=part["in_maps"],
            detail_distance=part["detail_distance"],
        )
        for part in about["objects"]
    )
    textures = {
        part["name"]: Texture(
            part["texture"],
            arrays[f"texture{number}"],
            is_srgb=part["is_srgb"],
            wrap=part["wrap"],
            mipmaps=part["mipmaps"],
            blends_mipmaps=part["blends_mipmaps"],
        )
        for number, part in enumerate(about["textures"])
    }
    return Scene(about["name"], objects, textures)


def _read(path: Path) -> Scene | None:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as members:
            return unpacked({name: members[name] for name in members.files})
    except _DAMAGE:
        return None


def _write(path: Path, arrays: Arrays) -> None:
    handle, temporary = tempfile.mkstemp(prefix=f".{path.stem}-", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, allow_pickle=False, **dict(arrays))
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _forget_old(directory: Path, name: str) -> None:
    versions = sorted(directory.glob(f"{name}-*.npz"), key=lambda path: path.stat().st_mtime)
    for path in versions[:-VERSIONS_KEPT]:
        path.unlink(missing_ok=True)


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
