"""A scene's card in the catalogue."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from renderer.scene.scene import Scene


@dataclass(frozen=True)
class SceneEntry:
    """What the catalogue knows of a scene without loading it."""

    name: str
    title: str
    summary: str
    water_level: float
    """Metres."""
    water_extents: tuple[float, float, float, float]
    """``[x0, x1, z0, z1]``, metres."""
    centre: tuple[float, float, float]
    """What a turntable turns about, where the camera names nothing, metres."""
    own: Mapping[str, Any]
    """The request fields that the scene sets for itself, as a request gives them: ``camera``, ``sun``,
    ``ambient``, ``sky``, ``fog``."""
    load: Callable[[], Scene]
    """Builds the scene, or reads its baked data from the cache."""
    shadow_radius: float = 46.0
    """Metres round the centre within which things cast and receive shadows; the shadows' detail falls with it."""
