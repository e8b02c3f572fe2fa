"""What a lidar at a known place in the known room sees: ranges of its beams, and which true corners."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.evaluation.ground_truth import GroundTruth
from contourslam.geometry.angles import wrap, wrap_angle
from contourslam.kernels import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# A beam's end lies on a corner's side if it is this close to it, m: far above rounding, far below any range noise.
_ON_SIDE = 1e-4


@dataclass(frozen=True, slots=True)
class VisibilityLimits:
    """When a detector could be asked to find a corner.

    Attributes
    ----------
    max_range : float
        The corner is no farther than this from the lidar, m.
    min_incidence_deg : float
        The line of sight meets each side at no less than this, degrees.
    min_beams : int
        At least this many neighbouring beams fall on each side, counted from the corner up to the first that does not.
    min_side : float
        These beams reach at least this far along the side, m.
    """

    max_range: float = 30.0
    min_incidence_deg: float = 10.0
    min_beams: int = 5
    min_side: float = 0.25


def cast_beams(
    lidar_pose: Floats, angles: Floats, segments: Floats, circles: Floats, max_range: float = 30.0
) -> tuple[Floats, Ints]:
    """Range of each beam in the known room, without noise and all from one pose.

    Parameters
    ----------
    lidar_pose : ndarray, shape (3,)
        x (m), y (m), heading (rad) of the lidar in the world frame.
    angles : ndarray, shape (n,)
        Direction of each beam in the lidar's frame, rad.
    segments : ndarray, shape (s, 2, 2)
        Straight outlines, m.
    circles : ndarray, shape (k, 3)
        Round outlines: x, y, radius, m.
    max_range : float
        m.

    Returns
    -------
    ranges : ndarray, shape (n,)
        m; inf where the beam meets nothing in range.
    hits : ndarray of int, shape (n,)
        What it meets: a segment's index, the number of segments plus a circle's index, or -1.
    """
    bearings = np.asarray(lidar_pose[2] + angles, dtype=np.float64)
    return _cast(float(lidar_pose[0]), float(lidar_pose[1]), bearings, segments, circles, float(max_range))


def visible_corners(
    truth: GroundTruth, lidar_pose: Floats, angles: Floats, limits: VisibilityLimits | None = None
) -> NDArray[np.bool_]:
    """Tell which true corners a scan shows well enough to be found.

    A corner counts if it is in range, faces the lidar with both sides, and the scan's own beams next to it fall on both
    sides without a break: that holds the field of view, the line of sight and the beam spacing to account at once.

    Parameters
    ----------
    truth : GroundTruth
        The true room.
    lidar_pose : ndarray, shape (3,)
        x (m), y (m), heading (rad) of the lidar in the world frame.
    angles : ndarray, shape (n,)
        Direction of each beam in the lidar's frame, rad, in any order.
    limits : VisibilityLimits, optional

    Returns
    -------
    ndarray of bool, shape (c,)
    """
    limits = limits or VisibilityLimits()
    bearings = np.sort(wrap(angles))
    if len(bearings) < 2:
        return np.zeros(len(truth.positions), dtype=np.bool_)
    # A step wider than this between neighbours is the end of the field of view.
    gap = 3.0 * float(np.median(np.diff(bearings)))
    # Its sides may be seen farther out than the corner may be.
    ranges, _ = cast_beams(lidar_pose, bearings, truth.segments, truth.circles, limits.max_range + limits.min_side)
    sides, normals = truth.sides()
    return _visible(
        np.asarray(lidar_pose, dtype=np.float64),
        bearings,
        ranges,
        gap,
        truth.positions,
        sides,
        normals,
        float(limits.max_range),
        math.sin(math.radians(limits.min_incidence_deg)),
        limits.min_beams,
        float(limits.min_side),
    )


@kernel
def _cast(
    x: float, y: float, bearings: Floats, segments: Floats, circles: Floats, max_range: float
) -> tuple[Floats, Ints]:
    ranges = np.full(bearings.size, np.inf)
    hits = np.full(bearings.size, -1, dtype=np.int64)
    for i in range(bearings.size):
        ex, ey = math.cos(bearings[i]), math.sin(bearings[i])
        best = max_range
        for j in range(segments.shape[0]):
            ax, ay = segments[j, 0, 0] - x, segments[j, 0, 1] - y
            dx, dy = segments[j, 1, 0] - segments[j, 0, 0], segments[j, 1, 1] - segments[j, 0, 1]
            across = ex * dy - ey * dx
            if abs(across) < 1e-15:
                continue
            along = (ax * dy - ay * dx) / across
            share = (ax * ey - ay * ex) / across
            if 0.0 < along < best and -1e-12 <= share <= 1.0 + 1e-12:
                best = along
                hits[i] = j
        for j in range(circles.shape[0]):
            cx, cy, radius = circles[j, 0] - x, circles[j, 1] - y, circles[j, 2]
            middle = ex * cx + ey * cy
            inside = radius * radius - (cx * cx + cy * cy - middle * middle)
            if inside < 0.0:
                continue
            along = middle - math.sqrt(inside)
            if 0.0 < along < best:
                best = along
                hits[i] = segments.shape[0] + j
        if hits[i] >= 0:
            ranges[i] = best
    return ranges, hits


@kernel
def _visible(
    pose: Floats,
    bearings: Floats,
    ranges: Floats,
    gap: float,
    positions: Floats,
    sides: Floats,
    normals: Floats,
    max_range: float,
    min_sine: float,
    min_beams: int,
    min_side: float,
) -> NDArray[np.bool_]:
    visible = np.zeros(positions.shape[0], dtype=np.bool_)
    for c in range(positions.shape[0]):
        vx, vy = pose[0] - positions[c, 0], pose[1] - positions[c, 1]
        distance = math.hypot(vx, vy)
        if distance == 0.0 or distance > max_range:
            continue
        bearing = wrap_angle(math.atan2(-vy, -vx) - pose[2])
        start = np.searchsorted(bearings, bearing)
        seen = True
        for side in range(2):
            ux, uy = sides[c, side, 0], sides[c, side, 1]
            if vx * normals[c, side, 0] + vy * normals[c, side, 1] < min_sine * distance:
                seen = False
                break
            # Counter-clockwise of the corner as the lidar sees it, or clockwise.
            step = 1 if uy * -vx - ux * -vy > 0.0 else -1
            i = start if step == 1 else start - 1
            previous = bearing
            beams, reach = 0, 0.0
            while beams < bearings.size:
                i = i % bearings.size
                turn = step * wrap_angle(bearings[i] - previous)
                if turn < 0.0 or turn > gap or not math.isfinite(ranges[i]):
                    break
                previous = bearings[i]
                rx = ranges[i] * math.cos(previous + pose[2]) + vx
                ry = ranges[i] * math.sin(previous + pose[2]) + vy
                if abs(rx * uy - ry * ux) > _ON_SIDE:
                    break
                reach = rx * ux + ry * uy
                beams += 1
                if beams >= min_beams and reach >= min_side:
                    break
                i += step
            if beams < min_beams or reach < min_side:
                seen = False
                break
        visible[c] = seen
    return visible
