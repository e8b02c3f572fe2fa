"""The way that a robot shall go: points along it, and the turn that leads back to it (pure pursuit, Coulter 1992)."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
SPACING = 0.01
"""Between two points of a way, m."""
_LEAST = 200  # points


def sample_route(waypoints: Sequence[tuple[float, float]], *, closed: bool = True) -> Floats:
    """Points a centimetre apart along a way.

    Parameters
    ----------
    waypoints : sequence of (float, float)
        m.
    closed : bool
        The last leads back to the first.

    Returns
    -------
    ndarray, shape (n, 2)
        m.
    """
    corners = np.array([*waypoints, *waypoints[: int(closed)]], dtype=np.float64)
    reached = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    along = np.linspace(0.0, reached[-1], max(int(reached[-1] / SPACING), _LEAST), endpoint=not closed)
    return np.stack([np.interp(along, reached, corners[:, 0]), np.interp(along, reached, corners[:, 1])], axis=1)


def wanted_twist(
    pose: tuple[float, float, float], target: tuple[float, float], cruise: float, turn_limit: float
) -> tuple[float, float]:
    """Forward (m/s) and turning speed (rad/s) along the circle from a pose (x, y, heading) through a target (m)."""
    dx, dy = target[0] - pose[0], target[1] - pose[1]
    bearing = (math.atan2(dy, dx) - pose[2] + math.pi) % (2 * math.pi) - math.pi
    if abs(bearing) > math.pi / 2:  # the route goes on behind: turn on the spot
        return 0.0, math.copysign(turn_limit, bearing)
    curvature = 2.0 * math.sin(bearing) / max(math.hypot(dx, dy), 0.1)
    v = min(cruise, turn_limit / max(abs(curvature), 1e-6))
    return v, v * curvature


def gently(now: float, wanted: float, most: float) -> float:
    """Go from one value towards another, by no more than `most`."""
    return now + min(max(wanted - now, -most), most)
