"""Trees and shrubs: trunk and branches as tubes, leaves as clusters on tight alpha-tested cards.

    tree(kind, seed, *, height=None) -> TreeMeshes(trunk, leaves, trunk_far, leaves_far)   at the origin
        kind: one of ``species.SPECIES``
    forest(seed, places, kinds, heights=None) -> TreeMeshes  many trees in one; places (n, 3) ground
    shrubs(seed, places, *, size=1.3, detail="full") -> Mesh bushes (LEAVES)
    far_trees(seed, places, names, heights) -> Mesh          whole trees painted on one card each (LEAVES)
    far_casters(seed, places, names, heights) -> Mesh        what casts the shadows of those
    belt(seed, places, *, height=9.0) -> Mesh                a far wood's edge of such cards

Materials: trunk ``leaves.BARK``, all else ``leaves.LEAVES``. Cards face the origin more or less and
are sorted from the origin outwards, because every camera stands near the pond: draw the objects
near to far too, then most hidden leaves fail the early depth test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray

from renderer.scene import leaves
from renderer.scene.crowns import Array, Crown, Detail, grow
from renderer.scene.mesh import Mesh
from renderer.scene.portraits import STRETCH
from renderer.scene.species import Kind

FURROWED, BIRCH_BARK = (0.03, 0.47), (0.53, 0.97)
"""The two halves of the bark texture in u."""
BEHIND = 1.6
"""How far behind a portrait its shadow's caster stands, metres."""
FOOT = 0.02
"""Share of a portrait's cell that stands in the ground."""
FAN = np.array([[0, k, k + 1] for k in range(1, 7)])
"""The triangles of an octagon."""


@dataclass(frozen=True, eq=False)
class TreeMeshes:
    """A tree or a wood: wood (BARK) and leaves (LEAVES), each in two levels of detail."""

    trunk: Mesh
    leaves: Mesh
    trunk_far: Mesh
    leaves_far: Mesh

    @classmethod
    def merge(cls, trees: Sequence[TreeMeshes]) -> TreeMeshes:
        """Join trees; their order is kept, so put the nearest to the pond first."""
        parts = ("trunk", "leaves", "trunk_far", "leaves_far")
        return cls(*(Mesh.merge([getattr(tree, part) for tree in trees]) for part in parts))

    def transformed(self, world_from_local: NDArray[np.floating]) -> TreeMeshes:
        """Move the tree by a 4×4 affine matrix."""
        parts = (self.trunk, self.leaves, self.trunk_far, self.leaves_far)
        return TreeMeshes(*(part.transformed(world_from_local) for part in parts))


def tree(kind: Kind, seed: int, *, height: float | None = None) -> TreeMeshes:
    """One tree at the origin, its better side towards +z; ``height`` in metres."""
    near, far = (grow(kind, seed, height=height, detail=detail) for detail in ("full", "map"))
    return TreeMeshes(
        trunk=wood(near, kind, sides=6),
        leaves=cards(near),
        trunk_far=wood(far, kind, sides=3),
        leaves_far=cards(far),
    )


def placed(trees: TreeMeshes, at: Array, *, turn: float = 0.0) -> TreeMeshes:
    """Stand a tree on a ground point (3,), its better side towards the origin, ``turn`` radians off."""
    heading = np.arctan2(-at[0], -at[2]) + turn
    c, s = np.cos(heading), np.sin(heading)
    matrix = np.array([[c, 0, s, at[0]], [0, 1, 0, at[1]], [-s, 0, c, at[2]], [0, 0, 0, 1.0]])
    return trees.transformed(matrix)


def forest(seed: int, places: Array, kinds: Sequence[Kind], heights: Array | None = None) -> TreeMeshes:
    """Many trees in one, nearest to the origin first; ``places`` (n, 3) ground points, ``heights`` (n,) metres."""
    rng = Generator(PCG64([seed, 51]))
    turns, seeds = rng.normal(0, 0.3, len(places)), rng.integers(0, 2**31, len(places))
    order = np.argsort(np.hypot(places[:, 0], places[:, 2]), kind="stable")
    grown = []
    for k in order:
        height = None if heights is None else float(heights[k])
        grown.append(placed(tree(kinds[k], int(seeds[k]), height=height), places[k] - [0, 0.12, 0], turn=turns[k]))
    return TreeMeshes.merge(grown)


def shrubs(seed: int, places: Array, *, size: float = 1.3, detail: Detail = "full") -> Mesh:
    """Bushes without visible wood, ``size`` metres high, nearest to the origin first."""
    rng = Generator(PCG64([seed, 52]))
    heights, seeds = size * rng.uniform(0.65, 1.3, len(places)), rng.integers(0, 2**31, len(places))
    parts = []
    for k in np.argsort(np.hypot(places[:, 0], places[:, 2]), kind="stable"):
        mesh = cards(grow("shrub", int(seeds[k]), height=float(heights[k]), detail=detail))
        lone = TreeMeshes(mesh, mesh, mesh, mesh)
        parts.append(placed(lone, places[k] - [0, 0.08, 0]).leaves)
    return Mesh.merge(parts)


def far_trees(seed: int, places: Array, names: Sequence[str], heights: Array) -> Mesh:
    """Trees as portraits: one octagon each that faces the origin, nearest first.

    ``names`` are portraits of ``leaves.PORTRAITS``; ``heights`` (n,) metres.
    """
    rng = Generator(PCG64([seed, 53]))
    order = np.argsort(np.hypot(places[:, 0], places[:, 2]), kind="stable")
    places, chosen = places[order], np.array(names)[order]
    count = len(places)
    width = np.where(np.char.startswith(chosen, "thicket"), STRETCH, 1.0)
    mirrored = rng.choice([-1.0, 1.0], count)
    hulls = np.stack([leaves.hull(name) for name in chosen])
    tall = heights[order] / (hulls[..., 1].max(axis=1) - FOOT)
    local = (hulls - [0.5, FOOT]) * tall[:, None, None]
    facing = -places * [1.0, 0.0, 1.0]
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    right = np.stack([facing[:, 2], np.zeros(count), -facing[:, 0]], axis=1) * (width * mirrored)[:, None]
    position = places[:, None] + local[..., :1] * right[:, None] + local[..., 1:] * [0.0, 1.0, 0.0]
    outward = (position - places[:, None]) / tall[:, None, None] - [0, 0.45, 0]
    normal = facing[:, None] * 0.8 + 1.3 * outward + [0.0, 0.25, 0.0]
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    hue, shade = rng.normal(0, 0.04, count), rng.uniform(0.88, 1.12, count)
    tint = np.stack([1 + 1.5 * hue, 1 + 0.3 * hue, 1 - hue], axis=1) * shade[:, None]
    color = np.concatenate([np.repeat(tint[:, None], 8, axis=1), np.zeros((count, 8, 1))], axis=2)
    uv = np.stack([leaves.at(name, leaves.hull(name)) for name in chosen])
    triangles = np.where(mirrored[:, None, None] > 0, FAN, FAN[:, ::-1])
    return joined_cards(position, normal, uv, color, triangles)


def far_casters(seed: int, places: Array, names: Sequence[str], heights: Array) -> Mesh:
    """What may cast the shadows of ``far_trees``: the same portraits, ``BEHIND`` metres farther out.

    A card that the sun sees edge-on lies within its own shadow's texels and would turn black, so it must
    not cast one itself.
    """
    away = np.hypot(places[:, 0], places[:, 2])[:, None]
    return far_trees(seed, places * (1 + BEHIND / away * [1.0, 0.0, 1.0]), names, heights)


def belt(seed: int, places: Array, *, height: float = 9.0) -> Mesh:
    """A far wood's edge: thickets, and now and then a single tree, as ``far_trees``."""
    rng = Generator(PCG64([seed, 54]))
    names = rng.choice(["thicket0", "thicket1", "far_oak", "far_spruce"], len(places), p=[0.4, 0.4, 0.1, 0.1])
    return far_trees(seed, places, names.tolist(), height * rng.uniform(0.75, 1.25, len(places)))


def cards(crown: Crown) -> Mesh:
    """The leaf clusters as octagons, bowed a little, nearest to +z first."""
    order = np.argsort(-crown.centre[:, 2], kind="stable")
    species = crown.species
    hulls = np.stack([leaves.hull(name) for name in species.cells])[crown.cell[order]]
    local = hulls - 0.5
    if species.hanging:
        local = local - [0.0, 0.25]
    right, up = _frames(crown.facing[order], crown.roll[order])
    side = crown.side[order][:, None, None]
    across = local[..., :1] * side
    along = local[..., 1:] * side * species.tall
    facing = crown.facing[order][:, None]
    bow = 0.55 * (across**2 + (0 if species.hanging else along**2)) / side
    offset = across * right[:, None] + along * up[:, None] - bow * facing
    position = crown.centre[order][:, None] + offset
    normal = crown.normal[order][:, None] + 0.55 * offset / side
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    uv = np.stack([leaves.at(name, leaves.hull(name)) for name in species.cells])[crown.cell[order]]
    count, corners = local.shape[:2]
    color = np.concatenate([crown.shade[order], np.full((count, 1), 0.0)], axis=1)
    height = np.clip(position[..., 1] / max(float(position[..., 1].max()), 1e-6), 0, 1)
    color = np.repeat(color[:, None], corners, axis=1)
    color[..., 3] = 0.35 * height**2
    return joined_cards(position, normal, uv, color, FAN)


def wood(crown: Crown, kind: Kind, *, sides: int) -> Mesh:
    """Trunk and boughs as tapering tubes; boughs have three sides."""
    half = BIRCH_BARK if kind == "birch" else FURROWED
    parts = []
    for rank, (path, radii) in enumerate(crown.wood if sides > 3 else crown.wood[:4]):
        parts.append(tube(path, radii, sides if rank == 0 else 3, half))
    mesh = Mesh.merge(parts)
    inside = 1 - 0.45 * np.clip(mesh.position[:, 1] / max(float(mesh.position[:, 1].max()), 1e-6), 0, 1)
    color = np.concatenate([inside[:, None] * np.array(crown.species.bark), np.zeros((len(inside), 1))], axis=1)
    return Mesh.build(mesh.position, mesh.index, normal=mesh.normal, uv=mesh.uv, color=color)


def tube(path: Array, radii: Array, sides: int, u: tuple[float, float]) -> Mesh:
    """An open tube along ``path`` (k, 3); ``u`` runs there and back round it, v in units of 1.5 metres."""
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, [0.31, 0.17, 0.93])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    third = np.cross(along, side)
    turn = np.linspace(0, 2 * np.pi, sides + 1)
    ring = np.cos(turn)[:, None] * side[:, None] + np.sin(turn)[:, None] * third[:, None]
    position = path[:, None] + ring * radii[:, None, None]
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    there_and_back = 1 - np.abs(np.linspace(-1, 1, sides + 1))
    uv = np.stack(np.broadcast_arrays(u[0] + (u[1] - u[0]) * there_and_back, length[:, None] / 1.5), axis=-1)
    k = np.arange(len(path) - 1)[:, None] * (sides + 1) + np.arange(sides)
    quads = np.stack([k, k + 1, k + sides + 2, k, k + sides + 2, k + sides + 1], axis=-1)
    return Mesh.build(position.reshape(-1, 3), quads.reshape(-1, 3), normal=ring.reshape(-1, 3), uv=uv.reshape(-1, 2))


def joined_cards(position: Array, normal: Array, uv: Array, color: Array, triangles: NDArray[np.int64]) -> Mesh:
    """One mesh of n convex cards of k corners; all arrays (n, k, …), ``triangles`` a fan or one for each."""
    index = (np.arange(len(position)) * position.shape[1])[:, None, None] + triangles
    return Mesh.build(
        position.reshape(-1, 3),
        index.reshape(-1, 3),
        normal=normal.reshape(-1, 3),
        uv=uv.reshape(-1, 2),
        color=color.reshape(-1, 4),
    )


def _frames(facing: Array, roll: Array) -> tuple[Array, Array]:
    """Right and up (n, 3) of cards that face ``facing``, turned by ``roll`` in their plane."""
    right = np.cross([0.0, 1.0, 0.0], facing)
    right /= np.maximum(np.linalg.norm(right, axis=1, keepdims=True), 1e-6)
    up = np.cross(facing, right)
    c, s = np.cos(roll)[:, None], np.sin(roll)[:, None]
    return c * right + s * up, c * up - s * right
