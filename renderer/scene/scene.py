"""A scene: what stands round the water, and what it sets for itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from renderer.scene.material import Material, Texture
from renderer.scene.mesh import Mesh


@dataclass(frozen=True, eq=False)
class SceneObject:
    """One mesh with one material.

    ``tags`` say what it is (``terrain``, ``tree``, ``jetty`` …); a technique may choose by them what
    enters a map. ``map_mesh`` is a cheaper level of detail for the maps and the shadows.
    """

    name: str
    mesh: Mesh
    material: Material
    tags: frozenset[str] = frozenset()
    casts_shadow: bool = True
    map_mesh: Mesh | None = None
    in_maps: bool = True
    """False where the object is too small to be seen in a reflection."""
    detail_distance: float = math.inf
    """Metres from the eye beyond which ``map_mesh`` serves in the picture itself too."""


@dataclass(frozen=True, eq=False)
class Scene:
    """The world without its water."""

    name: str
    objects: tuple[SceneObject, ...]
    textures: Mapping[str, Texture] = field(default_factory=dict)

    @property
    def triangles(self) -> int:
        """How many triangles the full level of detail has."""
        return sum(len(part.mesh.index) for part in self.objects)
