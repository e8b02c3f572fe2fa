"""Lines fitted to the points of a contour, each point weighted by what range noise does to it across the line."""

import math

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel

# A fitted line as a tuple of floats, the form that kernels hand on cheapest:
#   nx, ny      unit normal, pointing away from the lidar's side (right of the contour's direction)
#   cx, cy      weighted centroid, m
#   var_offset  variance of the distance along the normal at the centroid, m²
#   var_angle   variance of the direction, rad²
#   scatter     weighted rms residual in standard deviations
LineFit = tuple[float, float, float, float, float, float, float]


@kernel
def fit_line(points: Floats, first: int, last: int, wrap_a: int, wrap_n: int, sigma: float) -> LineFit:
    """Line through the points `first`..`last` (both included), weighted total least squares.

    The noise of a range moves a point along its beam, so across the line it counts with the cosine of the angle of
    incidence. Two passes: the first, unweighted, gives that angle. Where the points scatter more than `sigma` says, the
    variances grow with the scatter.

    Indices run from `wrap_a` on and wrap after `wrap_n` points.
    """
    nx, ny = 0.0, 0.0
    cx, cy, sw, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    count = last - first + 1
    for weighted in range(2):
        cx, cy, sw = 0.0, 0.0, 0.0
        for k in range(first, last + 1):
            i = wrap_a + (k - wrap_a) % wrap_n
            x, y = points[i, 0], points[i, 1]
            w = 1.0
            if weighted == 1:
                across = (nx * x + ny * y) ** 2 / (x * x + y * y + 1e-12)
                # The tenth keeps grazing beams, where other errors rule, from weighing without bound.
                w = 1.0 / (sigma * sigma * (across + 0.1))
            cx, cy, sw = cx + w * x, cy + w * y, sw + w
        cx, cy = cx / sw, cy / sw
        sxx, sxy, syy = 0.0, 0.0, 0.0
        for k in range(first, last + 1):
            i = wrap_a + (k - wrap_a) % wrap_n
            x, y = points[i, 0], points[i, 1]
            w = 1.0
            if weighted == 1:
                across = (nx * x + ny * y) ** 2 / (x * x + y * y + 1e-12)
                w = 1.0 / (sigma * sigma * (across + 0.1))
            dx, dy = x - cx, y - cy
            sxx, sxy, syy = sxx + w * dx * dx, sxy + w * dx * dy, syy + w * dy * dy
        direction = 0.5 * math.atan2(2.0 * sxy, sxx - syy)
        nx, ny = math.sin(direction), -math.cos(direction)
        # The right of the contour's direction is the far side of the wall.
        i, j = wrap_a + (first - wrap_a) % wrap_n, wrap_a + (last - wrap_a) % wrap_n
        if (points[j, 0] - points[i, 0]) * -ny + (points[j, 1] - points[i, 1]) * nx < 0.0:
            nx, ny = -nx, -ny
    along = sxx * ny * ny - 2.0 * sxy * nx * ny + syy * nx * nx
    across = max(sxx * nx * nx + 2.0 * sxy * nx * ny + syy * ny * ny, 0.0)
    scatter = across / max(count - 2, 1)
    inflate = max(scatter, 1.0)
    return nx, ny, cx, cy, inflate / sw, inflate / max(along, 1e-12), math.sqrt(scatter)


@kernel
def grow_line(
    points: Floats, start: int, step: int, limit: int, wrap_a: int, wrap_n: int, least: float, most: float, sigma: float
) -> int:
    """Index of the last point that still lies on the straight line begun at `start`; -1 if no line begins there.

    The line takes in one point after the other, forwards or backwards (`step` +1 or -1) up to `limit`, as long as the
    next one lies within three standard deviations; one stray point is passed over, two end it.
    """
    count = 0
    mx = my = mxx = mxy = myy = 0.0
    x0, y0 = points[wrap_a + (start - wrap_a) % wrap_n, 0], points[wrap_a + (start - wrap_a) % wrap_n, 1]
    end, strays = -1, 0
    k = start
    while (limit - k) * step >= 0:
        i = wrap_a + (k - wrap_a) % wrap_n
        x, y = points[i, 0] - x0, points[i, 1] - y0
        length = math.hypot(x, y)
        if length > most:
            break
        if count >= 3 and length > least:
            vx, vy = mx / count, my / count
            sxx, sxy, syy = mxx - count * vx * vx, mxy - count * vx * vy, myy - count * vy * vy
            # Direction of the largest spread: eigenvector of the scatter matrix, by square roots alone.
            spread = math.sqrt((sxx - syy) * (sxx - syy) + 4.0 * sxy * sxy)
            tx, ty = (spread + sxx - syy, 2.0 * sxy) if sxx >= syy else (2.0 * sxy, spread + syy - sxx)
            if abs(ty * (x - vx) - tx * (y - vy)) > math.sqrt(tx * tx + ty * ty) * 3.0 * sigma:
                strays += 1
                if strays > 1:
                    break
                k += step
                continue
            strays = 0
        count += 1
        mx, my, mxx, mxy, myy = mx + x, my + y, mxx + x * x, mxy + x * y, myy + y * y
        end = k
        k += step
    return end
