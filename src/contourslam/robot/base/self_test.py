"""A test of the wheels, lifted off the floor: each is turned by itself, and both encoders are watched."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from contourslam.robot.base.mega import MegaBase
from contourslam.robot.base.states import BaseState

SPEED = 0.1  # m/s
_REACH, _MEASURE, _REST = 0.7, 1.0, 0.5  # s to get up to speed, to be watched, to come to rest


@dataclass(frozen=True, slots=True)
class WheelSpin:
    """What one wheel did when it was told to turn ahead.

    Attributes
    ----------
    name : str
        ``"left"`` or ``"right"``.
    wanted, speed : float
        m/s, as told and as its encoder says.
    other : float
        What the other wheel's encoder says, m/s.
    duty : float
        Of its motor, -1 to 1.
    fault : str or None
        What is wrong, and what to try.
    """

    name: str
    wanted: float
    speed: float
    other: float
    duty: float
    fault: str | None


def spin(base: MegaBase, stopped: Callable[[], bool] = lambda: False) -> Iterator[WheelSpin]:
    """Turn the left wheel, then the right one, ahead, each by itself.

    Parameters
    ----------
    base : MegaBase
        Its wheels must be off the floor.
    stopped : callable
        Asked many times a second; the wheels stop when it says so.

    Raises
    ------
    DeviceError
        If the base is gone.
    """
    config = base.config
    wanted = min(SPEED, config.max_speed, config.max_wheel_speed, config.max_turn_rate * config.wheel_base)
    for side, name in enumerate(("left", "right")):
        turning = (-1.0 if name == "left" else 1.0) * wanted / config.wheel_base
        _hold(base, 0.5 * wanted, turning, _REACH, stopped)
        before = base.state
        _hold(base, 0.5 * wanted, turning, _MEASURE, stopped)
        after = base.state
        base.stop()
        if stopped() or before is None or after is None:
            return
        yield _judged(base, side, name, wanted, before, after)
        end = time.monotonic() + _REST
        while time.monotonic() < end and not stopped():
            time.sleep(0.02)


def _hold(base: MegaBase, v: float, omega: float, seconds: float, stopped: Callable[[], bool]) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end and not stopped():
        base.drive(v, omega)
        time.sleep(0.02)


def _judged(base: MegaBase, side: int, name: str, wanted: float, before: BaseState, after: BaseState) -> WheelSpin:
    ticks = np.subtract(after.ticks, before.ticks)
    speeds = base.config.metres_per_tick * ticks / max(after.stamp - before.stamp, 1e-3)
    speed, other, duty = float(speeds[side]), float(speeds[1 - side]), after.duty[side]
    fault = None
    if abs(speed) < 0.1 * wanted and abs(other) > 0.3 * wanted:
        fault = "the other wheel's encoder counts instead: swap the two encoders' plugs, or the two motors'"
    elif abs(speed) < 0.1 * wanted and abs(duty) < 0.05 and not after.stalled:
        fault = "its motor gets nothing: is the firmware's watchdog tripped, is a command refused?"
    elif abs(speed) < 0.1 * wanted:
        fault = "it does not turn, or its encoder does not count: check motor, motor driver and encoder"
    elif speed < 0.0:
        fault = "its encoder counts backwards: swap its channels A and B, or the motor's two wires"
    elif abs(speed - wanted) > 0.2 * wanted:
        fault = "it does not hold its speed: charge the battery, see that nothing rubs, tune the gains"
    return WheelSpin(name, wanted, speed, other, duty, fault)
