"""Driving without physics: a unicycle that glides along waypoints; nothing touches or tips; cheap for any length."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.poses import compose, compose_one
from contourslam.robot.route import gently, wanted_twist
from contourslam.simulation.chance import FLAWS, stream
from contourslam.simulation.config import RobotModel
from contourslam.simulation.follower import ACCELERATION, TURN_ACCELERATION, Habits
from contourslam.simulation.rolling import TICK as ROLLING_TICK
from contourslam.simulation.rolling import Moments

Floats = NDArray[np.float64]
TICK = 0.05  # s: 20 Hz
_SPACING = 0.02  # m
_WINDOW = 40  # points of the way ahead among which the robot is looked for
_BRAKING = 45  # points: how far ahead a bend is seen in time to slow down for it
_SLOW = 0.4  # m/s before a bend
SLIP = 0.002
"""Standard deviation of a wheel's way after one metre, m; it grows with the root of the way."""


@dataclass(frozen=True, slots=True)
class Tick:
    """The truth about one moment.

    Attributes
    ----------
    time : float
        s, from 0.
    pose : ndarray, shape (3,)
        Of the base in the world frame: m, m, rad.
    advance, turn : float
        Way (m) and turn (rad) since the tick before, both even in between: the base moved along a circle.
    """

    time: float
    pose: Floats
    advance: float
    turn: float


def glide(waypoints: Iterable[tuple[float, float]], habits: Habits) -> Iterator[Tick]:
    """Drive along waypoints in pure pursuit (Coulter 1992), from the first, facing the second, until they end.

    Parameters
    ----------
    waypoints : iterable of (x, y)
        m, world frame; consumed as the robot gets there, so it may be endless.
    habits : Habits

    Yields
    ------
    Tick
        20 a second.
    """
    route = _Route(waypoints)
    first, second = route.ahead(0), route.ahead(1)
    pose = np.array([*first, np.arctan2(second[1] - first[1], second[0] - first[0])])
    time, v, omega, look_ahead = 0, 0.0, 0.0, round(habits.look_ahead / _SPACING)
    yield Tick(0.0, pose, 0.0, 0.0)
    while route.advance(float(pose[0]), float(pose[1])):
        x, y, heading = pose.tolist()
        cruise = habits.cruise(time * TICK)
        bend = wanted_twist((x, y, heading), route.ahead(_BRAKING), cruise, habits.turn_limit)
        if bend[0] < cruise or abs(bend[1]) > 0.5 * cruise:
            cruise = min(cruise, _SLOW)
        wanted = wanted_twist((x, y, heading), route.ahead(look_ahead), cruise, habits.turn_limit)
        v, omega = gently(v, wanted[0], ACCELERATION * TICK), gently(omega, wanted[1], TURN_ACCELERATION * TICK)
        time += 1
        pose = compose_one(pose, arc(v * TICK, omega * TICK))
        yield Tick(round(time * TICK, 9), pose, v * TICK, omega * TICK)


def arc(advance: float, turn: float) -> Floats:
    """Pose at the end of an arc of a circle with this length (m) and turn (rad), from its start, shape (3,)."""
    chord = advance * np.sinc(turn / (2 * np.pi))
    return np.array([chord * np.cos(turn / 2), chord * np.sin(turn / 2), turn])


class _Route:
    """The way ahead, a point each 2 cm; behind the robot nothing is kept. Mutable."""

    def __init__(self, waypoints: Iterable[tuple[float, float]]) -> None:
        self._coming = iter(waypoints)
        self._last = np.array(next(self._coming))
        self._points = self._last[None]
        self._index = 0
        self._fetch()

    def advance(self, x: float, y: float) -> bool:
        """Find the robot, at (x, y) m, on the way; False once it is at the end."""
        window = self._points[self._index : self._index + _WINDOW]
        self._index += int(np.argmin((window[:, 0] - x) ** 2 + (window[:, 1] - y) ** 2))
        self._fetch()
        return self._index < len(self._points) - 2

    def ahead(self, count: int) -> tuple[float, float]:
        """The point so many points ahead of the robot, m."""
        x, y = self._points[min(self._index + count, len(self._points) - 1)].tolist()
        return x, y

    def _fetch(self) -> None:
        while len(self._points) - self._index < 2 * _WINDOW and (following := next(self._coming, None)) is not None:
            step = np.array(following) - self._last
            count = round(float(np.hypot(*step)) / _SPACING)
            if count:
                parts = np.arange(1, count + 1)[:, None] / count
                self._points = np.concatenate([self._points[self._index :], self._last + parts * step])
                self._index, self._last = 0, np.array(following)


class Gliding:
    """Several robots without physics: each goes exactly as told, on wheels that slip a little. Mutable.

    Takes the place of :class:`~contourslam.simulation.rolling.Rolling`, with one moment a tick.

    Parameters
    ----------
    robot : RobotModel
    seeds : sequence of int
        Of each robot's slip.
    starts : sequence of (x, y, heading)
        m, m, rad.
    """

    spacing = ROLLING_TICK

    def __init__(self, robot: RobotModel, seeds: Sequence[int], starts: Sequence[tuple[float, float, float]]) -> None:
        self._robot, self._chances = robot, [stream(seed, FLAWS) for seed in seeds]
        self._poses, self._turned = np.array(starts, dtype=np.float64), np.zeros((len(starts), 2))
        self.begun = self._moment()

    def step(self, twists: Sequence[tuple[float, float]]) -> Moments:
        """Move on by a tick, 20 ms, along arcs of circles; returns the moment at its end."""
        advance, turn = np.array(twists, dtype=np.float64).T * ROLLING_TICK
        chord = advance * np.sinc(turn / (2 * np.pi))
        arcs = np.stack([chord * np.cos(turn / 2), chord * np.sin(turn / 2), turn], axis=1)
        self._poses = compose(self._poses, arcs)
        rolled = advance[:, None] + turn[:, None] * self._robot.wheel_base / 2 * np.array([-1.0, 1.0])
        luck = np.array([chance.standard_normal(2) for chance in self._chances])
        self._turned = self._turned + (rolled + SLIP * np.sqrt(np.abs(rolled)) * luck) / self._robot.wheel_radius
        return self._moment()

    def _moment(self) -> Moments:
        x, y, heading = self._poses.T
        cos, sin, zero, one = np.cos(heading), np.sin(heading), np.zeros(len(x)), np.ones(len(x))
        axes = np.moveaxis(np.array([[cos, -sin, zero], [sin, cos, zero], [zero, zero, one]]), 2, 0)
        positions = np.stack([x, y, np.full(len(x), self._robot.wheel_radius)], axis=1)
        return Moments(self._poses[None], positions[None], axes[None], self._turned[None])
