"""The floor under what was seen from along the way."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel
from contourslam.scene.occlusion import crossing
from contourslam.scene.surface import Surface

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_RAYS = 720
_APART = 0.4  # m between the places that the floor is looked at from
_BEHIND = 0.02  # m by which it goes on below a wall
_MOST_CELLS = 20_000_000


def seen_floor(poses: Floats, blocks: Floats, reach: float, cell: float, longest: float) -> tuple[Surface, ...]:
    """Lay a floor wherever something stands in sight of the way, and where blocks shut it in.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        The way of the base.
    blocks : ndarray, shape (b, 5)
        As from :func:`contourslam.scene.occlusion.occluders`.
    reach : float
        How far the floor is looked at from each place; it is left out where no block ends the sight, m.
    cell : float
        Side of the squares that it is made of, m; larger where there would be more than some 20 million.
    longest : float
        Side of a piece at most, m.

    Returns
    -------
    tuple of Surface
        Pieces, "floor-0" and so on; none where there are no poses.
    """
    import cv2

    places = _thinned(poses[:, :2])
    if not len(places):
        return ()
    angles = np.linspace(0.0, 2.0 * math.pi, _RAYS, endpoint=False)
    rings = [sights(place, angles, blocks, reach) for place in places]
    low, high = np.min([r.min(axis=0) for r in rings], axis=0), np.max([r.max(axis=0) for r in rings], axis=0)
    cell = max(cell, math.sqrt(float(np.prod(high - low)) / _MOST_CELLS))
    low -= 2.0 * cell
    columns, rows = (int(n) for n in np.ceil((high - low) / cell) + 2)
    seen = np.zeros((rows, columns), np.uint8)
    for ring in rings:
        cv2.fillPoly(seen, [_fixed(ring, low, cell)], 1, shift=4)
    seen = _largest(cv2, np.asarray(cv2.morphologyEx(seen, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8))
    shut = seen.copy()
    cv2.polylines(shut, [_fixed(b[:4].reshape(2, 2), low, cell) for b in blocks], False, 1, 2, shift=4)
    cv2.floodFill(shut, None, (0, 0), 2)
    shut_in = cv2.dilate((shut == 0).astype(np.uint8), np.ones((5, 5), np.uint8))  # and under the walls about it
    seen[(np.asarray(shut_in) > 0) & (shut != 2)] = 1  # under furniture there is a floor too
    step = max(int(longest / cell), 1)
    floors: list[Surface] = []
    for row in range(0, rows, step):
        for column in range(0, columns, step):
            part = seen[row : row + step, column : column + step].astype(np.bool_)
            if part.any():
                floors.append(_piece(part, low + cell * np.array([column, row]), cell, len(floors)))
    return tuple(floors)


def _fixed(places: Floats, low: Floats, cell: float) -> NDArray[np.int32]:
    """Places in cells, as OpenCV takes them with four binary digits behind the point."""
    return np.asarray(np.round((places - low) / cell * 16 - 8), np.int32)


def _piece(part: Bools, corner: Floats, cell: float, number: int) -> Surface:
    inside_rows, inside_columns = np.flatnonzero(part.any(axis=1)), np.flatnonzero(part.any(axis=0))
    part = part[inside_rows[0] : inside_rows[-1] + 1, inside_columns[0] : inside_columns[-1] + 1]
    corner = corner + cell * np.array([inside_columns[0], inside_rows[0]])
    x, y = np.eye(3)[:2]
    rows, columns = part.shape
    origin = np.append(corner, 0.0)
    return Surface(f"floor-{number}", "floor", origin, x, y, columns * cell, rows * cell, cell * rectangles(part))


def _thinned(places: Floats) -> Floats:
    """Places of the way that are not close to the one kept before."""
    kept: list[Floats] = []
    for place in places:
        if not kept or np.hypot(*(place - kept[-1])) > _APART:
            kept.append(place)
    return np.array(kept).reshape(-1, 2)


@kernel
def sights(eye: Floats, angles: Floats, blocks: Floats, reach: float) -> Floats:
    """Where rays in the plane end, shape (n, 2); a ray that meets nothing ends halfway out."""
    ring = np.empty((angles.size, 2))
    for n in range(angles.size):
        dx, dy = math.cos(angles[n]), math.sin(angles[n])
        best = reach
        for b in range(blocks.shape[0]):
            distance, place = crossing(eye, dx, dy, blocks[b])
            if 0.0 < distance < best and 0.0 <= place <= 1.0:
                best = distance
        length = best + _BEHIND if best < reach else 0.0
        ring[n, 0], ring[n, 1] = eye[0] + length * dx, eye[1] + length * dy
    return ring


def _largest(cv2: Any, seen: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Only pieces worth showing: connected and not much smaller than the largest."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(seen, connectivity=4)
    areas = stats[:, cv2.CC_STAT_AREA]
    good = np.zeros(count, np.uint8)
    good[1:] = areas[1:] > 0.02 * areas[1:].max() if count > 1 else 0
    return np.asarray(good[labels])


def rectangles(part: Bools) -> Floats:
    """Cover the cells with few rectangles: runs of a row, drawn up as long as the next row has the same run.

    Returns
    -------
    ndarray, shape (p, 4)
        Left, lower, right, upper in cells.
    """
    done: list[tuple[int, int, int, int]] = []
    open_runs: dict[tuple[int, int], int] = {}
    for row in range(len(part) + 1):
        line = np.zeros(part.shape[1] + 2, np.int8)
        if row < len(part):
            line[1:-1] = part[row]
        turns = np.flatnonzero(np.diff(line))
        runs = set(zip(turns[::2].tolist(), turns[1::2].tolist(), strict=True))
        ended = [run for run in open_runs if run not in runs]
        done += [(run[0], open_runs.pop(run), run[1], row) for run in ended]
        for run in runs - open_runs.keys():
            open_runs[run] = row
    return np.array(sorted(done), dtype=np.float64).reshape(-1, 4)
