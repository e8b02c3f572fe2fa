"""Which landmarks of the map this scan should have shown: what a false negative is counted against (Fig. 7)."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel
from contourslam.scan import LaserScan
from contourslam.slam.measurement import (
    ANCHOR_X,
    ANCHOR_Y,
    CONVEX,
    CORNER,
    DIRECTION,
    END,
    KIND,
    OPENING,
    START,
)

GRAZING = math.sin(math.radians(15.0))  # surfaces seen flatter than this are not expected to be found
CLEARANCE = 0.15  # a beam that ends this much (m) before a landmark was stopped by something else
WALL_SAMPLES = 9
SEAM = 3.0  # a scan whose ends leave no more than this many beams' steps between them is a full turn
MARGIN = 1.5  # how much more than the least size of a landmark must be in sight before it is expected


@kernel
def _beam_reaches(distance: float, bearing: float, angles: Floats, ranges: Floats, max_range: float) -> int:
    """1 if the beams about `bearing` get as far as `distance`, 0 if they are stopped before or nothing is known."""
    n = angles.size
    turn = 2.0 * math.pi
    direction = angles[0] + (bearing - angles[0]) % turn
    i = max(int(np.searchsorted(angles, direction)), 1)
    if i == n and turn - (angles[n - 1] - angles[0]) > SEAM * (angles[n - 1] - angles[0]) / max(n - 1, 1):
        return 0  # outside the field of view
    for k in (i - 1, i):
        r = ranges[k % n]
        if not r > 0.0:  # zero and NaN tell nothing
            continue
        if r >= distance - CLEARANCE or r >= max_range:
            return 1
    return 0


@kernel
def _corner_in_sight(
    x: float, y: float, table: Floats, lidar: Floats, beam_step: float, min_side: float, min_points: int
) -> bool:
    """Whether the lidar stands where both sides of the corner face it and carry enough beams."""
    dx, dy = lidar[0] - x, lidar[1] - y
    r = math.hypot(dx, dy)
    if r < 1e-6:
        return False
    outward = 1.0 if table[CONVEX] > 0.5 else -1.0
    for way in (-1.0, 1.0):
        side = table[DIRECTION] + way * 0.5 * table[OPENING]
        # The face's normal towards free space: away from the enclosed angle if matter fills it, into it otherwise.
        normal = side + way * outward * 0.5 * math.pi
        facing = (math.cos(normal) * dx + math.sin(normal) * dy) / r
        length = table[START] if way < 0.0 else table[END]
        if facing < GRAZING or length < min_side:
            return False
        if length * facing / (r * beam_step) < MARGIN * min_points:
            return False
    return True


@kernel
def _sides_in_sight(
    x: float, y: float, table: Floats, lidar: Floats, angles: Floats, ranges: Floats, max_range: float, min_side: float
) -> bool:
    """Whether enough of both sides of the corner lies in the field of view and is not hidden."""
    for way in (-1.0, 1.0):
        side = table[DIRECTION] + way * 0.5 * table[OPENING]
        length = min(table[START] if way < 0.0 else table[END], MARGIN * min_side)
        dx, dy = x + length * math.cos(side) - lidar[0], y + length * math.sin(side) - lidar[1]
        bearing = math.atan2(dy, dx) - lidar[2]
        if _beam_reaches(math.hypot(dx, dy), bearing, angles, ranges, max_range) != 1:
            return False
    return True


def by_angle(scan: LaserScan) -> tuple[Floats, Floats]:
    """Angles (rad) and ranges (m) of a scan in the order of rising angles, which :func:`expected_in_scan` needs."""
    angles, ranges = scan.angles, scan.ranges
    if (angles[1:] < angles[:-1]).any():  # a lidar that spins clockwise, or whose zero lies amid the scan
        way = np.argsort(angles, kind="stable")
        angles, ranges = angles[way], ranges[way]
        # As a scan's own are: for arrays that may change, Numba compiles anew when the first such scan comes.
        angles.flags.writeable = ranges.flags.writeable = False
    return angles, ranges


@kernel
def expected_in_scan(
    mean: Floats, table: Floats, count: int, lidar: Floats, angles: Floats, ranges: Floats, max_range: float,
    min_side: float, min_side_points: int, min_wall: float, min_wall_points: int,
) -> NDArray[np.bool_]:  # fmt: skip
    """Mark the landmarks that should be found: in range and field of view, facing the lidar, large enough, not hidden.

    Parameters
    ----------
    mean, table, count
        State and landmark table of the filter.
    lidar : ndarray, shape (3,)
        ``T_world_lidar``.
    angles, ranges : ndarray, shape (n,)
        The scan, its angles ascending; rad and m.
    max_range : float
        m.
    min_side, min_side_points, min_wall, min_wall_points
        Least size of a corner's side and of a wall, see :class:`contourslam.config.LandmarkConfig`.

    Returns
    -------
    ndarray of bool, shape (count,)
    """
    expected = np.zeros(count, dtype=np.bool_)
    n = angles.size
    if n < 2:
        return expected
    beam_step = max((angles[n - 1] - angles[0]) / (n - 1), 1e-6)
    for j in range(count):
        a, b = mean[3 + 2 * j], mean[4 + 2 * j]
        if table[j, KIND] == CORNER:
            dx, dy = a - lidar[0], b - lidar[1]
            r = math.hypot(dx, dy)
            if r < max_range and _corner_in_sight(a, b, table[j], lidar, beam_step, min_side, min_side_points):
                bearing = math.atan2(dy, dx) - lidar[2]
                expected[j] = _beam_reaches(r, bearing, angles, ranges, max_range) == 1 and _sides_in_sight(
                    a, b, table[j], lidar, angles, ranges, max_range, min_side
                )
            continue
        nx, ny = math.cos(a), math.sin(a)
        distance = b - nx * (lidar[0] - table[j, ANCHOR_X]) - ny * (lidar[1] - table[j, ANCHOR_Y])
        if distance <= 0.0 or distance > max_range:  # behind the lidar's back: the wall's other face
            continue
        length = table[j, END] - table[j, START]
        seen = beams = 0.0  # of the piece in sight that the samples have come to
        for k in range(WALL_SAMPLES):
            along = table[j, START] + (k + 0.5) / WALL_SAMPLES * length
            dx = table[j, ANCHOR_X] + b * nx - along * ny - lidar[0]
            dy = table[j, ANCHOR_Y] + b * ny + along * nx - lidar[1]
            r = math.hypot(dx, dy)
            in_sight = r <= max_range and distance >= GRAZING * r
            if in_sight and _beam_reaches(r, math.atan2(dy, dx) - lidar[2], angles, ranges, max_range) == 1:
                seen += length / WALL_SAMPLES
                beams += length / WALL_SAMPLES * distance / (r * r * beam_step)
                expected[j] = expected[j] or (seen > MARGIN * min_wall and beams > MARGIN * min_wall_points)
            else:
                seen = beams = 0.0
    return expected
