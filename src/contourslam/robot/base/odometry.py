"""Odometry of the base: the wheels' ways as arcs, turns shared between wheels and gyroscope, and how well all is known.

Each wheel's way is uncertain by an amount that grows with the root of it (Chong and Kleeman, Accurate odometry and
error modelling for a mobile robot, ICRA 1997). The gyroscope's bias is a state of the Kalman filter: at rest, where the
wheels say that nothing turns, it is found within a second, and it is followed slowly in motion. Its scale is not
estimated, as the wheels know it no better, but its doubt is carried along (Schmidt 1966, a "considered" parameter).
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.robot.config import BaseConfig
from contourslam.scan import Odometry

Floats = NDArray[np.float64]

FIRST_BIAS = 0.1  # rad/s; an MPU-9250's data sheet allows 5 degrees/s
_REST = 1e-10  # rad², variance of a turn in one step at rest
# s over which the wheels' speeds are taken for their noise: a base that creeps from tick to tick does not rest between,
# and steps with a tick must count no less than those without, or the mean of both is off.
_STEADY = 0.3
_WINDOW = 10  # steps over which wheels and gyroscope are held against each other
_SLIP = 25.0  # squared standard deviations by which they then differ where a wheel slips
_LONG = 0.2  # s; over a longer gap the way need not have been one arc
_JERK = 1.0  # rad/s²; how fast the rate of turn may change unseen in a gap


@dataclass(frozen=True, slots=True)
class BaseOdometry:
    """Where the base is by its own account, and how it moves.

    Attributes
    ----------
    stamp : float
        s.
    pose : ndarray, shape (3,)
        Base in the odometry frame, which starts where the base was first seen: m, m, rad.
    covariance : ndarray, shape (3, 3)
        Of `pose`, grown since the start.
    speed, turn_rate : float
        m/s ahead, rad/s to the left.
    twist_covariance : ndarray, shape (2, 2)
        Of these two.
    slipping : bool
        Wheels and gyroscope do not agree.
    """

    stamp: float
    pose: Floats
    covariance: Floats
    speed: float
    turn_rate: float
    twist_covariance: Floats
    slipping: bool

    def reading(self) -> Odometry:
        """Give the pose as SLAM takes it."""
        return Odometry(self.stamp, self.pose)


def arc(pose: Floats, way: float, aside: float, turn: float) -> Floats:
    """Pose after an arc.

    Parameters
    ----------
    pose : ndarray, shape (3,)
        Before: m, m, rad.
    way, turn : float
        Length of the arc, m, and the angle turned along it, rad.
    aside : float
        Slip to the left of the chord, m.
    """
    middle, chord = pose[2] + 0.5 * turn, way * _chord(turn)
    cos, sin = math.cos(middle), math.sin(middle)
    return np.array(
        [
            pose[0] + chord * cos - aside * sin,
            pose[1] + chord * sin + aside * cos,
            float(wrap(np.array(pose[2] + turn))),
        ]
    )


def arc_jacobian(pose: Floats, way: float, aside: float, turn: float) -> Floats:
    """Derivative of :func:`arc` by pose, way, aside and turn, shape (3, 6)."""
    middle, chord = pose[2] + 0.5 * turn, way * _chord(turn)
    cos, sin = math.cos(middle), math.sin(middle)
    dx, dy = chord * cos - aside * sin, chord * sin + aside * cos
    # The chord over the arc is sin(t/2) / (t/2); its derivative to third order serves any turn of one step.
    bend = (
        way * (-turn / 12.0 + turn**3 / 480.0)
        if abs(turn) < 0.3
        else way * (math.cos(0.5 * turn) - _chord(turn)) / turn
    )
    return np.array(
        [
            [1.0, 0.0, -dy, _chord(turn) * cos, -sin, bend * cos - 0.5 * dy],
            [0.0, 1.0, dx, _chord(turn) * sin, cos, bend * sin + 0.5 * dx],
            [0.0, 0.0, 1.0, 0.0, 0.0, 1.0],
        ]
    )


def _chord(turn: float) -> float:
    half = 0.5 * turn
    return math.sin(half) / half if abs(half) > 1e-4 else 1.0 - half * half / 6.0


class Odometer:
    """Adds up the ways of the wheels; changed in place.

    Parameters
    ----------
    config : BaseConfig

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Base in the odometry frame: m, m, rad.
    bias : float
        Of the gyroscope about the upright axis, rad/s.
    slipping : bool
        Wheels and gyroscope do not agree.
    """

    def __init__(self, config: BaseConfig) -> None:
        self._config = config
        self.pose: Floats = np.zeros(3)
        self.bias, self.slipping = 0.0, False
        # Of x, y, heading, bias, and the gyroscope's scale, which is never corrected.
        self._covariance = np.diag([1e-12, 1e-12, 1e-12, FIRST_BIAS**2, config.gyro_scale_sigma**2])
        self._slipped, self._rests = 0.0, True
        self._rolled: deque[tuple[float, float, float]] = deque()
        tick = float((config.metres_per_tick**2).sum()) / 6.0  # variance of a difference of two counts, both wheels'
        self._rounding = np.diag([0.25 * tick, tick / config.wheel_base**2])  # of way and turn
        self._recent: deque[tuple[float, float, float, float]] = deque(maxlen=_WINDOW)
        self._rate: float | None = None
        self._speed, self._turn_rate, self._twist_covariance = 0.0, 0.0, np.zeros((2, 2))

    @property
    def covariance(self) -> Floats:
        """Of the pose, shape (3, 3)."""
        return self._covariance[:3, :3].copy()

    @property
    def bias_sigma(self) -> float:
        """Standard deviation of the bias, rad/s."""
        return math.sqrt(self._covariance[3, 3])

    def now(self, stamp: float) -> BaseOdometry:
        """Give what is known, as of a time (s)."""
        twist_covariance = self._twist_covariance.copy()
        return BaseOdometry(
            stamp, self.pose.copy(), self.covariance, self._speed, self._turn_rate, twist_covariance, self.slipping
        )

    def step(self, ways: Floats, duration: float, rate: float | None, rate_span: float | None = None) -> None:
        """Go on by what the wheels rolled and the gyroscope measured.

        Parameters
        ----------
        ways : ndarray, shape (2,)
            Of the left and the right wheel since the last step, m.
        duration : float
            Of the step, s, above 0.
        rate : float or None
            Mean of the gyroscope about the upright axis over the last `rate_span` seconds of the step (by default all
            of it), rad/s; None where there is none.
        rate_span : float, optional
            s.
        """
        config, wheel_base = self._config, self._config.wheel_base
        left, right = float(ways[0]), float(ways[1])
        way, turn = 0.5 * (left + right), (right - left) / wheel_base
        spread_left, spread_right = self._spread(abs(left), abs(right), duration)
        self._covariance[3, 3] += config.gyro_bias_walk**2 * duration
        joint = np.zeros((8, 8))  # of the state, and of the step's way, slip aside, and turn
        joint[:5, :5] = self._covariance
        joint[5, 5] = 0.25 * (spread_left + spread_right) + 1e-14
        joint[6, 6] = config.lateral_sigma**2 * abs(way) + 1e-14
        joint[7, 7] = (spread_left + spread_right) / wheel_base**2 + _REST
        joint[5, 7] = joint[7, 5] = 0.5 * (spread_right - spread_left) / wheel_base
        if duration > _LONG:
            joint[6, 6] += (0.25 * way * turn + 0.1 * way) ** 2
        if rate is None or not config.use_gyro:
            self._rate, self.slipping, self._slipped = None, False, 0.0
            self._recent.clear()
            bias, moved = self.bias, np.array([way, 0.0, turn])
        else:
            bias, moved, joint = self._fuse(joint, left, right, duration, rate, rate_span)
        jacobian = np.zeros((5, 8))
        jacobian[3, 3] = jacobian[4, 4] = 1.0
        along = arc_jacobian(self.pose, *moved.tolist())
        jacobian[:3, :3], jacobian[:3, 5:] = along[:, :3], along[:, 3:]
        self.pose, self.bias = arc(self.pose, *moved.tolist()), bias
        covariance = jacobian @ joint @ jacobian.T
        self._covariance = 0.5 * (covariance + covariance.T)
        self._speed, self._turn_rate = float(moved[0]) / duration, float(moved[2]) / duration
        self._twist_covariance = (joint[5::2, 5::2] + self._rounding) / duration**2

    def _spread(self, left: float, right: float, duration: float) -> tuple[float, float]:
        """Variance of the wheels' ways in this step, m², from how fast they turned lately."""
        self._rolled.append((duration, left, right))
        time, left, right = (sum(column) for column in zip(*self._rolled, strict=True))
        while time - self._rolled[0][0] >= _STEADY:
            gone = self._rolled.popleft()
            time, left, right = time - gone[0], left - gone[1], right - gone[2]
        self._rests = not any(a or b for _, a, b in self._rolled)
        share = self._config.wheel_sigma**2 * duration / time
        return share * max(left, 0.0), share * max(right, 0.0)

    def _fuse(
        self, joint: Floats, left: float, right: float, duration: float, rate: float, span: float | None
    ) -> tuple[float, Floats, Floats]:
        """Correct bias, way and turn by the gyroscope; give them and their joint covariance."""
        config = self._config
        way, turn = 0.5 * (left + right), (right - left) / config.wheel_base
        before = rate if self._rate is None else self._rate
        self._rate = rate
        missing = 0.0 if span is None else max(duration - span, 0.0)
        measured = rate * (duration - missing) + 0.5 * (rate + before) * missing
        doubt = config.gyro_sigma**2 * duration
        doubt += (missing * (0.3 * abs(rate - before) + _JERK * missing)) ** 2
        if not self._rests:  # ticks are whole, so that each step is off by up to one
            joint[7, 7] += self._rounding[1, 1]
        differs = measured - turn - self.bias * duration
        self._recent.append((differs, joint[7, 7] + doubt, duration, turn))
        slipped = self._slip()
        self.slipping = slipped > 0.0
        if self.slipping:  # the wheels' word counts for little then
            joint[7, 7] += (3.0 * differs) ** 2
            # Also for how far they went; a slip goes on to the same side, so that its standard deviation adds up.
            joint[5, 5] += (self._slipped + slipped) ** 2 - self._slipped**2
        self._slipped = self._slipped + slipped if self.slipping else 0.0
        looks = np.array([0.0, 0.0, 0.0, duration, turn, 0.0, 0.0, 1.0])
        seen = joint @ looks
        total = float(looks @ seen) + doubt
        gain = seen / total
        gain[4] = 0.0  # the scale is considered, not estimated
        shared = np.outer(gain, seen)
        joint = joint - shared - shared.T + total * np.outer(gain, gain)
        correction = gain * differs
        self.pose = self.pose + correction[:3]
        return self.bias + float(correction[3]), np.array([way, 0.0, turn]) + correction[5:], joint

    def _slip(self) -> float:
        """Way that a slip makes wrong in this step, m; 0 while wheels and gyroscope agree within their noises."""
        differs, noise, duration, turn = (sum(column) for column in zip(*self._recent, strict=True))
        p = self._covariance
        doubt = noise + duration**2 * p[3, 3] + 2.0 * duration * turn * p[3, 4] + turn**2 * p[4, 4]
        if differs**2 <= _SLIP * doubt:
            return 0.0
        return 0.5 * self._config.wheel_base * float(abs(self._recent[-1][0] if self.slipping else differs))

    def interrupted(self) -> None:
        """Note that the base may have moved unseen, as while it started anew, rolling out for half a second."""
        way, turn = 0.05 + 0.5 * abs(self._speed), 0.05 + 0.5 * abs(self._turn_rate)
        self._covariance[:2, :2] += way**2 * np.eye(2)
        self._covariance[2, 2] += turn**2
        self._rate = None
        self._recent.clear()
