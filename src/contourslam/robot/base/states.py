"""The base's STATEs in SI units and in the host's time, over wraps, lost frames and resets of the board."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.recordings.base_readings import InertialReading, WheelReading
from contourslam.robot.base import messages
from contourslam.robot.base.messages import State
from contourslam.robot.base.odometry import BaseOdometry, Odometer
from contourslam.robot.config import BaseConfig
from contourslam.robot.device_clock import DeviceClock

_BYTE = 10.0 / 115200.0  # s on the wire: eight bits, a start and a stop bit
_GYRO, _ACCEL, _COMPASS = 1.0 / 4096.0, 1e-3, 1e-7  # rad/s, m/s², T
_WRAP = 2**32
_MOST = 1.5 * messages.MOST_TICKS  # ticks/s; faster than any wheel turns
_PERIOD = 0.02  # s between two STATEs, over which gyroscope and accelerometer are averaged


@dataclass(frozen=True, slots=True)
class BaseState:
    """What the base said at one time.

    Attributes
    ----------
    stamp : float
        Host time at which the ticks were read, s.
    ticks : tuple of (int, int)
        Left and right encoder since the driver began; they go on over resets of the board.
    wheel_angles, wheel_speeds : tuple of (float, float)
        Left and right, ahead is positive: rad since the driver began, rad/s.
    gyro, acceleration : tuple of (float, float, float), or None
        Base frame (x ahead, y left, z up), rad/s and m/s², the mean since the STATE before; None where the IMU does not
        answer. The gyroscope's bias is in them.
    compass : tuple of (float, float, float), or None
        Base frame, T; None where there is none.
    battery : float or None
        V; None where no divider is wired.
    duty : tuple of (float, float)
        Of the left and the right motor, -1 to 1.
    flags : int
        As in docs/base_protocol.md.
    odometry : BaseOdometry
        Where the base is then, by its wheels and its gyroscope.
    """

    stamp: float
    ticks: tuple[int, int]
    wheel_angles: tuple[float, float]
    wheel_speeds: tuple[float, float]
    gyro: tuple[float, float, float] | None
    acceleration: tuple[float, float, float] | None
    compass: tuple[float, float, float] | None
    battery: float | None
    duty: tuple[float, float]
    flags: int
    odometry: BaseOdometry

    @property
    def watchdog(self) -> bool:
        """No command came for 300 ms, and the base stopped its motors by itself."""
        return bool(self.flags & messages.WATCHDOG)

    @property
    def battery_low(self) -> bool:
        """The battery has to be charged."""
        return bool(self.flags & messages.BATTERY_LOW)

    @property
    def refused(self) -> bool:
        """A command came damaged since the STATE before."""
        return bool(self.flags & messages.REFUSED)

    @property
    def impossible_step(self) -> bool:
        """An encoder saw both channels change at once since the STATE before: noise, or ticks lost."""
        return bool(self.flags & messages.IMPOSSIBLE_STEP)

    @property
    def stalled(self) -> bool:
        """A motor at full power turned nothing, or its encoder is dead: both are off until a stop or zero speeds."""
        return bool(self.flags & messages.STALLED)

    def wheels(self) -> WheelReading:
        """Give the wheels as recordings keep them."""
        return WheelReading(self.stamp, self.wheel_angles, self.wheel_speeds)

    def inertial(self) -> InertialReading | None:
        """Give the inertial sensors as recordings keep them; None where the IMU does not answer."""
        if self.gyro is None or self.acceleration is None:
            return None
        return InertialReading(self.stamp, self.gyro, self.acceleration)


class StateReader:
    """Turns STATEs into :class:`BaseState`, one after the other; changed in place.

    Ticks are absolute, so that frames that are lost lose no way. A board that starts anew counts from zero again; the
    odometry then goes on from where it was, a little less sure.

    Parameters
    ----------
    config : BaseConfig

    Attributes
    ----------
    odometer : Odometer
    resets : int
        How often the board began anew.
    """

    def __init__(self, config: BaseConfig) -> None:
        self._config = config
        self.odometer = Odometer(config)
        self.resets = 0
        self._clock = DeviceClock(1e-6)
        self._last: State | None = None
        self._stamp = 0.0
        self._ticks = (0, 0)
        self._reopened = self._greeted = False

    def reopened(self) -> None:
        """Note that the port was opened anew: the board may have begun anew, or not."""
        self._reopened = True

    def greeted(self) -> None:
        """Note that the board greeted: it has begun anew, or answers late."""
        self._greeted = True

    def take(self, state: State, read: float, behind: int) -> BaseState | None:
        """Take the next STATE.

        Parameters
        ----------
        state : State
        read : float
            Host time at which its bytes were read, s.
        behind : int
            Bytes read with it that stand behind its first, its own included.

        Returns
        -------
        BaseState or None
            None where its time is that of the one before; an older one is taken for a board that began anew.
        """
        latest = read - behind * _BYTE
        last, self._last = self._last, state
        if last is None:
            self._stamp = self._clock.at(0.0, latest)[0]
            return self._told(state, (0.0, 0.0))
        counts = (state.time_us - last.time_us) % _WRAP
        if counts == 0:
            return None
        new = self._begun_anew(state, last, 1e-6 * counts, latest)
        self._reopened = self._greeted = False
        if new:
            self.resets += 1
            self.odometer.interrupted()
            self._clock.reset()
            counts = state.time_us  # since its start; before, nobody counted
            ticks = state.ticks if _possible(state.ticks, 1e-6 * counts) else (0, 0)
        else:
            ticks = _difference(state, last)
        stamp = self._clock.at(float(counts), latest)[0]
        # An event is never stamped before the one before it, even if the host's clock was set back.
        self._stamp = max(stamp, self._stamp + 1e-6) if stamp > self._stamp - 1.0 else stamp
        duration = max(1e-6 * counts, 1e-4) * self._clock.period / 1e-6
        self._ticks = self._ticks[0] + ticks[0], self._ticks[1] + ticks[1]
        ways = self._config.metres_per_tick * ticks
        rate = state.gyro[2] * _GYRO if state.flags & messages.IMU else None
        self.odometer.step(ways, duration, rate, min(_PERIOD, duration))
        turned = self._angles(ticks)
        return self._told(state, (turned[0] / duration, turned[1] / duration))

    def _begun_anew(self, state: State, last: State, elapsed: float, latest: float) -> bool:
        if elapsed > 0.5e-6 * _WRAP or not _possible(_difference(state, last), elapsed):
            return True
        host = latest - self._stamp  # told late it may be longer, so that alone it says nothing
        return (self._reopened or self._greeted) and abs(host - elapsed) > 0.5 + 0.02 * abs(host)

    def _angles(self, ticks: tuple[int, int]) -> tuple[float, float]:
        turn = 2.0 * math.pi / self._config.ticks_per_turn
        return self._config.left_sign * ticks[0] * turn, self._config.right_sign * ticks[1] * turn

    def _told(self, state: State, speeds: tuple[float, float]) -> BaseState:
        imu, compass = state.flags & messages.IMU, state.flags & messages.COMPASS
        return BaseState(
            self._stamp,
            self._ticks,
            self._angles(self._ticks),
            speeds,
            _scaled(state.gyro, _GYRO) if imu else None,
            _scaled(state.accel, _ACCEL) if imu else None,
            _scaled(state.compass, _COMPASS) if compass else None,
            1e-3 * state.battery_mv if state.battery_mv else None,
            (self._config.left_sign * 1e-3 * state.duty[0], self._config.right_sign * 1e-3 * state.duty[1]),
            state.flags,
            self.odometer.now(self._stamp),
        )


def _scaled(values: tuple[int, int, int], unit: float) -> tuple[float, float, float]:
    return values[0] * unit, values[1] * unit, values[2] * unit


def _difference(state: State, last: State) -> tuple[int, int]:
    left, right = ((a - b + 2**31) % _WRAP - 2**31 for a, b in zip(state.ticks, last.ticks, strict=True))
    return left, right


def _possible(ticks: tuple[int, int], seconds: float) -> bool:
    return bool(np.abs(ticks).max() <= _MOST * seconds + 100.0)
