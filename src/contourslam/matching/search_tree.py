"""The branch and bound of the contour search: over position and heading, where a robot can stand, best first.

See :mod:`contourslam.matching.search`, which prepares what it takes.
"""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap_angle
from contourslam.kernels import kernel
from contourslam.matching.search_grid import BLOCK, LAYERS, PHASES, STRIDES, TOP, Bytes

Ints = NDArray[np.int64]
Cells = NDArray[np.int32]
Sums = NDArray[np.uint32]
Flags = NDArray[np.bool_]

NEAR, NEAR_ANGLE = 0.3, math.radians(5.0)  # m, rad: closer poses are one hypothesis
ID_BITS, SCORE_BITS = 40, 22


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
def _stands(standing: Flags, y: int, x: int) -> bool:
    """Whether a node holds a position that is allowed; without flags all are."""
    return standing.size == 0 or bool(standing[y, x])


@kernel
def branch_and_bound(
    fields: tuple[Bytes, Bytes, Bytes, Bytes],
    top: Bytes,
    points: Floats,
    directions: Floats,
    start: Floats,
    theta: float,
    step: float,
    counts: tuple[int, int, int],
    standing: tuple[Flags, Flags, Flags, Flags, Flags],
    hopes: Floats,
    bound: Sums,
    least: int,
    rival: float,
    near: float,
    budget: int,
    found: Ints,
) -> tuple[int, int]:
    """Best poses as rows of `found`: heading, y and x as steps into the window, score; returns how many.

    The second number is what a pose may score that was not looked at, as `found` is full or so many nodes were looked
    at as the budget allows (below zero: any number); 0 where all were. `hopes` says for each level what part of a bound
    is believed: with all ones the best poses are found for sure, with less sooner, and perhaps not all.

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
                    if score >= least and _stands(standing[TOP], y * BLOCK, x * BLOCK):
                        likely = int(score * hopes[TOP])
                        if likely >= least:
                            place = ((TOP * nt + t) * ny + y * BLOCK) * nx + x * BLOCK
                            heap = _push(heap, size, (((likely << 1) | 1) << ID_BITS) | (mask - place))
                            size += 1
    while size > 0:
        if count == found.shape[0] or budget == 0:
            return count, heap[0] >> (ID_BITS + 1)
        key = _pop(heap, size)
        size -= 1
        budget -= 1
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
                likely = int(scores[c] * hopes[level])
                if likely >= least and cx < nx and cy < ny and _stands(standing[level], cy, cx):
                    place = ((level * nt + s) * ny + cy) * nx + cx
                    heap = _push(heap, size, (((likely << 1) | (level > 0)) << ID_BITS) | (mask - place))
                    size += 1
    return count, 0
