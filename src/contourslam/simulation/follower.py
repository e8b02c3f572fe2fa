"""The human with the joystick: follows the route on what it sees, the true pose (pure pursuit, Coulter 1992)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel
from contourslam.robot.route import gently, wanted_twist

Floats = NDArray[np.float64]
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


class Follower:
    """Steers along a route, lap after lap. Mutable: it remembers how far it has come and how fast it goes.

    Parameters
    ----------
    route : ndarray, shape (n, 2)
        From :func:`contourslam.robot.route.sample_route`.
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

    @property
    def index(self) -> int:
        """Of the point of the route where the robot is, counted on from lap to lap."""
        return self._index

    def steer(
        self, pose: tuple[float, float, float], time: float, dt: float, most: float = math.inf
    ) -> tuple[float, float]:
        """Forward speed (m/s), at the most so much, and turning speed (rad/s) wanted at a true pose and a time (s)."""
        habits, count = self._habits, len(self._route)
        self._index += _nearest(self._route, self._index, pose[0], pose[1])
        target = self._route[(self._index + round(habits.look_ahead / self._spacing)) % count]
        cruise = min(habits.cruise(time), most)
        v, omega = wanted_twist(pose, (float(target[0]), float(target[1])), cruise, habits.turn_limit)
        self._v, self._omega = gently(self._v, v, ACCELERATION * dt), gently(self._omega, omega, TURN_ACCELERATION * dt)
        return self._v, self._omega


@kernel
def _nearest(route: Floats, first: int, x: float, y: float) -> int:
    """How many points from the first on the nearest of the next ones is."""
    best, found = math.inf, 0
    for step in range(_WINDOW):
        point = (first + step) % len(route)
        off = (route[point, 0] - x) ** 2 + (route[point, 1] - y) ** 2
        if off < best:
            best, found = off, step
    return found
