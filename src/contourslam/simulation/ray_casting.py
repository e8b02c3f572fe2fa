"""Rays in the plane, looked up cell by cell: MuJoCo asks every wall for every ray, too slow in a large building."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel
from contourslam.simulation.pieces import Box, Cylinder
from contourslam.simulation.room import Room

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
_CELL = 0.5  # m


def outlines(room: Room, height: float) -> tuple[Floats, Floats]:
    """Sides of all boxes and of the room, and all circles, at a height; sides inside other matter are among them.

    Parameters
    ----------
    room : Room
    height : float
        Above the floor, m.

    Returns
    -------
    segments : ndarray, shape (s, 2, 2)
        m, world frame.
    circles : ndarray, shape (k, 3)
        x, y, radius, m.
    """
    standing = [piece for piece in room.pieces if piece.bottom < height < piece.top]
    rings = [np.array(room.outline), *(piece.footprint() for piece in standing if isinstance(piece, Box))]
    segments = np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings])
    circles = [(p.x, p.y, p.radius) for p in standing if isinstance(p, Cylinder)]
    return segments, np.array(circles, dtype=np.float64).reshape(-1, 3)


class PlaneCaster:
    """Casts rays among segments and circles; what lies in each cell of a grid is looked up once, here.

    Parameters
    ----------
    segments : ndarray, shape (s, 2, 2)
        m.
    circles : ndarray, shape (k, 3)
        x, y, radius, m.
    """

    def __init__(self, segments: Floats, circles: Floats) -> None:
        self._shapes = np.zeros(
            (len(segments) + len(circles), 5)
        )  # x, y, x, y of a segment; x, y, radius, 1 of a circle
        self._shapes[: len(segments), :4] = segments.reshape(-1, 4)
        self._shapes[len(segments) :, :3], self._shapes[len(segments) :, 4] = circles, 1.0
        low = np.concatenate([segments.min(axis=1), circles[:, :2] - circles[:, 2:]])
        high = np.concatenate([segments.max(axis=1), circles[:, :2] + circles[:, 2:]])
        self._origin = low.min(axis=0) - _CELL
        self._size = np.ceil((high.max(axis=0) + _CELL - self._origin) / _CELL).astype(np.int64)
        first = ((low - self._origin - 1e-9) / _CELL).astype(np.int64)
        last = ((high - self._origin + 1e-9) / _CELL).astype(np.int64)
        self._starts, self._members = _fill(self._shapes, first, last, self._origin, self._size)

    def cast(self, origins: Floats, angles: Floats, range_max: float) -> tuple[Floats, Floats]:
        """Cast rays from free space.

        Parameters
        ----------
        origins : ndarray, shape (n, 2)
            m.
        angles : ndarray, shape (n,)
            Directions, rad.
        range_max : float
            No ray is followed farther, m.

        Returns
        -------
        ranges, incidences : ndarray, shape (n,)
            Distance to what a ray meets, m, inf where that is nothing; angle between ray and surface, rad.
        """
        return _cast(origins, angles, range_max, self._shapes, self._origin, self._size, self._starts, self._members)


@kernel
def _fill(shapes: Floats, first: Indices, last: Indices, origin: Floats, size: Indices) -> tuple[Indices, Indices]:
    """For each cell where its members start, and all members one after the other."""
    starts = np.zeros(size[0] * size[1] + 1, dtype=np.int64)
    members = np.zeros(0, dtype=np.int64)
    for turn in range(2):  # first count, then write
        for k in range(len(shapes)):
            x0, y0, x1, y1, is_round = shapes[k]
            length = math.hypot(x1 - x0, y1 - y0)
            for i in range(first[k, 0], last[k, 0] + 1):
                for j in range(first[k, 1], last[k, 1] + 1):
                    if is_round == 0.0 and length > 0.0:
                        cx, cy = origin[0] + (i + 0.5) * _CELL - x0, origin[1] + (j + 0.5) * _CELL - y0
                        # A line that passes farther from a cell's middle than its corners are is not in it.
                        if abs(cx * (y1 - y0) - cy * (x1 - x0)) > 0.7072 * _CELL * length:
                            continue
                    cell = i * size[1] + j
                    if turn == 0:
                        starts[cell + 1] += 1
                    else:
                        starts[cell] -= 1
                        members[starts[cell]] = k
        if turn == 0:
            starts[:] = np.cumsum(starts)
            members = np.zeros(starts[-1], dtype=np.int64)
            starts[:-1] = starts[1:]  # each cell's end; writing moves it down to its start
    return starts, members


@kernel
def _meet(x: float, y: float, dx: float, dy: float, shape: Floats) -> tuple[float, float]:
    """Distance along a ray to a shape, inf if none, and the sine of the angle between them."""
    if shape[4] == 0.0:
        ax, ay, sx, sy = shape[0] - x, shape[1] - y, shape[2] - shape[0], shape[3] - shape[1]
        across = dx * sy - dy * sx
        if across == 0.0:
            return math.inf, 0.0
        distance, part = (ax * sy - ay * sx) / across, (ax * dy - ay * dx) / across
        if distance > 0.0 and 0.0 <= part <= 1.0:
            return distance, abs(across) / math.hypot(sx, sy)
        return math.inf, 0.0
    cx, cy, radius = shape[0] - x, shape[1] - y, shape[2]
    middle = cx * dx + cy * dy
    half_chord = radius * radius - cx * cx - cy * cy + middle * middle
    if half_chord <= 0.0 or middle - math.sqrt(half_chord) <= 0.0:
        return math.inf, 0.0
    return middle - math.sqrt(half_chord), math.sqrt(half_chord) / radius


@kernel
def _cast(
    origins: Floats,
    angles: Floats,
    range_max: float,
    shapes: Floats,
    corner: Floats,
    size: Indices,
    starts: Indices,
    members: Indices,
) -> tuple[Floats, Floats]:
    """Walk each ray from cell to cell (Amanatides and Woo 1987) until what it has met lies before the next cell."""
    count = len(angles)
    ranges, incidences = np.full(count, np.inf), np.zeros(count)
    for n in range(count):
        x, y, dx, dy = origins[n, 0], origins[n, 1], math.cos(angles[n]), math.sin(angles[n])
        u, v = (x - corner[0]) / _CELL, (y - corner[1]) / _CELL
        i, j = math.floor(u), math.floor(v)
        step_i, step_j = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
        each_i = _CELL / abs(dx) if dx != 0.0 else math.inf
        each_j = _CELL / abs(dy) if dy != 0.0 else math.inf
        next_i = (i + 1 - u if dx > 0.0 else u - i) * each_i if dx != 0.0 else math.inf
        next_j = (j + 1 - v if dy > 0.0 else v - j) * each_j if dy != 0.0 else math.inf
        best, sine, reached = range_max, -1.0, 0.0
        while reached <= best and 0 <= i < size[0] and 0 <= j < size[1]:
            cell = i * size[1] + j
            for k in range(starts[cell], starts[cell + 1]):
                distance, angle = _meet(x, y, dx, dy, shapes[members[k]])
                if distance < best:
                    best, sine = distance, angle
            if next_i < next_j:
                reached, next_i, i = next_i, next_i + each_i, i + step_i
            else:
                reached, next_j, j = next_j, next_j + each_j, j + step_j
        if sine >= 0.0:
            ranges[n], incidences[n] = best, math.asin(min(sine, 1.0))
    return ranges, incidences
