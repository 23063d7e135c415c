"""The paved court round the bath, its clipped hedge, and the lawn that runs out to the woods."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.scene import hills
from renderer.scene.masonry import slabs
from renderer.scene.mesh import Mesh, smooth_normals
from renderer.scene.mouldings import Path, facing, quads, swept
from renderer.scene.noise import Floats, grid_fbm, hashed, point_fbm, point_noise, smoothstep

Array = NDArray[np.float64]

GROUND = 1.0
"""Height of the paving, metres."""
HALF = 18.0
"""Half the side of the paved square."""
LAWN = 104.0
"""Radius of the lawn: there the hills' sheet has taken over."""
HILLS_DROP = 1.6
"""How much lower the country lies than ``hills`` has it."""
HEDGE_HEIGHT, HEDGE_HALF = 1.9, 0.75
"""Height over the ground and half the thickness of the hedge, metres."""
UNEVEN = 0.14
"""How far clipped leaves stand before or behind the plain shape, at most, metres."""
HEDGE_TILE = 2.6
YEW_TILE = 2.0

_STONE = np.array([0.265, 0.245, 0.21], np.float32)
_HEDGE = np.array([0.056, 0.082, 0.028])
_YEW = np.array([0.036, 0.056, 0.026])


def paving() -> Mesh:
    """The paved square, flat; uv runs once over it."""
    line = np.linspace(-1, 1, 7)
    x, z = np.meshgrid(line, line)
    position = np.stack([x * HALF, np.full_like(x, GROUND), z * HALF], axis=2).reshape(-1, 3)
    number = np.arange(49).reshape(7, 7)
    index = quads(number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    return facing(position, index, np.tile([0.0, 1.0, 0.0], (49, 1)), np.stack([x, z], axis=2).reshape(-1, 2) / 2 + 0.5)


def lawn(seed: int) -> Mesh:
    """The grass from under the hedge to the hills; uv runs once over its square."""
    turn = np.linspace(0, 2 * np.pi, 97)
    turn[-1] = 0.0
    direction = np.stack([np.sin(turn), -np.cos(turn)], axis=1)
    rows = np.concatenate([[0.0], np.linspace(0.02, 1, 15) ** 1.6])
    # The inner edge is the square's, the outer one round.
    square = (HALF + 0.2) / np.abs(direction).max(axis=1)
    away = square[None, :] + (LAWN - square)[None, :] * rows[:, None]
    place = away[..., None] * direction
    height = lawn_height(place[..., 0], place[..., 1], seed)
    position = np.stack([place[..., 0], height, place[..., 1]], axis=2).reshape(-1, 3)
    number = np.arange(away.size).reshape(away.shape)
    index = quads(number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]).astype(np.int64)
    uv = place.reshape(-1, 2) / (2 * LAWN) + 0.5
    normal = smooth_normals(position, index).astype(np.float64)
    return facing(position, index, normal * np.sign(normal[:, 1:2]), uv)


def lawn_height(x: Array, z: Array, seed: int) -> Array:
    """The lawn's height in metres at points of any shape: level near the court, one with the hills far out."""
    share = np.clip((np.hypot(x, z) - 42) / 36, 0, 1)
    share = share * share * (3 - 2 * share)
    far = hills.far_height(x, z, seed) - HILLS_DROP
    level = GROUND - 0.02
    height: Array = level + (far - level) * share
    return height


def paving_colors(size: int, seed: int) -> NDArray[np.uint8]:
    """The paving's colours, (size, size, 4): each slab its own, stained, greener at the hedge and damp at the bath."""
    texel = (np.arange(size, dtype=np.float64) + 0.5) / size * 2 * HALF - HALF
    number, _ = slabs(texel, texel, seed)
    pick = [hashed(seed + 3 + k, number) for k in range(3)]
    broad = grid_fbm(texel, texel, 6.0, seed + 11, octaves=5)
    fine = grid_fbm(texel, texel, 0.9, seed + 13, octaves=4, gain=0.6)
    x, z = np.meshgrid(np.abs(texel).astype(np.float32), np.abs(texel).astype(np.float32))
    square = np.maximum(x, z)
    tone = 0.80 + 0.36 * pick[0] + 0.07 * broad + 0.045 * fine
    warm = (pick[1] - np.float32(0.5))[..., None] * np.array([0.13, 0.0, -0.15], np.float32)
    color = _STONE * tone[..., None] * (1 + warm)
    rosy = (pick[2] > 0.86)[..., None]
    color = np.where(rosy, color * np.array([1.10, 0.95, 0.88], np.float32), color)
    moss = smoothstep(HALF - 4.5, HALF - 0.4, square + np.float32(1.6) * broad + np.float32(0.5) * fine)
    wall = smoothstep(1.5, 0.3, np.abs(np.meshgrid(texel, texel)[1] + 8.0).astype(np.float32) + broad + fine)
    moss = np.maximum(0.75 * moss, 0.55 * wall * (x < 9.9))
    color += (np.array([0.105, 0.125, 0.055], np.float32) - color) * (0.62 * moss)[..., None]
    damp = smoothstep(5.6, 4.1, square + np.float32(0.55) * broad + np.float32(0.30) * fine)
    near = smoothstep(4.75, 4.08, square)
    color *= (1 - 0.36 * damp - 0.22 * near)[..., None]
    return _packed(color, np.zeros((size, size), np.float32))


def lawn_colors(size: int, seed: int) -> NDArray[np.uint8]:
    """The lawn's colours, (size, size, 4): mown, with drifts of another green; wilder towards the woods."""
    texel = (np.arange(size, dtype=np.float64) + 0.5) / size * 2 * LAWN - LAWN
    broad = grid_fbm(texel, texel, 26.0, seed + 21, octaves=5)
    fine = grid_fbm(texel, texel, 2.6, seed + 23, octaves=3)
    x, z = np.meshgrid(texel.astype(np.float32), texel.astype(np.float32))
    wild = smoothstep(44.0, 74.0, np.sqrt(x * x + z * z) + np.float32(8) * broad)
    mown = np.array([0.078, 0.108, 0.036], np.float32)
    dry = np.array([0.118, 0.128, 0.050], np.float32)
    tall = np.array([0.066, 0.084, 0.030], np.float32)
    color = mown + (dry - mown) * smoothstep(-0.2, 1.1, broad)[..., None]
    color = color + (tall - color) * (0.8 * wild)[..., None]
    color *= (1 + 0.10 * fine)[..., None]
    return _packed(color, np.ones((size, size), np.float32))


def hedge(seed: int, *, is_plain: bool = False) -> Mesh:
    """The clipped hedge round the paving, its faces a little uneven; uv in metres.

    The plain one casts the other's shadow: it lies within it all over, or the hedge would shadow itself.
    """
    within = UNEVEN if is_plain else 0.0
    low, high, wide = GROUND - 0.1, GROUND + HEDGE_HEIGHT - within, HEDGE_HALF - within
    steps = 2 if is_plain else 7
    face = np.linspace(low, high - 0.25, steps)
    shoulder = [(-0.015, -0.14), (-0.06, -0.05), (-0.14, 0.0)]
    outer = [(wide, float(y)) for y in face] + [(wide + dx, high + dy) for dx, dy in shoulder]
    crown = [(float(x), high + 0.02) for x in np.linspace(wide - 0.3, 0.3 - wide, steps)]
    profile = [*outer, *crown, *[(-x, y) for x, y in outer[::-1]]]
    middle = HALF + 0.35
    path = Path((middle, middle), radius=0.25, arcs=2, pieces=4 if is_plain else 130)
    plain = swept(profile, path)
    position = plain.position.astype(np.float64)
    bump = 0.055 * point_fbm(position, 0.55, seed, octaves=3) + 0.07 * point_noise(position, 3.1, seed + 4)
    if not is_plain:
        position = position + plain.normal * np.clip(bump, -UNEVEN, UNEVEN)[:, None]
    return _leafy(plain, position, _HEDGE, (low, high), seed)


def yews(seed: int, places: Array, *, is_plain: bool = False) -> Mesh:
    """Clipped yews at (n, 2) places (x, z): tapering cones with rounded tops; uv in metres. Plain ones as a hedge's."""
    parts = []
    within = UNEVEN if is_plain else 0.0
    for number, (x, z) in enumerate(places):
        tall = 4.3 + 0.25 * float(hashed(seed, np.array([number]))[0]) - 2 * within
        height = np.linspace(0, 1, 9 if is_plain else 22)
        girth = 1.02 * (1 - height**1.15) ** 0.72 * (0.92 + 0.25 * np.clip(height / 0.06, 0, 1)) / 1.1
        girth = np.maximum(girth - within, 0)
        profile = [(float(r), float(GROUND - 0.05 + tall * h)) for r, h in zip(girth, height, strict=True)]
        plain = swept(profile, Path((0.0, 0.0), (float(x), float(z)), radius=np.inf, arcs=3 if is_plain else 5))
        position = plain.position.astype(np.float64)
        bump = 0.05 * point_fbm(position, 0.5, seed + 7, octaves=3) + 0.04 * point_noise(position, 1.2, seed + 9)
        bump *= np.clip(np.hypot(position[:, 0] - x, position[:, 2] - z) / 0.3, 0, 1)  # the tip stays closed
        if not is_plain:
            position = position + plain.normal * np.clip(bump, -UNEVEN, UNEVEN)[:, None]
        parts.append(_leafy(plain, position, _YEW, (GROUND, GROUND + tall), seed + number))
    return Mesh.merge(parts)


def _leafy(plain: Mesh, position: Array, green: Array, span: tuple[float, float], seed: int) -> Mesh:
    """Leaves: lighter at the tips that were not cut last, darker and browner at the foot."""
    drift = point_fbm(position, 2.4, seed + 31, octaves=3)
    tip = point_noise(position, 0.35, seed + 33)
    rise = np.clip((position[:, 1] - span[0]) / (span[1] - span[0]), 0, 1)
    color = green * (0.62 + 0.50 * rise + 0.16 * drift + 0.20 * tip)[:, None]
    color *= 1 + drift[:, None] * np.array([0.22, 0.02, 0.0])
    return Mesh.build(position, plain.index, normal=plain.normal, uv=plain.uv, color=np.clip(color, 0.004, 1))


def _packed(color: Floats, grass: Floats) -> NDArray[np.uint8]:
    """Linear rgb as roots, and which detail shows in alpha, in eight bits."""
    image = np.concatenate([np.sqrt(np.clip(color, 0, 1)), grass[..., None]], axis=2)
    return (image * 255 + 0.5).astype(np.uint8)
