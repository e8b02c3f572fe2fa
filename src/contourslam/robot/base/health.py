"""What is wrong with the base, in words, and the figures that show how it works."""

import threading

from contourslam.robot.base.mega import MegaBase
from contourslam.robot.base.messages import IMPOSSIBLE_STEP, STALLED, WATCHDOG
from contourslam.robot.base.states import BaseState

SILENT = 0.5  # s without a word of the base that are worth one


class BaseHealth:
    """Collects what states tell between two questions; changed in place. One thread may tell, and another ask.

    Attributes
    ----------
    state : BaseState or None
        The newest.
    """

    def __init__(self) -> None:
        self.state: BaseState | None = None
        self._flags, self._slipped = 0, False
        self._lock = threading.Lock()  # held for moments; a flag between reading and clearing would be lost

    def take(self, state: BaseState) -> None:
        """Take in a state."""
        with self._lock:
            self.state = state
            self._flags, self._slipped = self._flags | state.flags, self._slipped or state.odometry.slipping

    def warnings(self, silent: float, *, driven: bool = False) -> list[str]:
        """Say what is wrong, of all that came since this was asked last.

        Parameters
        ----------
        silent : float
            Time since the newest state came, s.
        driven : bool
            Commands should come all the time, so that a watchdog that stops the base is news.
        """
        with self._lock:
            flags, slipped, state = self._flags, self._slipped, self.state
            self._flags, self._slipped = 0, False
        if state is None:
            return []
        found = {
            f"no word from the base for {silent:.1f} s; check its plug, its cable and its power": silent > SILENT,
            "the battery is low: charge it": state.battery_low,
            "the IMU does not answer, so that the wheels alone tell how it turns; check its wires": state.gyro is None,
            "an encoder steps impossibly; check its wires and their distance from the motors": flags & IMPOSSIBLE_STEP,
            "a motor does not turn, or its encoder does not count, and the base has stopped": flags & STALLED,
            "its watchdog has stopped it, for no command came for 0.3 s": driven and flags & WATCHDOG,
            "wheels and gyroscope do not agree: a wheel slips, or the gyroscope's axes are wrong in config.h": slipped,
        }
        return [trouble for trouble, is_so in found.items() if is_so]


def base_values(base: MegaBase, state: BaseState) -> dict[str, str]:
    """Give the figures, by what they are, with their units."""
    info, (bias, _) = base.info, base.gyro_bias
    return {
        "port": base.name,
        "firmware": f"{info.major}.{info.minor}.{info.patch}",
        "frames": str(base.frames),
        "lost frames": str(base.lost),
        "resets": str(base.resets),
        "opened anew": str(base.reconnections),
        "stopped by its watchdog": str(base.watchdog_stops),
        "stopped by a motor that does not turn": str(base.stalls),
        "gyroscope's bias (rad/s)": f"{bias:.5f}",
        "battery (V)": "not wired" if state.battery is None else f"{state.battery:.2f}",
    }


def motion_words(state: BaseState) -> str:
    """Say how fast the base goes and turns."""
    speed, turn_rate = (round(value, 2) + 0.0 for value in (state.odometry.speed, state.odometry.turn_rate))
    return f"{speed:.2f} m/s, {turn_rate:.2f} rad/s"
