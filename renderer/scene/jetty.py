"""A wooden jetty: boards on beams on posts, grey with age and none quite straight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.scene.mesh import Mesh
from renderer.scene.noise import scattered

Array = NDArray[np.float64]
HeightAt = Callable[[Array, Array], Array]

TILE = 1.6
"""Length of wood that one tile of its texture shows, metres."""

_WOOD = np.array([0.245, 0.205, 0.165])
_ALGAE = np.array([0.050, 0.058, 0.024])

_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


@dataclass(frozen=True)
class Jetty:
    """Where a jetty runs: from the bank to its head, (x, z) metres."""

    foot: tuple[float, float]
    head: tuple[float, float]
    width: float = 1.5
    deck: float = 0.46
    """Height of the boards' top over the water."""
    head_width: float = 2.9
    head_length: float = 2.3
    seed: int = 0

    @property
    def body(self) -> float:
        """Metres from the foot to where the head begins."""
        return self.length - self.head_length

    @property
    def length(self) -> float:
        """Metres from foot to head."""
        return float(np.hypot(self.head[0] - self.foot[0], self.head[1] - self.foot[1]))

    @property
    def along(self) -> Array:
        """Unit vector (x, z) from foot to head."""
        step: Array = np.array(self.head) - np.array(self.foot)
        return step / self.length

    def places(self, along: Array, across: Array) -> Array:
        """World (n, 2) of distances along the jetty and to its right."""
        forward = self.along
        right = np.array([-forward[1], forward[0]])
        places: Array = np.array(self.foot) + along[:, None] * forward + across[:, None] * right
        return places


@dataclass(frozen=True, eq=False)
class Board:
    """A piece of sawn wood: where its middle is, measured along the jetty, and how it lies."""

    along: float
    across: float
    height: float
    half: tuple[float, float, float]
    """Half extents along its grain, upwards and across, metres."""
    color: Array
    offset: float
    """Where in the wood's texture it was cut, 0 to 1."""
    turn: float = 0.0
    """Degrees from the jetty's direction."""
    roll: float = 0.0
    """Degrees about its grain."""


def timber(jetty: Jetty, height_at: HeightAt) -> Mesh:
    """The whole jetty as one mesh."""
    return Mesh.merge([_boards(jetty), _beams(jetty), _posts(jetty, height_at)])


def plain(jetty: Jetty, height_at: HeightAt) -> Mesh:
    """The jetty for the maps: two slabs in place of the boards."""
    top = jetty.deck - 0.02
    slabs = [
        Board(jetty.body / 2, 0.0, top, (jetty.body / 2, 0.02, jetty.width / 2), _WOOD, 0.0),
        Board(
            jetty.length - jetty.head_length / 2,
            0.0,
            top,
            (jetty.head_length / 2, 0.02, jetty.head_width / 2),
            _WOOD,
            0.0,
        ),
    ]
    return Mesh.merge([*(_box(jetty, slab) for slab in slabs), _beams(jetty), _posts(jetty, height_at)])


def _boards(jetty: Jetty) -> Mesh:
    pitch = 0.152
    random = scattered(jetty.seed, int(jetty.length / pitch), 8)
    boards = []
    for number, value in enumerate(random):
        place = (number + 0.5) * pitch
        is_head = place > jetty.body
        if value[7] < 0.025 and not is_head and number > 4:
            continue
        half = (jetty.head_width if is_head else jetty.width) / 2
        half += 0.05 * (value[0] - 0.5) + (0.07 if value[6] > 0.93 else 0.0)
        shade = 0.78 + 0.42 * value[1]
        warm = np.array([1.05, 1.0, 0.93]) if value[2] > 0.6 else np.array([0.98, 1.0, 1.03])
        board = Board(
            along=place + 0.012 * (value[3] - 0.5),
            across=0.03 * (value[4] - 0.5),
            height=jetty.deck - 0.018 + 0.008 * (value[5] - 0.5),
            half=(half, 0.018, 0.068 + 0.004 * (value[0] - 0.5)),
            color=_WOOD * shade * warm,
            offset=value[2],
            turn=90.0 + 1.6 * (value[6] - 0.5),
            roll=0.9 * (value[1] - 0.5),
        )
        boards.append(_box(jetty, board))
    return Mesh.merge(boards)


def _beams(jetty: Jetty) -> Mesh:
    low = jetty.deck - 0.036 - 0.07
    dark = _WOOD * 0.72
    middle, half = jetty.length / 2, jetty.length / 2 - 0.03
    head, half_head = (jetty.body + jetty.length) / 2, jetty.head_length / 2 - 0.03
    beams = []
    for side in (-1, 1):
        beams += [
            Board(middle, side * (jetty.width / 2 - 0.16), low, (half, 0.07, 0.04), dark, 0.3),
            Board(head, side * (jetty.head_width / 2 - 0.14), low, (half_head, 0.07, 0.04), dark, 0.6),
        ]
    for place in _bays(jetty):
        reach = (jetty.head_width if place > jetty.body else jetty.width) / 2 + 0.02
        beams.append(Board(place + 0.1, 0.0, low - 0.12, (reach, 0.055, 0.035), dark, 0.8, turn=90.0))
    return Mesh.merge([_box(jetty, beam) for beam in beams])


def _bays(jetty: Jetty) -> list[float]:
    inner = np.arange(0.5, jetty.body - 0.4, 2.05)
    return [*inner.tolist(), jetty.body + 0.22, jetty.length - 0.2]


def _posts(jetty: Jetty, height_at: HeightAt) -> Mesh:
    posts = []
    for number, place in enumerate(_bays(jetty)):
        for side in (-1, 1):
            value = scattered(jetty.seed + 31 * number + side, 1, 6)[0]
            half = (jetty.head_width if place > jetty.body else jetty.width) / 2 + 0.07
            spot = jetty.places(np.array([place]), np.array([side * half]))
            ground = float(height_at(spot[:, 0], spot[:, 1])[0])
            is_tall = place > jetty.body or value[0] > 0.55
            top = jetty.deck + (0.30 + 0.42 * value[1] if is_tall else -0.03 + 0.06 * value[1])
            posts.append(_post(spot[0], ground - 0.3, top, 0.075 + 0.02 * value[2], value))
    return Mesh.merge(posts)


def _post(spot: Array, low: float, top: float, radius: float, value: Array) -> Mesh:
    sides = 8
    lift = np.array([low, min(-0.12, top - 0.2), 0.05, 0.14, top - 0.02, top])
    lift = np.maximum.accumulate(np.maximum(lift, low))
    girth = radius * np.array([1.06, 1.02, 0.97, 1.0, 0.97, 0.80])
    turn = np.arange(sides + 1) * (2 * np.pi / sides)
    lean = 0.035 * (value[3:5] - 0.5)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    bent = spot + (lift - top)[:, None] * lean
    place = bent[:, None, :] + girth[:, None, None] * ring[None]
    position = np.concatenate(
        [place[..., :1], np.broadcast_to(lift[:, None, None], (*place.shape[:2], 1)), place[..., 1:]],
        axis=2,
    )
    normal = np.broadcast_to(np.stack([ring[:, 0], 0 * turn, ring[:, 1]], axis=1), position.shape)
    uv = np.stack(np.broadcast_arrays(lift[:, None], turn[None] * radius + TILE * value[5]), axis=2)
    wide = sides + 1
    at = np.arange(len(lift) - 1)[:, None] * wide + np.arange(sides)
    index = np.concatenate(
        [
            np.stack([at, at + wide, at + 1], 2).reshape(-1, 3),
            np.stack([at + 1, at + wide, at + wide + 1], 2).reshape(-1, 3),
        ],
    )
    cap = position[-1, :-1]
    fan = np.stack([np.zeros(sides - 2, int), np.arange(2, sides), np.arange(1, sides - 1)], axis=1)
    every = np.concatenate([position.reshape(-1, 3), cap])
    base = _WOOD * (0.72 + 0.25 * value[2])
    color = np.concatenate([_weathered(position.reshape(-1, 3), base), np.tile(base * 1.15, (sides, 1))])
    return Mesh.build(
        every,
        np.concatenate([index, fan + wide * len(lift)]),
        normal=np.concatenate([normal.reshape(-1, 3), np.tile([0.0, 1.0, 0.0], (sides, 1))]),
        uv=np.concatenate([uv.reshape(-1, 2), cap[:, [0, 2]]]),
        color=color,
    )


def _weathered(position: Array, base: Array) -> Array:
    """Wood dark where it is wet and green where it is always under water."""
    above = position[:, 1]
    wet = np.clip(1 - (above - 0.03) / 0.14, 0, 1)
    under = np.clip((0.02 - above) / 0.16, 0, 1)
    color = np.tile(base, (len(position), 1)) * (1 - 0.5 * wet)[:, None]
    return color + (_ALGAE - color) * (0.8 * under)[:, None]


def _box(jetty: Jetty, board: Board) -> Mesh:
    """A board with its six sides; textured along its grain."""
    corner = _CORNERS * np.array(board.half)
    tilt, yaw = np.radians([board.roll, board.turn])
    corner = corner @ np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]])
    forward = jetty.along
    ahead = forward * np.cos(yaw) + np.array([-forward[1], forward[0]]) * np.sin(yaw)
    beside = np.array([-ahead[1], ahead[0]])
    middle = jetty.places(np.array([board.along]), np.array([board.across]))[0]
    flat = middle + corner[:, :1] * ahead + corner[:, 2:] * beside
    position = np.stack([flat[:, 0], board.height + corner[:, 1], flat[:, 1]], axis=1)
    faces = position[_SIDES]
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 3] - faces[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    local = (_CORNERS * np.array(board.half))[_SIDES]
    is_side = np.arange(6) // 2
    v = np.where((is_side == 1)[:, None], local[..., 2], local[..., 1])
    u = np.where((is_side == 0)[:, None], local[..., 2] * 0.2, local[..., 0])
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    index = (np.arange(6)[:, None, None] * 4 + quad).reshape(-1, 3)
    shade = np.where(is_side == 0, 0.7, 1.0) * np.where((is_side == 1) & (normal[:, 1] < 0), 0.45, 1.0)
    tint = np.repeat(shade, 4)[:, None] * board.color
    return Mesh.build(
        faces.reshape(-1, 3),
        index,
        normal=np.repeat(normal, 4, axis=0),
        uv=np.stack([u + board.offset * 5.9, v + board.offset * TILE], axis=2).reshape(-1, 2),
        color=tint,
    )
