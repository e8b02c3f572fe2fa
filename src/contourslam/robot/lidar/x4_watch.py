"""What goes wrong with a scan that was begun, told from the bytes that come, or do not."""

import time
from typing import TYPE_CHECKING

from contourslam.robot.device_errors import DeviceNoisyError, LidarStalledError

if TYPE_CHECKING:
    from contourslam.robot.lidar.ydlidar_x4 import YdlidarX4

MOST_TRIES = 3  # a lidar that lost its power needs a second or two until it hears


class Watch:
    """Looks after a scan since it was begun: silence, nonsense, damage, a head that does not turn.

    Parameters
    ----------
    lidar : YdlidarX4
        Its errors are raised here, and what it has to be told again is noted with it.
    """

    def __init__(self, lidar: "YdlidarX4") -> None:
        self._lidar, self._parser = lidar, lidar.turns.parser
        self._begun = self._heard = self._sensible = self._turned = time.monotonic()
        self._good, self._turns, self._received = self._counters()
        self._ever = False

    def _counters(self) -> tuple[int, int, int]:
        return self._parser.good, self._lidar.turns.turns, self._parser.received

    def saw(self, count: int) -> None:
        """Note that so many bytes came."""
        if count:
            self._heard = time.monotonic()

    def patient(self) -> bool:
        """Whether silence is still to be borne; notes a restart where it is not."""
        now = time.monotonic()
        # After the first command a motor may need time; a stream that breaks off has no such excuse.
        if now - self._heard < (0.5 if self._ever else 1.0) * self._lidar.timeout:
            return True
        if self._lidar.unheard >= MOST_TRIES:
            raise self._lidar.no_answer(0)
        self._lidar.told_again()
        return False

    def judge(self) -> None:
        """Raise what is wrong."""
        now = time.monotonic()
        good, turns, received = self._counters()
        lidar = self._lidar
        if good > self._good:
            self._good, self._sensible, self._ever = good, now, True
            lidar.unheard = 0
        elif now - self._sensible > (5.0 if self._ever else 1.0) * lidar.timeout and received > self._received:
            if not self._parser.good:
                raise lidar.no_answer(received - self._received)
            raise self._noisy(now - self._sensible)
        if turns > self._turns:
            self._turns, self._turned = turns, now
        elif lidar.turns.noisy and now - self._turned > 10.0 * lidar.timeout:
            raise self._noisy(now - self._turned)
        elif not lidar.turns.noisy and now - self._turned > 3.0 * lidar.timeout:
            raise LidarStalledError(
                f"{lidar.name}: samples come but no turn ends: the motor stands or is too slow; see that nothing holds "
                "the head, and that the supply gives 5 V and 1 A"
            )

    def _noisy(self, seconds: float) -> DeviceNoisyError:
        return DeviceNoisyError(
            f"{self._lidar.name}: no turn was measured for {seconds:.1f} s, for {self._lidar.turns.failing:.0%} of the "
            "last packets fail their checksum; check the cable and its distance from the motors"
        )
