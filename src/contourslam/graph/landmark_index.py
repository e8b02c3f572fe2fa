"""Landmarks by place: square cells, each with a list of the landmarks in it, so that a search asks only those near."""

import math

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.graph.association import unlikeness
from contourslam.graph.sightings import DIRECTION, END, KIND, START, X, Y
from contourslam.kernels import kernel
from contourslam.slam.measurement import CORNER

CELL = 3.0  # m; larger where the map would need more than MOST_CELLS
MOST_CELLS = 1e6
MARGIN = 0.6  # m by which a landmark reaches into the cells around: more than any gate

# The index as a tuple of arrays, the form in which kernels hand it on: x, y of the first cell and the cells' size;
# columns, rows; first entry of each cell, -1 for none; next entry after each; its landmark; number of entries.
Index = tuple[Floats, Ints, Ints, Ints, Ints, Ints]


@kernel
def _box(row: Floats, margin: float, place: Floats, shape: Ints) -> tuple[int, int, int, int]:
    """First and last column and row of the cells that a corner or wall touches."""
    x0 = x1 = row[X]
    y0 = y1 = row[Y]
    if row[KIND] != CORNER:
        tx, ty = -math.sin(row[DIRECTION]), math.cos(row[DIRECTION])
        ax, bx, ay, by = x0 + tx * row[START], x0 + tx * row[END], y0 + ty * row[START], y0 + ty * row[END]
        x0, x1, y0, y1 = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
    i0, i1 = int((x0 - margin - place[0]) / place[2]), int((x1 + margin - place[0]) / place[2])
    j0, j1 = int((y0 - margin - place[1]) / place[2]), int((y1 + margin - place[1]) / place[2])
    return (
        min(max(i0, 0), shape[0] - 1), min(max(i1, 0), shape[0] - 1), min(max(j0, 0), shape[1] - 1),
        min(max(j1, 0), shape[1] - 1),
    )  # fmt: skip


@kernel
def empty_index(rows: Floats) -> Index:
    """Index with room for all these corners and walls, which holds none yet."""
    place, shape = np.array([0.0, 0.0, CELL]), np.ones(2, np.int64)
    if rows.shape[0] > 0:
        place[0], place[1] = rows[:, X].min(), rows[:, Y].min()
        wide, high = rows[:, X].max() - place[0], rows[:, Y].max() - place[1]
        place[2] = max(CELL, math.sqrt(wide * high / MOST_CELLS), max(wide, high) / MOST_CELLS)
        shape[0], shape[1] = int(wide / place[2]) + 1, int(high / place[2]) + 1
    room = 0
    for k in range(rows.shape[0]):
        i0, i1, j0, j1 = _box(rows[k], MARGIN, place, shape)
        room += (i1 - i0 + 1) * (j1 - j0 + 1)
    heads = np.full(shape[0] * shape[1], -1, np.int64)
    return place, shape, heads, np.empty(room, np.int64), np.empty(room, np.int64), np.zeros(1, np.int64)


@kernel
def insert(index: Index, row: Floats, number: int) -> None:
    """Enter a landmark under its number."""
    place, shape, heads, following, items, used = index
    i0, i1, j0, j1 = _box(row, MARGIN, place, shape)
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            entry, cell = used[0], i * shape[1] + j
            following[entry], items[entry], heads[cell] = heads[cell], number, entry
            used[0] += 1


@kernel
def likest(index: Index, table: Floats, row: Floats, gates: Floats) -> int:
    """Landmark that is least unlike a row, -1 where all are beyond the gates; of equals the one entered first."""
    place, shape, heads, following, items, _ = index
    best, found = math.inf, -1
    i0, i1, j0, j1 = _box(row, 0.0, place, shape)
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            entry = heads[i * shape[1] + j]
            while entry >= 0:
                number = items[entry]
                cost = unlikeness(row, table[number], gates)
                if cost < best or (cost == best and number < found):
                    best, found = cost, number
                entry = following[entry]
    return found
