"""A height field as tiles of adaptive triangles, at any level of detail.

The grid is square and its axes are warped: fine in the middle, coarse far out, so that one grid (and
one texture) covers the near shore in centimetres and the horizon in decimetres. The triangles are a
right-triangulated irregular network (Evans, Kirkpatrick and Townsend 2001, "Right-triangulated
irregular networks"): a triangle is split at the middle of its longest edge where the ground strays
from it. An error that bounds its children's makes every threshold crack-free by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from renderer.scene.mesh import Mesh
from renderer.scene.noise import Floats


@dataclass(frozen=True)
class Axis:
    """A warped axis: ``count`` samples from -reach to +reach metres, finest within ``core`` of 0.

    A parameter s from -1 to 1 stands for the coordinate ``core * sinh(bend * s)``.
    """

    count: int
    reach: float = 96.0
    core: float = 14.0

    @property
    def bend(self) -> float:
        """What the parameter is multiplied with inside the hyperbolic sine."""
        return float(np.arcsinh(self.reach / self.core))

    @cached_property
    def world(self) -> NDArray[np.float64]:
        """The samples' coordinates, metres."""
        return self.at(np.linspace(-1.0, 1.0, self.count))

    @property
    def spacing(self) -> Floats:
        """The distance between neighbours at each sample, metres."""
        return np.gradient(self.world).astype(np.float32)

    def at(self, parameter: NDArray[np.floating]) -> NDArray[np.float64]:
        """The coordinate in metres of a parameter."""
        return self.core * np.sinh(self.bend * np.asarray(parameter, np.float64))

    def parameter(self, coordinate: NDArray[np.floating]) -> NDArray[np.float64]:
        """The parameter, -1 to 1, of a coordinate in metres."""
        return np.arcsinh(np.asarray(coordinate, np.float64) / self.core) / self.bend

    def coarser(self, step: int) -> Axis:
        """The axis of every ``step``-th sample."""
        return Axis((self.count - 1) // step + 1, self.reach, self.core)

    def texels(self, size: int) -> Axis:
        """An axis whose samples are the centres of ``size`` texels over the same reach."""
        return _TexelAxis(size, self.reach, self.core)


@dataclass(frozen=True)
class _TexelAxis(Axis):
    @cached_property
    def world(self) -> NDArray[np.float64]:
        return self.at((np.arange(self.count) + 0.5) / self.count * 2 - 1)


def upsampled(grid: Floats, count: int) -> Floats:
    """A square grid at ``count`` samples a side over the same parameter, by Catmull-Rom."""
    size = len(grid)
    place = np.linspace(0.0, size - 1.0, count)
    cell = np.minimum(place.astype(np.int64), size - 2)
    t = (place - cell)[:, None]
    weights = (
        (-(t**3) + 2 * t**2 - t) / 2,
        (3 * t**3 - 5 * t**2 + 2) / 2,
        (-3 * t**3 + 4 * t**2 + t) / 2,
        (t**3 - t**2) / 2,
    )
    taps = [np.clip(cell + tap - 1, 0, size - 1) for tap in range(4)]
    rows = sum(grid[tap] * weight for tap, weight in zip(taps, weights, strict=True))
    wide = np.asarray(rows).T
    full = sum(wide[tap] * weight for tap, weight in zip(taps, weights, strict=True))
    return np.ascontiguousarray(np.asarray(full).T, np.float32)


def sampled(axis: Axis, grid: Floats, x: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float64]:
    """A grid's values at any points, bilinear in the parameter; beyond the reach its edge."""
    last = len(grid) - 1
    if isinstance(axis, _TexelAxis):
        column, row = ((axis.parameter(part) + 1) / 2 * axis.count - 0.5 for part in (x, z))
    else:
        column, row = ((axis.parameter(part) + 1) / 2 * last for part in (x, z))
    column, row = np.clip(column, 0, last), np.clip(row, 0, last)
    left, top = (np.minimum(part.astype(np.int64), last - 1) for part in (column, row))
    right, down = column - left, row - top
    above = grid[top, left] * (1 - right) + grid[top, left + 1] * right
    below = grid[top + 1, left] * (1 - right) + grid[top + 1, left + 1] * right
    return np.asarray(above * (1 - down) + below * down)


def grid_normals(axis: Axis, height: Floats) -> Floats:
    """Unit normals of the height grid, (n, n, 3), from a lightly smoothed slope."""
    soft = height.copy()
    soft[1:-1, 1:-1] = (
        4 * height[1:-1, 1:-1]
        + 2 * (height[:-2, 1:-1] + height[2:, 1:-1] + height[1:-1, :-2] + height[1:-1, 2:])
        + (height[:-2, :-2] + height[2:, 2:] + height[:-2, 2:] + height[2:, :-2])
    ) / np.float32(16)
    slope_x = np.gradient(soft, axis=1) / axis.spacing[None, :]
    slope_z = np.gradient(soft, axis=0) / axis.spacing[:, None]
    normal = np.stack([-slope_x, np.ones_like(soft), -slope_z], axis=2)
    normal /= np.sqrt(np.einsum("ijk,ijk->ij", normal, normal))[:, :, None]
    return normal


def split_errors(height: Floats, weight: Floats, cap: Floats) -> Floats:
    """By how much a grid point is missed when its triangle is not split there, children included.

    ``weight`` scales the error at each point; where ``cap`` (grid steps) is shorter than a triangle's
    longest edge, its error is infinite. The grid has 2^k + 1 points a side. The longest edges at a step
    are first axis-aligned, then diagonal; a square's diagonal points to the middle of its parent.
    """
    size = len(height)
    error = np.zeros((size, size), np.float32)
    step = 1
    while step < size - 1:
        for first_row, first_column in ((0, step), (step, 0)):
            rows = slice(first_row, size, 2 * step)
            columns = slice(first_column, size, 2 * step)
            before, after = (
                (height[rows, 0 : size - step : 2 * step], height[rows, 2 * step :: 2 * step])
                if first_row == 0
                else (height[0 : size - step : 2 * step, columns], height[2 * step :: 2 * step, columns])
            )
            own = np.abs(height[rows, columns] - (before + after) / 2) * weight[rows, columns]
            own[cap[rows, columns] < 2 * step] = np.inf
            error[rows, columns] = own
            if step > 1:
                half = step // 2
                _raise(error, rows, columns, ((-half, -half), (-half, half), (half, -half), (half, half)))
        centres = slice(step, size, 2 * step)
        low, high = slice(0, size - step, 2 * step), slice(2 * step, None, 2 * step)
        parity = np.add.outer(np.arange(size // (2 * step)), np.arange(size // (2 * step))) % 2
        falling = (height[low, low] + height[high, high]) / 2
        rising = (height[low, high] + height[high, low]) / 2
        own = np.abs(height[centres, centres] - np.where(parity == 0, falling, rising))
        own = own * weight[centres, centres]
        own[cap[centres, centres] < 2.83 * step] = np.inf
        error[centres, centres] = own
        _raise(error, centres, centres, ((-step, 0), (step, 0), (0, -step), (0, step)))
        step *= 2
    return error


def triangulated(error: Floats, threshold: float) -> NDArray[np.int64]:
    """The triangles whose error is at most the threshold, as flat grid indices (m, 3)."""
    size = len(error)
    last = size - 1
    corners = np.array([[[0, 0], [last, last], [0, last]], [[last, last], [0, 0], [last, 0]]])
    done: list[NDArray[np.int64]] = []
    while len(corners):
        one, two, apex = corners[:, 0], corners[:, 1], corners[:, 2]
        middle = (one + two) // 2
        has_middle = np.abs(one - two).max(axis=1) > 1
        splits = has_middle & (error[middle[:, 0], middle[:, 1]] > threshold)
        done.append(corners[~splits])
        one, two, apex, middle = one[splits], two[splits], apex[splits], middle[splits]
        corners = np.concatenate(
            [np.stack([apex, one, middle], axis=1), np.stack([two, apex, middle], axis=1)],
        )
    every = np.concatenate(done)
    return every[:, :, 0] * size + every[:, :, 1]


def fitted(error: Floats, triangles: int) -> NDArray[np.int64]:
    """The triangulation that comes nearest under a number of triangles.

    A grid point is a corner exactly where its error is over the threshold, and each corner adds two
    triangles (one on the border), so the sorted errors give the threshold.
    """
    size = len(error)
    gain = np.full((size, size), 2)
    gain[[0, -1], :] = gain[:, [0, -1]] = 1
    order = np.argsort(error, axis=None)[::-1]
    count = 2 + np.cumsum(gain.ravel()[order])
    last = int(np.searchsorted(count, triangles, side="right"))
    threshold = float(error.ravel()[order[min(last, size * size - 1)]])
    return triangulated(error, min(threshold, float(np.finfo(np.float32).max)))


def grid_vertices(axis: Axis, height: Floats, skirt: float = 4.0) -> Mesh:
    """The height grid's vertices without triangles, uv 0..1 over the parameter; the border hangs ``skirt`` metres.

    A skirt hides the gap where another sheet of land takes over.
    """
    sunk = height.copy()
    sunk[[0, -1]] -= skirt
    sunk[:, [0, -1]] -= skirt
    x, z = np.meshgrid(axis.world, axis.world)
    side = np.linspace(0, 1, axis.count)
    return Mesh(
        np.stack([x, sunk, z], axis=2).reshape(-1, 3).astype(np.float32),
        grid_normals(axis, height).reshape(-1, 3),
        np.stack(np.meshgrid(side, side), axis=2).reshape(-1, 2).astype(np.float32),
        np.broadcast_to(np.array([1, 1, 1, 0], np.float32), (axis.count**2, 4)),
        np.zeros((0, 3), np.uint32),
    )


def tiled(
    vertices: Mesh, index: NDArray[np.int64], tiles: int, reach: float, core: float = Axis.core
) -> dict[int, Mesh]:
    """Cut a mesh into ``tiles`` × ``tiles`` by its triangles' middles in the warped square.

    The key is row * tiles + column; a tile without triangles is left out.
    """
    axis = Axis(2, reach, core)
    middle = vertices.position[index].mean(axis=1)
    place = (np.stack([axis.parameter(middle[:, 0]), axis.parameter(middle[:, 2])]) + 1) / 2 * tiles
    place = np.clip(place, 0, np.nextafter(tiles, 0))
    column, row = place.astype(np.int64)
    cell = row * tiles + column
    # Triangles that touch follow one another: a vertex is then shaded once, not three times.
    order = np.lexsort((_interleaved(place % 1), cell))
    index, cell = index[order], cell[order]
    parts = {}
    for number in np.unique(cell).tolist():
        used, first, local = np.unique(index[cell == number], return_index=True, return_inverse=True)
        met = np.argsort(first)
        used = used[met]
        parts[number] = Mesh(
            vertices.position[used],
            vertices.normal[used],
            vertices.uv[used],
            vertices.color[used],
            np.argsort(met)[local].reshape(-1, 3).astype(np.uint32),
        )
    return parts


def _interleaved(place: NDArray[np.float64]) -> NDArray[np.int64]:
    """Morton codes of (2, n) coordinates in 0..1: near in the code is near in the square."""
    code = np.zeros(place.shape[1], np.int64)
    bits = (place * 2**12).astype(np.int64)
    for bit in range(12):
        for axis in (0, 1):
            code |= ((bits[axis] >> bit) & 1) << (2 * bit + axis)
    return code


def _raise(error: Floats, rows: slice, columns: slice, offsets: tuple[tuple[int, int], ...]) -> None:
    """Raise the errors on a sub-lattice to those of the points round it."""
    size = len(error)
    row, column = np.arange(size)[rows], np.arange(size)[columns]
    block = error[rows, columns]
    for down, across in offsets:
        is_row = (row + down >= 0) & (row + down < size)
        is_column = (column + across >= 0) & (column + across < size)
        beside = error[np.ix_(row[is_row] + down, column[is_column] + across)]
        place = np.ix_(is_row, is_column)
        block[place] = np.maximum(block[place], beside)
    error[rows, columns] = block
