"""When something happened on a device, in the host's time, from when its bytes were read."""

import math

_LEAP = 0.05  # s; farther off than this, bytes were lost that nothing tells of
_WINDOW = 0.5  # s over which the least delay is sought
_GAIN, _MOST_OFF = 0.3, 0.02  # how fast, and how far, the period follows the device's own


class DeviceClock:
    """Host times of what a device counts evenly (samples, or ticks of its clock), read late by varying amounts.

    Delays (the wire, the USB bridge, a busy host) make bytes late, never early. So the time at which they were read
    bounds the time of what they tell from above; between the bounds the device's own even count tells the time.

    Parameters
    ----------
    period : float
        Of one count as the device's maker states it, s.

    Attributes
    ----------
    period : float
        As it turned out, s.
    """

    def __init__(self, period: float) -> None:
        self._nominal = self.period = period
        self.reset()

    def reset(self) -> None:
        """Forget when the last event was, as after the port was opened anew; the device's period stays."""
        self._last: float | None = None
        self._windows = 0
        self._open_window()

    def _open_window(self) -> None:
        self._counts, self._least, self._fell = 0.0, math.inf, 0.0

    def at(self, counts: float, latest: float, broken: bool = False) -> tuple[float, bool]:
        """Tell when an event was.

        Parameters
        ----------
        counts : float
            The device's counts since the event before.
        latest : float
            Time at which it must have been over, s.
        broken : bool
            Counts may be missing that nothing tells of; else none can be, however late the event is told.

        Returns
        -------
        time : float
            s.
        leapt : bool
            The time does not follow from that of the event before.
        """
        time = latest if self._last is None else self._last + counts * self.period
        late = latest - time
        leapt = broken and abs(late) > _LEAP
        if leapt:
            self.reset()
            time = latest
        elif late < 0.0:  # the clock had run ahead of what is possible
            self._fell += late
            time = latest
        self._least = min(self._least, max(late, 0.0))
        self._counts += counts
        if self._counts * self._nominal >= _WINDOW:
            time += self._least  # all of the window's events came later than they had to
            self._follow((self._least + self._fell) / (self._counts * self.period))
            self._open_window()
        self._last = time
        return time, leapt

    def _follow(self, drift: float) -> None:
        """Correct the period by the share by which the clock was off; the first windows only find the delay."""
        self._windows += 1
        if self._windows > 2 and abs(drift) < _MOST_OFF:  # more is a host that was held up
            wanted = self.period * (1.0 + _GAIN * drift)
            self.period = min(max(wanted, self._nominal * (1.0 - _MOST_OFF)), self._nominal * (1.0 + _MOST_OFF))
