"""Tables over a map that a scan is searched for in: the likelihood of a point in each cell, and its maxima.

The map has a layer for each direction of the surface, so that a wall matches neither its far side nor one that crosses
it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.errors import ContourslamError
from contourslam.kernels import kernel

Bytes = NDArray[np.uint8]

LAYERS = 6  # directions of the surface; a map point also enters the next layer when within a third of one of it
REACH = 2.5  # a map point is felt up to so many sigma
FINE = 16  # places within a cell that a map point is rounded to
LARGEST = 64_000_000  # cells of all layers; the tables take 2.6 bytes for each

# A node of level k stands for 2^k positions along x and y and 2^(k-1) headings (one at levels 0 and 1). The farthest
# point moves one cell per heading step, so it may be in 2^k + 2^(k-1) - 1 cells each way. The upper tables hold only
# each second and each fourth window, which must be wider by one and three cells to cover any.
TOP = 4
BLOCK = 1 << TOP
WINDOWS = (1, 2, 6, 12, 26)  # cells
STRIDES = (1, 1, 2, 2, 4)  # cells
PHASES = BLOCK // STRIDES[TOP]
BELOW, ABOVE = 32, 16  # cells about the map: wider than a window and a jump, and than a jump


@dataclass(frozen=True, slots=True)
class SearchGrid:
    """Likelihood of a contour point in each cell of a map, and its maxima over ever larger windows.

    Attributes
    ----------
    origin : ndarray, shape (2,)
        Lower corner of the first cell, m.
    cell : float
        m.
    fields : tuple of ndarray of uint8, each of shape (layers, rows, columns)
        Likelihood times 255, rows along y; then its maxima over WINDOWS cells from each cell onwards, one each STRIDES.
        There are LAYERS layers by direction of the surface, or one.
    top : ndarray of uint8, shape (layers, PHASES, PHASES, rows, columns)
        The widest windows, sorted such that those a BLOCK apart are neighbours in memory.
    """

    origin: Floats
    cell: float
    fields: tuple[Bytes, Bytes, Bytes, Bytes]
    top: Bytes


@kernel
def _patches(cell: float, sigma: float) -> Bytes:
    """Likelihood about a point, for each sixteenth of a cell that it may lie at; rows filled up to eights."""
    reach = math.ceil(REACH * sigma / cell)
    side = 2 * reach + 1
    out = np.zeros((FINE, FINE, side, (side + 7) // 8 * 8), np.uint8)
    for py in range(FINE):
        for px in range(FINE):
            for j in range(side):
                for i in range(side):
                    x, y = i - reach + 0.5 - (px + 0.5) / FINE, j - reach + 0.5 - (py + 0.5) / FINE
                    d = (x * x + y * y) * (cell / sigma) ** 2
                    if d <= REACH * REACH:
                        out[py, px, j, i] = int(255.0 * math.exp(-0.5 * d) + 0.5)
    return out


@kernel
def _stamp(points: Floats, directions: Floats, origin: Floats, cell: float, patches: Bytes, field: Bytes) -> None:
    """Raise the cells about each point to its likelihood there, in the layers of its direction (0 to LAYERS)."""
    layers, side, width = field.shape[0], patches.shape[2], patches.shape[3]
    for k in range(points.shape[0]):
        x, y = (points[k, 0] - origin[0]) / cell, (points[k, 1] - origin[1]) / cell
        i0, j0 = int(x), int(y)
        patch = patches[int((y - j0) * FINE), int((x - i0) * FINE)]
        first = last = 0
        if layers > 1:
            first = math.floor(directions[k] - 1.0 / 3.0)
            last = math.floor(directions[k] + 1.0 / 3.0)
        for b in range(first, last + 1):
            layer = field[b % layers]
            for j in range(side):
                for c in range(0, width, 8):
                    start = i0 - side // 2 + c
                    row, more = layer[j0 - side // 2 + j, start : start + 8], patch[j, c : c + 8]
                    for i in range(8):  # of fixed length, so that it is compiled to vectors
                        row[i] = row[i] if row[i] > more[i] else more[i]


@kernel
def _widen(field: Bytes, ratio: int, one: int, two: int, out: Bytes) -> None:
    """Maxima of the entries 0, `one` and `two` further on, along both axes, of each `ratio`-th entry, 1 or 2."""
    rows, columns = field.shape[1], field.shape[2]
    row = np.zeros(columns + two, np.uint8)
    for b in range(field.shape[0]):
        for j in range(out.shape[1]):
            y = ratio * j
            first = field[b, y]
            second = field[b, min(y + one, rows - 1)]  # the last row and column are empty
            third = field[b, min(y + two, rows - 1)]
            for i in range(columns):
                v = first[i] if first[i] > second[i] else second[i]
                row[i] = v if v > third[i] else third[i]
            target = out[b, j]
            a, c = row[one:], row[two:]
            if ratio == 1:  # the two cases said apart, so that each is compiled to vectors
                for i in range(target.size):
                    v = row[i] if row[i] > a[i] else a[i]
                    target[i] = v if v > c[i] else c[i]
            else:
                for i in range(target.size):
                    v = row[2 * i] if row[2 * i] > a[2 * i] else a[2 * i]
                    target[i] = v if v > c[2 * i] else c[2 * i]


def directions_of(normals: Floats) -> Floats:
    """Directions of normals in units of a layer, 0 to LAYERS."""
    return np.asarray(np.arctan2(normals[:, 1], normals[:, 0]) * (LAYERS / (2.0 * np.pi)) % LAYERS)


def finite_points(points: Floats, normals: Floats | None, whose: str) -> tuple[Floats, Floats | None]:
    """Leave out points that are not finite; `whose` points they are is for the error message, on a wrong shape."""
    points = np.ascontiguousarray(points, np.float64)  # the kernels are then compiled for one layout only
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"{whose} points have shape {points.shape}, wanted (n, 2)")
    good = np.isfinite(points)
    if normals is not None:
        normals = np.ascontiguousarray(normals, np.float64)
        if normals.shape != points.shape:
            raise ValueError(f"{whose} normals have shape {normals.shape}, its points {points.shape}: they must agree")
        good &= np.isfinite(normals)
    if good.all():  # at once for the most usual case: rows are slow to go through
        return points, normals
    rows = good.all(axis=1)
    return points[rows], None if normals is None else normals[rows]


def build_search_grid(points: Floats, normals: Floats | None, *, cell: float = 0.05, sigma: float = 0.05) -> SearchGrid:
    """Likelihood of a contour point about the points of a map, to search in.

    Hand over only the map points that a scan may touch from within the window: the tables cover all of them.

    Parameters
    ----------
    points : ndarray, shape (m, 2)
        Map, m. Those not finite are left out.
    normals : ndarray, shape (m, 2), optional
        Directions of the surface, towards where it was seen from. With them, a scan point counts only where a map point
        has about its direction: within 20 degrees always, beyond 80 never.
    cell : float
        m.
    sigma : float
        The likelihood at distance d from the nearest map point is exp(-d^2 / (2 sigma^2)), and nothing beyond 2.5
        sigma; m.

    Returns
    -------
    SearchGrid

    Raises
    ------
    ContourslamError
        The points spread too far for the tables.
    ValueError
        An array has the wrong shape, or `cell` or `sigma` is not positive.
    """
    points, normals = finite_points(points, normals, "the map's")
    if not (cell > 0.0 and sigma > 0.0):
        raise ValueError(f"cell {cell} and sigma {sigma} must be positive")
    layers = 1 if normals is None else LAYERS
    x, y = points.T if len(points) else np.zeros((2, 1))
    low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()])
    reach = math.ceil(REACH * sigma / cell)
    origin = low - (BELOW + reach) * cell
    columns, rows = BLOCK * np.ceil(((high - origin) / cell + reach + ABOVE) / BLOCK)
    if layers * rows * columns > LARGEST:
        raise ContourslamError(
            f"the map spreads over {high[0] - low[0]:.0f} x {high[1] - low[1]:.0f} m, more than the contour search "
            f"holds at {cell} m a cell: crop its points to the window"
        )
    shapes = [(layers, int(rows) // stride, int(columns) // stride) for stride in STRIDES]
    # All tables in one block: the next grid then takes the memory that this one leaves, instead of asking for it anew.
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    block = np.empty(ends[-1], np.uint8)
    tables = [part.reshape(shape) for part, shape in zip(np.split(block, ends[:-1]), shapes, strict=True)]
    tables[0][:] = 0
    directions = np.zeros(0) if normals is None else directions_of(normals)
    _stamp(points, directions, origin, cell, _patches(cell, sigma), tables[0])
    for level in range(TOP):
        window, stride, ratio = WINDOWS[level], STRIDES[level], STRIDES[level + 1] // STRIDES[level]
        more = (WINDOWS[level + 1] - window) // stride
        _widen(tables[level], ratio, min(window // stride, more), more, tables[level + 1])
    y_blocks, x_blocks = (side // PHASES for side in shapes[TOP][1:])
    phased = tables[TOP].reshape(layers, y_blocks, PHASES, x_blocks, PHASES).transpose(0, 2, 4, 1, 3)
    return SearchGrid(origin, cell, (tables[0], tables[1], tables[2], tables[3]), np.ascontiguousarray(phased))
