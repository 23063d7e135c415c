"""The digest of all that decides a frame besides its request: sources, shaders, dependencies."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
"""The checkout: where renderer/, shaders/ and the lock stand."""
LOCK = "requirements.txt"


@cache
def source_digest() -> str:
    """SHA-256, 64 hex digits, of every source file of the renderer and the shaders and of the lock.

    Scene data is built by those sources from fixed seeds, so their digest covers it.
    """
    digest = hashlib.sha256()
    files = sorted([*(ROOT / "renderer").rglob("*.py"), *_shaders(), ROOT / LOCK])
    for path in files:
        if path.is_file():
            digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0")
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _shaders() -> list[Path]:
    return [p for p in (ROOT / "shaders").rglob("*") if p.suffix in {".vert", ".frag", ".comp", ".glsl"}]
