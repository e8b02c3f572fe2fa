"""Contour points with the direction of the surface at each: what is aligned, and what it is aligned to."""

import math

import numpy as np

from contourslam.contour.contours import Contours, Floats, Ints
from contourslam.kernels import kernel

REACH = 3  # neighbours to either side that a normal is fitted to


@kernel
def _orient(points: Floats, starts: Ints, closed: np.ndarray, spacing: float, bend: float, out: Floats) -> int:
    """Rows x, y, nx, ny of the points kept; returns their number."""
    count = 0
    for c in range(closed.size):
        a, n = starts[c], starts[c + 1] - starts[c]
        lastx, lasty = 1e18, 1e18
        for k in range(n):
            x, y = points[a + k, 0], points[a + k, 1]
            if (x - lastx) ** 2 + (y - lasty) ** 2 < spacing * spacing:
                continue
            sx = sy = sxx = sxy = syy = 0.0
            m = 0
            # Neighbours on one contour, no farther than a few beams and a short stretch of surface.
            for o in range(-REACH, REACH + 1):
                i = k + o
                if closed[c]:
                    i %= n
                elif i < 0 or i >= n:
                    continue
                dx, dy = points[a + i, 0] - x, points[a + i, 1] - y
                if abs(o) > 1 and dx * dx + dy * dy > bend * bend:
                    continue
                sx, sy, m = sx + dx, sy + dy, m + 1
                sxx, sxy, syy = sxx + dx * dx, sxy + dx * dy, syy + dy * dy
            if m < 3:
                continue
            sx, sy = sx / m, sy / m
            sxx, sxy, syy = sxx / m - sx * sx, sxy / m - sx * sy, syy / m - sy * sy
            spread = math.sqrt((sxx - syy) ** 2 + 4.0 * sxy * sxy)
            if sxx + syy <= 0.0 or spread < 0.6 * (sxx + syy):  # no surface but a corner or a clutter of points
                continue
            direction = 0.5 * math.atan2(2.0 * sxy, sxx - syy)
            nx, ny = -math.sin(direction), math.cos(direction)
            if nx * x + ny * y > 0.0:  # the surface faces the lidar
                nx, ny = -nx, -ny
            out[count, 0], out[count, 1], out[count, 2], out[count, 3] = x, y, nx, ny
            count += 1
            lastx, lasty = x, y
    return count


@kernel
def move(oriented: Floats, pose: Floats) -> Floats:
    """Oriented points given in the frame of `pose`, in the frame the pose is given in; a copy."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    out = np.empty_like(oriented)
    for i in range(oriented.shape[0]):
        x, y, nx, ny = oriented[i, 0], oriented[i, 1], oriented[i, 2], oriented[i, 3]
        out[i, 0], out[i, 1] = pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y
        out[i, 2], out[i, 3] = cos * nx - sin * ny, sin * nx + cos * ny
    return out


def oriented_points(contours: Contours, spacing: float = 0.04, bend: float = 0.3) -> Floats:
    """Points of the contours, thinned, with the normal of the surface at each.

    A normal is the direction of least spread among up to seven neighbours on the same contour; a point whose neighbours
    lie on no line, at a corner or amid clutter, is left out.

    Parameters
    ----------
    contours : Contours
        Raw contours, in the lidar's frame.
    spacing : float
        Least distance between two points kept, m: near surfaces would outvote far ones.
    bend : float
        Neighbours farther than this do not count for the normal, m, but for the nearest two.

    Returns
    -------
    ndarray, shape (n, 4)
        x, y (m) and the unit normal, which points to the lidar's side.
    """
    out = np.empty((len(contours.points), 4))
    count = _orient(contours.points, contours.starts, contours.closed, spacing, bend, out)
    return out[:count]
