"""The human with the joystick: follows the route on what it sees, the true pose (pure pursuit, Coulter 1992)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_SPACING = 0.01  # m
_WINDOW = 100  # points of the route ahead among which the robot is looked for
ACCELERATION, TURN_ACCELERATION = 0.5, 3.0  # m/s², rad/s²


@dataclass(frozen=True, slots=True)
class Habits:
    """How somebody drives: cruising speed and its slow swing (m/s, fraction, s, rad), fastest turn, look-ahead."""

    speed: float
    swing: float
    period: float
    phase: float
    turn_limit: float = 0.9
    """rad/s."""
    look_ahead: float = 0.4
    """m."""

    def cruise(self, time: float) -> float:
        """Speed wanted on a straight at a time (s), m/s."""
        return self.speed * (1.0 + self.swing * math.sin(2 * math.pi * time / self.period + self.phase))


def sample_route(waypoints: tuple[tuple[float, float], ...]) -> Floats:
    """Points a centimetre apart along the closed route, shape (n, 2), m."""
    corners = np.array([*waypoints, waypoints[0]], dtype=np.float64)
    reached = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    along = np.linspace(0.0, reached[-1], max(int(reached[-1] / _SPACING), 2 * _WINDOW), endpoint=False)
    return np.stack([np.interp(along, reached, corners[:, 0]), np.interp(along, reached, corners[:, 1])], axis=1)


class Follower:
    """Steers along a route, lap after lap. Mutable: it remembers how far it has come and how fast it goes.

    Parameters
    ----------
    route : ndarray, shape (n, 2)
        From :func:`sample_route`.
    habits : Habits
    first : int
        Index of the route's point where the robot starts.
    """

    def __init__(self, route: Floats, habits: Habits, first: int) -> None:
        self._route, self._habits = route, habits
        self._first = self._index = first
        self._spacing = float(np.hypot(*(route[1] - route[0])))
        self._v = self._omega = 0.0

    @property
    def laps(self) -> float:
        """How many laps have been driven since the start."""
        return (self._index - self._first) / len(self._route)

    def steer(self, pose: tuple[float, float, float], time: float, dt: float) -> tuple[float, float]:
        """Forward speed (m/s) and turning speed (rad/s) wanted at a true pose (x, y, heading) and a time (s)."""
        habits, count = self._habits, len(self._route)
        x, y, _ = pose
        ahead = self._route[(self._index + np.arange(_WINDOW)) % count]
        self._index += int(np.argmin((ahead[:, 0] - x) ** 2 + (ahead[:, 1] - y) ** 2))
        target = self._route[(self._index + round(habits.look_ahead / self._spacing)) % count]
        cruise = habits.cruise(time)
        v, omega = wanted_twist(pose, (float(target[0]), float(target[1])), cruise, habits.turn_limit)
        self._v, self._omega = gently(self._v, v, ACCELERATION * dt), gently(self._omega, omega, TURN_ACCELERATION * dt)
        return self._v, self._omega


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
