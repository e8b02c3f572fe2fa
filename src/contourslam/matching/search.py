"""Where in a map a scan lies: an exhaustive search of a window of poses, coarse to fine, with the runners-up.

Branch and bound over position and heading (Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016). Nodes
are taken best bound first, so poses come out in the order of their score and the first that is no neighbour of a better
one is the true runner-up. Two things differ from that paper: headings are halved along with the position, and the map
has a layer for each direction of the surface, so that a wall matches neither its far side nor one that crosses it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.contour.contours import Floats
from contourslam.errors import ContourslamError
from contourslam.geometry.angles import wrap, wrap_angle
from contourslam.kernels import kernel

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Cells = NDArray[np.int32]
Sums = NDArray[np.uint32]

LAYERS = 6  # directions of the surface; a map point also enters the next layer when within a third of one of it
REACH = 2.5  # a map point is felt up to so many sigma
FINE = 16  # places within a cell that a map point is rounded to
LARGEST = 64_000_000  # cells of all layers; the tables take 2.6 bytes for each
WIDEST_STEP = 0.02  # rad; a heading step for points that all lie near the scan's origin

# A node of level k stands for 2^k positions along x and y and 2^(k-1) headings (one at levels 0 and 1). The farthest
# point moves one cell per heading step, so it may be in 2^k + 2^(k-1) - 1 cells each way. The upper tables hold only
# each second and each fourth window, which must be wider by one and three cells to cover any.
TOP = 4
BLOCK = 1 << TOP
WINDOWS = (1, 2, 6, 12, 26)  # cells
STRIDES = (1, 1, 2, 2, 4)  # cells
PHASES = BLOCK // STRIDES[TOP]
BELOW, ABOVE = 32, 16  # cells about the map: wider than a window and a jump, and than a jump

NEAR, NEAR_ANGLE = 0.3, math.radians(5.0)  # m, rad: closer poses are one hypothesis
ID_BITS, SCORE_BITS = 40, 22


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


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A pose that a scan may have.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Frame of the scan in the map: m, m, rad.
    score : float
        Mean likelihood of its points there, between 0 and 1.
    """

    pose: Floats
    score: float


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


def _directions(normals: Floats) -> Floats:
    """Directions of normals in units of a layer, 0 to LAYERS."""
    return np.asarray(np.arctan2(normals[:, 1], normals[:, 0]) * (LAYERS / (2.0 * np.pi)) % LAYERS)


def _finite(points: Floats, normals: Floats | None, whose: str) -> tuple[Floats, Floats | None]:
    points = np.asarray(points, np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"{whose} points have shape {points.shape}, wanted (n, 2)")
    good = np.isfinite(points)
    if normals is not None:
        normals = np.asarray(normals, np.float64)
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
    points, normals = _finite(points, normals, "the map's")
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
    directions = np.zeros(0) if normals is None else _directions(normals)
    _stamp(points, directions, origin, cell, _patches(cell, sigma), tables[0])
    for level in range(TOP):
        window, stride, ratio = WINDOWS[level], STRIDES[level], STRIDES[level + 1] // STRIDES[level]
        more = (WINDOWS[level + 1] - window) // stride
        _widen(tables[level], ratio, min(window // stride, more), more, tables[level + 1])
    y_blocks, x_blocks = (side // PHASES for side in shapes[TOP][1:])
    phased = tables[TOP].reshape(layers, y_blocks, PHASES, x_blocks, PHASES).transpose(0, 2, 4, 1, 3)
    return SearchGrid(origin, cell, (tables[0], tables[1], tables[2], tables[3]), np.ascontiguousarray(phased))


@kernel
def _place(points: Floats, start: Floats, theta: float, slack: float, shift: int, out: Cells) -> None:
    """Entries of a table of stride 2^shift where the windows of points turned by theta begin, `slack` cells lower."""
    cos, sin = math.cos(theta), math.sin(theta)
    x0, y0 = start[0] - slack, start[1] - slack
    xs, ys = out[0], out[1]
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        xs[i] = np.int32(math.floor(x0 + cos * x - sin * y)) >> shift
        ys[i] = np.int32(math.floor(y0 + sin * x + cos * y)) >> shift


@kernel
def _layers(directions: Floats, theta: float, out: Cells) -> None:
    """Layers of the directions (0 to LAYERS) turned by theta; all zero where there are no directions."""
    for i in range(directions.size):
        out[i] = math.floor((directions[i] + theta * (LAYERS / (2.0 * math.pi))) % LAYERS) % LAYERS


@kernel
def _bounds(top: Bytes, entries: Cells, layers: Cells, x0: int, bound: Sums, rows: int) -> None:
    """Bounds of the top level's nodes of one heading: `rows` rows as wide as those of `top`, from column x0.

    Nodes lie a block apart and so do the windows that one point needs: whole runs of the table are added. What is added
    beyond the end of a row comes from the next one; it can only raise a bound.
    """
    height, width = top.shape[3], top.shape[4]
    bound[:] = 0
    for i in range(entries.shape[1]):
        x, y = entries[0, i], entries[1, i]
        across, up = x // PHASES + x0, y // PHASES
        if across >= width or across <= -width or up >= height or up <= -rows:
            continue
        table = top[layers[i], y % PHASES, x % PHASES].ravel()
        start = up * width + across
        low, high = max(0, -start), min(rows * width, table.size - start)
        if low >= high:
            continue
        target, source = bound[low:high], table[start + low : start + high]
        for k in range(target.size):
            target[k] += source[k]


@kernel
def _score(field: Bytes, entries: Cells, layers: Cells, x: int, y: int, jump: int, least: int, out: Ints) -> None:
    """Scores of the four nodes at x or x + jump, y or y + jump; not to the end where none can come to `least`."""
    rows, columns = field.shape[1], field.shape[2]
    flat, size = field.ravel(), rows * columns
    n = entries.shape[1]
    xs, ys = entries[0], entries[1]
    s0 = s1 = s2 = s3 = 0
    up = np.uint64(jump * columns)
    across = np.uint64(jump)
    for i in range(n):
        # What lies outside is moved to the empty margins, which are wider than any jump and window.
        a = min(max(xs[i] + x, 0), columns - 1 - jump)
        b = min(max(ys[i] + y, 0), rows - 1 - jump)
        k = np.uint64(layers[i] * size + b * columns + a)  # unsigned: spares the test for negative indices
        s0 += flat[k]
        s1 += flat[k + across]
        s2 += flat[k + up]
        s3 += flat[k + up + across]
        if i & 15 == 15 and max(max(s0, s1), max(s2, s3)) + 255 * (n - 1 - i) < least:
            break
    out[0], out[1], out[2], out[3] = s0, s1, s2, s3


@kernel
def _push(heap: Ints, size: int, key: int) -> Ints:
    if size == heap.size:
        larger = np.empty(2 * size, np.int64)
        for i in range(size):
            larger[i] = heap[i]
        heap = larger
    i = size
    while i > 0 and heap[(i - 1) >> 1] < key:
        heap[i] = heap[(i - 1) >> 1]
        i = (i - 1) >> 1
    heap[i] = key
    return heap


@kernel
def _pop(heap: Ints, size: int) -> int:
    """Take out the greatest key; the heap then has one less."""
    key = heap[0]
    last = heap[size - 1]
    i = 0
    while 2 * i + 1 < size - 1:
        child = 2 * i + 1
        if child + 1 < size - 1 and heap[child + 1] > heap[child]:
            child += 1
        if heap[child] <= last:
            break
        heap[i] = heap[child]
        i = child
    heap[i] = last
    return int(key)


@kernel
def _claimed(
    found: Ints, count: int, node: tuple[int, int, int], size: int, turn: int, near: float, step: float
) -> bool:
    """Whether all poses of a node lie near one that was found: `size` positions each way from it, `turn` headings."""
    for f in range(count):
        x = max(abs(node[2] - found[f, 2]), abs(node[2] + size - 1 - found[f, 2]))
        y = max(abs(node[1] - found[f, 1]), abs(node[1] + size - 1 - found[f, 1]))
        first, last = (node[0] - found[f, 0]) * step, (node[0] + turn - 1 - found[f, 0]) * step
        if x * x + y * y < near * near and max(abs(wrap_angle(first)), abs(wrap_angle(last))) < NEAR_ANGLE:
            return True
    return False


@kernel
def _search(
    fields: tuple[Bytes, Bytes, Bytes, Bytes],
    top: Bytes,
    points: Floats,
    directions: Floats,
    start: Floats,
    theta: float,
    step: float,
    counts: tuple[int, int, int],
    bound: Sums,
    least: int,
    rival: float,
    near: float,
    found: Ints,
) -> int:
    """Best poses as rows of `found`: heading, y and x as steps into the window, score; returns how many.

    A key sorts by score, then nodes before poses (they may hold a pose of that score that comes first), then by place.
    """
    nt, ny, nx = counts
    n = points.shape[0]
    entries, scores = np.empty((2, n), np.int32), np.empty(4, np.int64)
    mask = (1 << ID_BITS) - 1
    heap, size, count = np.empty(1024, np.int64), 0, 0
    width = top.shape[4]
    up = (ny + BLOCK - 1) // BLOCK
    turn = BLOCK // 2
    layers = np.zeros((nt // turn + 1, n), np.int32)
    for t in range(0, nt, turn):
        middle = theta + (t + 0.5 * (turn - 1)) * step
        _place(points, start, middle, 0.5 * (turn - 1), 2, entries)
        _layers(directions, theta + (t + 0.5 * (min(turn, nt - t) - 1)) * step, layers[t // turn])
        for x0 in range(0, (nx + BLOCK - 1) // BLOCK, width):  # more than once where the window is wider than the map
            _bounds(top, entries, layers[t // turn], x0, bound, up)
            for y in range(up):
                for x in range(x0, min(x0 + width, (nx + BLOCK - 1) // BLOCK)):
                    score = int(bound[y * width + x - x0])
                    if score >= least:
                        place = ((TOP * nt + t) * ny + y * BLOCK) * nx + x * BLOCK
                        heap = _push(heap, size, (((score << 1) | 1) << ID_BITS) | (mask - place))
                        size += 1
    while size > 0 and count < found.shape[0]:
        key = _pop(heap, size)
        size -= 1
        if key >> (ID_BITS + 1) < least:
            break
        place = mask - (key & mask)
        x, y, t = place % nx, place // nx % ny, place // (nx * ny) % nt
        level = place // (nx * ny * nt)
        turn = max(1 << level >> 1, 1)
        if _claimed(found, count, (t, y, x), 1 << level, turn, near, step):
            continue
        if level == 0:
            found[count, 0], found[count, 1], found[count, 2], found[count, 3] = t, y, x, key >> (ID_BITS + 1)
            least = max(least, math.ceil(rival * found[0, 3]))
            count += 1
            continue
        level -= 1
        half, turn = 1 << level, max(1 << level >> 1, 1)
        shift = STRIDES[level] >> 1
        for s in range(t, min(t + (2 * turn if level > 0 else 1), nt), turn):
            _place(points, start, theta + (s + 0.5 * (turn - 1)) * step, 0.5 * (turn - 1), shift, entries)
            # The layers are those of the top node's heading: the same for all nodes below it.
            own = layers[t // (BLOCK // 2)]
            _score(fields[level], entries, own, x >> shift, y >> shift, half >> shift, least, scores)
            for c in range(4):
                cx, cy = x + (c & 1) * half, y + (c >> 1) * half
                if scores[c] >= least and cx < nx and cy < ny:
                    place = ((level * nt + s) * ny + cy) * nx + cx
                    heap = _push(heap, size, (((scores[c] << 1) | (level > 0)) << ID_BITS) | (mask - place))
                    size += 1
    return count


def search(
    grid: SearchGrid,
    points: Floats,
    guess: ArrayLike,
    window: ArrayLike,
    *,
    normals: Floats | None = None,
    min_score: float = 0.4,
    rival: float = 0.8,
    keep: int = 5,
) -> tuple[Hypothesis, ...]:
    """Best poses of a scan in a window about a guess, by trying all of them.

    Positions are tried a cell apart and headings such that the farthest point moves by a cell at most; what is found is
    the same as by scoring each one. The place is ambiguous where a second hypothesis scores about as well as the first.

    Parameters
    ----------
    grid : SearchGrid
    points : ndarray, shape (n, 2)
        Contour points in the frame of the scan, m. Those not finite are left out; those that come to lie outside of the
        grid count as no match. Some 200 that are spread evenly along the contour will do.
    guess, window : array_like, shape (3,)
        Middle and half widths of the window: m, m, rad.
    normals : ndarray, shape (n, 2), optional
        Directions of the surface towards the lidar, for a grid that was built with them.
    min_score : float
        Poses that score less are none, 0 to 1.
    rival : float
        Nor are those that score less than this part of the best, 0 to 1. The less, the slower.
    keep : int
        Number of hypotheses wanted at most.

    Returns
    -------
    tuple of Hypothesis
        Best first, each of them 0.3 m or 5 degrees away from all better ones; empty where nothing scores enough.

    Raises
    ------
    ValueError
        An array has the wrong shape, the guess or the window is not finite, normals were given to only one of grid and
        points, or there are too many points or poses to tell apart.

    Notes
    -----
    With normals the score counts only points whose surface faces about the same way, as :func:`build_search_grid` says.
    """
    points, normals = _finite(points, normals, "the scan's")
    middle, half = np.asarray(guess, np.float64), np.asarray(window, np.float64)
    if middle.shape != (3,) or half.shape != (3,) or not (np.isfinite([middle, half]).all() and (half >= 0.0).all()):
        raise ValueError(
            f"guess {guess!r} and window {window!r} must be three finite numbers, the window's not negative"
        )
    if (normals is None) != (len(grid.top) == 1):
        raise ValueError("normals must be given for both the map and the scan, or for neither")
    if not len(points) or keep < 1:
        return ()
    reach = float(np.hypot(points[:, 0], points[:, 1]).max())
    turn = min(float(half[2]), math.pi)
    # A hair less than a cell, so that rounding takes no point beyond its window.
    headings = math.ceil(turn / min((1.0 - 1e-6) * grid.cell / max(reach, 1e-9), WIDEST_STEP))
    step = turn / headings if headings else WIDEST_STEP
    kx, ky = (int(w / grid.cell + 1e-9) for w in half[:2])
    counts = (2 * headings + 1, 2 * ky + 1, 2 * kx + 1)
    if math.prod(counts) * (TOP + 1) >= 1 << ID_BITS or 255 * len(points) >= 1 << SCORE_BITS:
        raise ValueError(f"{len(points)} points and {math.prod(counts)} poses are too many for one search")
    # Points in an order that mixes all parts of the contour: a bad node shows early.
    mixed = np.argsort(np.arange(len(points)) * 0.6180339887498949 % 1.0)
    rows, width = -(-counts[1] // BLOCK), grid.top.shape[4]
    found = np.empty((keep, 4), np.int64)
    count = _search(
        grid.fields,
        grid.top,
        points[mixed] / grid.cell,
        np.zeros(0) if normals is None else _directions(normals[mixed]),
        (middle[:2] - grid.origin) / grid.cell - (kx, ky),
        float(middle[2]) - headings * step,
        step,
        counts,
        np.empty(rows * width, np.uint32),
        max(math.ceil(min_score * 255 * len(points)), 1),
        rival,
        NEAR / grid.cell,
        found,
    )
    offsets = (found[:count, 2::-1] - (kx, ky, headings)) * (grid.cell, grid.cell, step)
    poses = middle + offsets
    poses[:, 2] = wrap(poses[:, 2])
    return tuple(Hypothesis(p, int(s) / (255 * len(points))) for p, s in zip(poses, found[:count, 3], strict=True))
