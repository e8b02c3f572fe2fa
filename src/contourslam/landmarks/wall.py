"""Walls: the straight pieces of the contours, with the covariance of their line and of their end points."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.config import LandmarkConfig
from contourslam.contour.contours import Contours, Floats, Ints
from contourslam.kernels import kernel
from contourslam.landmarks.line_fit import fit_line, grow_line


@dataclass(frozen=True, slots=True)
class Walls:
    """Wall segments seen in one scan, one row each, in the lidar's frame at the scan's stamp.

    Attributes
    ----------
    end_points : ndarray, shape (k, 2, 2)
        First and last point, counter-clockwise as the lidar sees them, m.
    lines : ndarray, shape (k, 2)
        Direction of the normal that points from the lidar into the wall, rad; distance of the line from the lidar, m.
    covariances : ndarray, shape (k, 2, 2)
        Covariance of `lines`.
    end_point_covariances : ndarray, shape (k, 2, 2, 2)
        Covariance of each end point: the line's across the wall, along it that of where the last beam fell, m².
    """

    end_points: Floats
    lines: Floats
    covariances: Floats
    end_point_covariances: Floats

    def __len__(self) -> int:
        return len(self.lines)


@kernel
def _extract(
    points: Floats, starts: Ints, closed: np.ndarray, sigma: float, min_wall: float, min_points: int, floor: float,
    angle_floor: float,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Rows of x1, y1, x2, y2, normal, distance; covariances of the line; covariances of the ends."""
    most = points.shape[0] // max(min_points, 1) + 1
    rows = np.empty((most, 6))
    lines = np.empty((most, 2, 2))
    ends = np.empty((most, 2, 2, 2))
    count = 0
    for c in range(closed.size):
        a, n = starts[c], starts[c + 1] - starts[c]
        first = a
        while first + min_points <= a + n and count < most:
            last = grow_line(points, first, 1, a + n - 1, a, n, 0.5 * min_wall, 1e9, sigma)
            # Two points at either end may already lie round the corner.
            i, j = first + 1, last - 1
            length = 0.0
            if j - i + 1 >= min_points:
                length = math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
            if length < min_wall:
                first += 1
                continue
            nx, ny, cx, cy, var_offset, var_angle, scatter = fit_line(points, i, j, a, n, sigma)
            if scatter > 2.5:
                first += 1
                continue
            var_offset, var_angle = var_offset + floor * floor, var_angle + angle_floor * angle_floor
            tx, ty = -ny, nx
            lever = tx * cx + ty * cy  # from the foot of the normal to the centroid
            rows[count, 4], rows[count, 5] = math.atan2(ny, nx), nx * cx + ny * cy
            lines[count, 0, 0] = var_angle
            lines[count, 0, 1] = lines[count, 1, 0] = lever * var_angle
            lines[count, 1, 1] = var_offset + lever * lever * var_angle
            for e in range(2):
                k = i if e == 0 else j
                along = tx * (points[k, 0] - cx) + ty * (points[k, 1] - cy)
                rows[count, 2 * e], rows[count, 2 * e + 1] = cx + along * tx, cy + along * ty
                m = k + 1 if e == 0 else k - 1
                gap = math.hypot(points[k, 0] - points[m, 0], points[k, 1] - points[m, 1])
                across, lengthwise = var_offset + along * along * var_angle, gap * gap + sigma * sigma
                ends[count, e, 0, 0] = nx * nx * across + tx * tx * lengthwise
                ends[count, e, 0, 1] = ends[count, e, 1, 0] = nx * ny * across + tx * ty * lengthwise
                ends[count, e, 1, 1] = ny * ny * across + ty * ty * lengthwise
            count += 1
            first = last
    return rows[:count], lines[:count], ends[:count]


def extract_walls(contours: Contours, sigma_range: float, config: LandmarkConfig) -> Walls:
    """Extract the straight pieces of the contours and fit a line to each.

    A line grows along the contour while the next point lies within three standard deviations of it; the fit weighs each
    point by the angle of incidence of its beam.

    Parameters
    ----------
    contours : Contours
        Raw contours.
    sigma_range : float
        Standard deviation of a range, m.
    config : LandmarkConfig

    Returns
    -------
    Walls
    """
    rows, covariances, ends = _extract(
        contours.points, contours.starts, contours.closed, sigma_range, config.min_wall, config.min_wall_points,
        config.position_floor, math.radians(config.angle_floor_deg),
    )  # fmt: skip
    # Copies, for the same reason as a corner's.
    return Walls(rows[:, :4].copy().reshape(-1, 2, 2), rows[:, 4:6].copy(), covariances, ends)
