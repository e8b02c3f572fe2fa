"""What the base is told: the wanted twist again and again while it is wanted, and STOP until it was heard."""

import threading
import time

from contourslam.robot.base import limits
from contourslam.robot.base.link import MegaLink
from contourslam.robot.base.messages import Ack, Stop
from contourslam.robot.config import BaseConfig

FRESH = 0.35
"""s for which a wanted twist holds; a caller that has died stops the robot."""
_PERIOD = 0.02  # s between two commands; the base's watchdog has 0.3 s, so that most may be damaged
_AGAIN = 0.05  # s until a STOP that was not answered is told again


class Commander:
    """Sends commands; safe to use from several threads.

    Parameters
    ----------
    link : MegaLink
    config : BaseConfig
    """

    def __init__(self, link: MegaLink, config: BaseConfig) -> None:
        self._link, self._config = link, config
        self._lock = threading.Lock()
        self._wanted: limits.Twist = (0.0, 0.0)
        self._until: float | None = None  # time at which the wanted twist is over; None where none is
        self._now: limits.Twist = (0.0, 0.0)
        self._sent = 0.0
        self._stops: set[int] = set()  # sequences of STOPs none of which is answered

    @property
    def unheard(self) -> bool:
        """Whether a STOP waits for its answer."""
        return bool(self._stops)

    def drive(self, v: float, omega: float) -> None:
        """Want a twist for the next :data:`FRESH` seconds.

        Raises
        ------
        ConfigError
            If a value is not finite.
        """
        wanted = limits.limited(limits.check(v, omega), self._config)
        with self._lock:
            self._wanted, self._until = wanted, time.monotonic() + FRESH
            self._stops.clear()

    def stop(self) -> None:
        """Send STOP at once; :meth:`go_on` sends it again until it was heard.

        Raises
        ------
        DeviceUnpluggedError
            If the port has gone.
        """
        with self._lock:
            self._stop(time.monotonic())

    def halted(self) -> None:
        """Note that the base stands, for its board or its port began anew: the next twist is reached from rest."""
        self._now = 0.0, 0.0

    def heard(self, ack: Ack) -> None:
        """Take in an answer."""
        with self._lock:
            if ack.of in self._stops:
                self._stops.clear()

    def go_on(self, now: float) -> None:
        """Send what is due.

        Parameters
        ----------
        now : float
            Time of the monotonic clock, s.

        Raises
        ------
        DeviceUnpluggedError
            If the port has gone.
        """
        with self._lock:
            if self._until is not None and now < self._until:
                if now - self._sent >= _PERIOD:
                    self._now = limits.towards(
                        self._now, self._wanted, min(now - self._sent, 2.5 * _PERIOD), self._config
                    )
                    self._sent = now
                    self._link.send(limits.wheel_command(self._now, self._config))
            elif self._until is not None or (self._stops and now - self._sent >= _AGAIN):
                self._stop(now)

    def _stop(self, now: float) -> None:
        self._until, self._now, self._sent = None, (0.0, 0.0), now
        self._stops.add(self._link.send(Stop()))
