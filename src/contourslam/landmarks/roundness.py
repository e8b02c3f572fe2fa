"""Round columns, whose silhouette a detector takes for a corner although nothing on it is a fixed point."""

import math

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel
from contourslam.landmarks.line_fit import LineFit


@kernel
def is_round(
    points: Floats, end1: int, vertex: int, end2: int, a: int, n: int, first: LineFit, second: LineFit
) -> bool:
    """Whether one circle fits the two sides better than their two lines do, as on a column.

    The circle is Kasa's (1976): least squares in the squared distance, so that it needs no iteration. Neither of the
    two knows the range noise, so the test holds at any.
    """
    count = end2 - end1
    cx = cy = 0.0
    for k in range(end1, end2 + 1):
        if k != vertex:
            i = a + (k - a) % n
            cx, cy = cx + points[i, 0] / count, cy + points[i, 1] / count
    suu = suv = svv = su = sv = lines = 0.0
    for k in range(end1, end2 + 1):
        if k != vertex:
            i = a + (k - a) % n
            x, y = points[i, 0], points[i, 1]
            u, v = x - cx, y - cy
            square = u * u + v * v
            suu, suv, svv = suu + u * u, suv + u * v, svv + v * v
            su, sv = su + 0.5 * u * square, sv + 0.5 * v * square
            nx, ny, px, py = first[:4] if k < vertex else second[:4]
            lines += (nx * (x - px) + ny * (y - py)) ** 2
    determinant = suu * svv - suv * suv
    if determinant <= 0.0:
        return False
    u0, v0 = (svv * su - suv * sv) / determinant, (suu * sv - suv * su) / determinant
    radius = math.sqrt(u0 * u0 + v0 * v0 + (suu + svv) / count)
    circle = 0.0
    for k in range(end1, end2 + 1):
        if k != vertex:
            i = a + (k - a) % n
            circle += (math.hypot(points[i, 0] - cx - u0, points[i, 1] - cy - v0) - radius) ** 2
    return circle < lines
