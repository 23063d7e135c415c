"""The built-in scenes by name, cheap to import: what a scene sets for itself, and how to load it."""

from __future__ import annotations

from renderer.scene.bath import ENTRY as BATH
from renderer.scene.entry import SceneEntry
from renderer.scene.lake import ENTRY as LAKE
from renderer.scene.pond import ENTRY as POND

SCENES: dict[str, SceneEntry] = {entry.name: entry for entry in (POND, LAKE, BATH)}
DEFAULT = "pond"
