"""A scan cut into contours where neighbouring beams fall on different surfaces."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.config import ContourConfig
from contourslam.contour.contours import Contours, Floats, Ints
from contourslam.geometry.angles import wrap
from contourslam.kernels import kernel


@kernel
def _break_distance(reach: float, step: float, shallowest: float, allowance: float, max_gap: float) -> float:
    """Farthest that a next point on the same surface can lie (Borges and Aldon 2004, eq. 5)."""
    if step >= shallowest:
        return max_gap
    # sin(step) / sin(shallowest - step), with one trigonometric function left inside the loop over the beams
    slope = math.tan(step)
    return min(reach * slope / (math.sin(shallowest) - math.cos(shallowest) * slope) + allowance, max_gap)


@kernel
def _mixed_pixels(ranges: Floats, allowance: float) -> NDArray[np.bool_]:
    """Single points hanging between a near and a far surface, where the beam's spot touched both."""
    mixed = np.zeros(ranges.size, dtype=np.bool_)
    for i in range(2, ranges.size - 2):
        before, after = ranges[i] - ranges[i - 1], ranges[i + 1] - ranges[i]
        if before * after <= 0.0 or min(abs(before), abs(after)) < allowance:
            continue
        # On a wall seen at a shallow angle the steps go on to both sides; here they do not.
        calm = 0.3 * min(abs(before), abs(after))
        mixed[i] = abs(ranges[i - 1] - ranges[i - 2]) < calm and abs(ranges[i + 2] - ranges[i + 1]) < calm
    return mixed


@kernel
def _segment(
    points: Floats,
    bearings: Floats,
    beams: Ints,
    ring: bool,
    beam_count: int,
    shallowest: float,
    allowance: float,
    max_gap: float,
    max_missing: int,
    min_points: int,
) -> tuple[Floats, Ints, NDArray[np.bool_]]:
    ranges = np.hypot(points[:, 0], points[:, 1])
    keep = np.flatnonzero(~_mixed_pixels(ranges, allowance))
    n = keep.size
    cut = np.ones(n + 1, dtype=np.bool_)  # cut[i]: a contour starts at i, seen from the point before it
    for i in range(n):
        if i == 0 and not ring:
            continue
        a, b = keep[i - 1], keep[i]  # i = 0 wraps to the last point
        missing = (beams[b] - beams[a]) % beam_count - 1
        step = abs(bearings[b] - bearings[a])
        step = min(step, 2.0 * math.pi - step)
        gap = math.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1])
        cut[i] = missing > max_missing or gap > min(allowance, max_gap)
        if missing <= max_missing and cut[i]:  # most points lie closer than the noise alone allows
            cut[i] = gap > _break_distance(min(ranges[a], ranges[b]), step, shallowest, allowance, max_gap)
    first = 0
    while first < n and not cut[first]:
        first += 1
    closed_ring = n > 0 and first == n
    if closed_ring:
        first = 0
    out = np.empty((n, 2))
    starts = np.empty(n + 1, dtype=np.int64)
    starts[0] = 0
    count = filled = begin = 0
    for j in range(n):
        i = (first + j) % n
        if j > 0 and cut[i]:
            if filled - begin >= min_points:
                count += 1
                starts[count] = filled
            else:
                filled = begin
            begin = filled
        out[filled] = points[keep[i]]
        filled += 1
    if filled - begin >= min_points:
        count += 1
        starts[count] = filled
    closed = np.zeros(count, dtype=np.bool_)
    if closed_ring and count == 1:
        closed[0] = True
    return out[: starts[count]], starts[: count + 1], closed


def _in_order(points: Floats, bearings: Floats, beams: Ints) -> tuple[Floats, Floats, Ints]:
    """Sort the beams by direction where the lidar did not deliver them so: shuffled, or angles that wrap."""
    steps = bearings[1:] - bearings[:-1]
    if (steps >= 0.0).all() or (steps <= 0.0).all():
        return points, bearings, beams
    unwrapped = np.unwrap(bearings)
    steps = np.diff(unwrapped)
    if (steps >= 0.0).all() or (steps <= 0.0).all():
        return points, unwrapped, beams
    order = np.argsort(wrap(bearings), kind="stable")
    return points[order], wrap(bearings)[order], np.arange(len(beams), dtype=np.int64)


def segment(
    points: Floats, bearings: Floats, beams: Ints, beam_count: int, sigma_range: float, config: ContourConfig
) -> Contours:
    """Cut the points of a scan into contours.

    A contour ends where the next point is farther off than any surface at a plausible angle could put it (Borges
    and Aldon 2004), where more than a few beams returned nothing, and at the ends of the field of view; a scan over
    the full turn wraps. Mixed pixels and contours of very few points are dropped.

    Parameters
    ----------
    points : ndarray, shape (m, 2)
        Points in the lidar's frame, m.
    bearings : ndarray, shape (m,)
        Direction of each point's beam, rad; ascending or descending.
    beams : ndarray of int, shape (m,)
        Beam number of each point.
    beam_count : int
        Number of beams of the whole scan.
    sigma_range : float
        Standard deviation of a range, m.
    config : ContourConfig

    Returns
    -------
    Contours
        Raw contours, counter-clockwise.
    """
    if len(points) == 0:
        return Contours(np.empty((0, 2)), np.zeros(1, np.int64), np.zeros(0, np.bool_), 0.0, np.empty(0))
    points, bearings, beams = _in_order(points, bearings, beams)
    span = abs(float(bearings[-1] - bearings[0])) / max(int(beams[-1] - beams[0]), 1)
    # The turn rarely is a whole number of beams; the last gap may be as wide as any other that a contour goes on over.
    ring = span * (beam_count + config.max_missing) >= 2.0 * math.pi
    if bearings[-1] < bearings[0]:
        points, bearings, beams = points[::-1], bearings[::-1], (beam_count - 1 - beams)[::-1]
    out, starts, closed = _segment(
        np.ascontiguousarray(points),
        np.ascontiguousarray(bearings),
        np.ascontiguousarray(beams),
        ring,
        beam_count,
        math.radians(config.breakpoint_angle_deg),
        config.breakpoint_sigmas * sigma_range,
        config.max_gap,
        config.max_missing,
        config.min_points,
    )
    return Contours(out, starts, closed, 0.0, np.arange(len(out), dtype=np.float64))
