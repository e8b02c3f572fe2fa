"""Measurement model: what the lidar should see of each landmark, and its Jacobians (eqs 29-30).

A corner has two numbers, its position (x, y) in the world; it is measured as range and bearing (eq. 29). A wall has two
as well, the direction of its normal and its distance along it from a fixed point near the wall, its anchor, so that
direction and distance stay nearly uncorrelated however far the world's origin is; it is measured as the direction and
distance of the line seen from the lidar. The lidar sits at any pose on the base; eq. (30) is the case (d, 0, 0).
"""

import math

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel

CORNER, WALL = 0.0, 1.0

# Columns of the landmark table that travels to the kernels.
KIND, ANCHOR_X, ANCHOR_Y, FIRST_A, FIRST_B, DIRECTION, OPENING, CONVEX, START, END = range(10)
COLUMNS = 10


@kernel
def measure_corner(pose: Floats, mount: Floats, x: float, y: float) -> tuple[float, float]:
    """Range and bearing of the point (x, y) from the lidar (eqs 29-30)."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    dx = x - (pose[0] + cos * mount[0] - sin * mount[1])
    dy = y - (pose[1] + sin * mount[0] + cos * mount[1])
    bearing = math.atan2(dy, dx) - pose[2] - mount[2]
    return math.hypot(dx, dy), -((-bearing + math.pi) % (2.0 * math.pi) - math.pi)


@kernel
def measure_wall(
    pose: Floats, mount: Floats, normal: float, distance: float, anchor_x: float, anchor_y: float
) -> tuple[float, float]:
    """Direction of the wall's normal and distance of its line, seen from the lidar."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    dx = pose[0] + cos * mount[0] - sin * mount[1] - anchor_x
    dy = pose[1] + sin * mount[0] + cos * mount[1] - anchor_y
    direction = normal - pose[2] - mount[2]
    direction = -((-direction + math.pi) % (2.0 * math.pi) - math.pi)
    return direction, distance - math.cos(normal) * dx - math.sin(normal) * dy


@kernel
def _corner_jacobians(pose: Floats, mount: Floats, x: float, y: float, by_pose: Floats, by_landmark: Floats) -> None:
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    ox, oy = cos * mount[0] - sin * mount[1], sin * mount[0] + cos * mount[1]
    dx, dy = x - pose[0] - ox, y - pose[1] - oy
    q = max(dx * dx + dy * dy, 1e-12)
    r = math.sqrt(q)
    by_landmark[0, 0], by_landmark[0, 1] = dx / r, dy / r
    by_landmark[1, 0], by_landmark[1, 1] = -dy / q, dx / q
    by_pose[0, 0], by_pose[0, 1] = -dx / r, -dy / r
    by_pose[1, 0], by_pose[1, 1] = dy / q, -dx / q
    # Turning the base moves the lidar by (-oy, ox).
    by_pose[0, 2] = (dx * oy - dy * ox) / r
    by_pose[1, 2] = -(dy * oy + dx * ox) / q - 1.0


@kernel
def _wall_jacobians(
    pose: Floats, mount: Floats, normal: float, anchor_x: float, anchor_y: float, by_pose: Floats, by_landmark: Floats
) -> None:
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    ox, oy = cos * mount[0] - sin * mount[1], sin * mount[0] + cos * mount[1]
    dx, dy = pose[0] + ox - anchor_x, pose[1] + oy - anchor_y
    nx, ny = math.cos(normal), math.sin(normal)
    by_pose[0, 0], by_pose[0, 1], by_pose[0, 2] = 0.0, 0.0, -1.0
    by_pose[1, 0], by_pose[1, 1], by_pose[1, 2] = -nx, -ny, nx * oy - ny * ox
    by_landmark[0, 0], by_landmark[0, 1] = 1.0, 0.0
    by_landmark[1, 0], by_landmark[1, 1] = ny * dx - nx * dy, 1.0


@kernel
def predict_measurements(
    pose: Floats, mount: Floats, mean: Floats, table: Floats, count: int, first_estimates: bool
) -> tuple[Floats, Floats, Floats]:
    """Measurement of every landmark as the filter expects it, with its Jacobians.

    Parameters
    ----------
    pose, mount : ndarray, shape (3,)
        ``T_world_base`` and ``T_base_lidar``.
    mean : ndarray
        State; landmark i stands at 3 + 2 i.
    table : ndarray, shape (>= count, COLUMNS)
        What is fixed about each landmark.
    count : int
        Number of landmarks.
    first_estimates : bool
        Take the Jacobians at each landmark's first estimate (Huang, Mourikis and Roumeliotis 2010).

    Returns
    -------
    expected : ndarray, shape (count, 2)
        Range (m) and bearing (rad) of a corner; direction (rad) and distance (m) of a wall.
    by_pose : ndarray, shape (count, 2, 3)
    by_landmark : ndarray, shape (count, 2, 2)
    """
    expected = np.empty((count, 2))
    by_pose = np.empty((count, 2, 3))
    by_landmark = np.empty((count, 2, 2))
    for i in range(count):
        a, b = mean[3 + 2 * i], mean[4 + 2 * i]
        fa, fb = (table[i, FIRST_A], table[i, FIRST_B]) if first_estimates else (a, b)
        if table[i, KIND] == CORNER:
            expected[i, 0], expected[i, 1] = measure_corner(pose, mount, a, b)
            _corner_jacobians(pose, mount, fa, fb, by_pose[i], by_landmark[i])
        else:
            ax, ay = table[i, ANCHOR_X], table[i, ANCHOR_Y]
            expected[i, 0], expected[i, 1] = measure_wall(pose, mount, a, b, ax, ay)
            _wall_jacobians(pose, mount, fa, ax, ay, by_pose[i], by_landmark[i])
    return expected, by_pose, by_landmark


@kernel
def innovation(kind: float, seen: Floats, expected: Floats) -> tuple[float, float]:
    """Seen less expected, the angle wrapped: the bearing of a corner, the direction of a wall."""
    first, second = seen[0] - expected[0], seen[1] - expected[1]
    if kind == CORNER:
        second = -((-second + math.pi) % (2.0 * math.pi) - math.pi)
    else:
        first = -((-first + math.pi) % (2.0 * math.pi) - math.pi)
    return first, second
