"""When each sample was taken, from when its bytes were read."""

import math

PERIOD = 1.0 / 5000.0
"""Time between two samples as the maker states it, s."""
_BYTE = 10.0 / 128000.0  # s on the wire: eight bits, a start and a stop bit
_LEAP = 0.05  # s; farther off than this, bytes were lost that nothing tells of
_WINDOW = 2500  # samples over which the least delay is sought
_GAIN, _MOST_OFF = 0.3, 0.02  # how fast, and how far, the period follows the lidar's own


class SampleClock:
    """Host times of samples that are taken evenly and read late by varying amounts.

    Delays (the wire, the USB bridge, a busy host) make bytes late, never early. So the time at which a packet was read
    bounds the time of its samples from above; between the bounds the lidar's own even sampling tells the time.
    """

    def __init__(self) -> None:
        self.period = PERIOD
        self.reset()

    def reset(self) -> None:
        """Forget when the last sample was, as after the port was opened anew; the lidar's period stays."""
        self._next: float | None = None
        self._windows = 0
        self._open_window()

    def _open_window(self) -> None:
        self._samples, self._least, self._fell = 0, math.inf, 0.0

    def first_sample(self, count: int, lost: int, broken: bool, read: float, behind: int) -> tuple[float, bool]:
        """Tell when the first sample of a packet was taken.

        Parameters
        ----------
        count : int
            Samples of the packet.
        lost : int
            Samples between the last packet and this one, as their angles tell.
        broken : bool
            Bytes were skipped since the last packet; else no sample can be missing, however late the packet is.
        read : float
            Time at which the packet's last byte, and what was read with it, was there, s.
        behind : int
            Bytes read with it that stand behind it.

        Returns
        -------
        time : float
            s.
        leapt : bool
            The time does not follow from that of the packet before.
        """
        latest = read - (10 + 2 * count + behind) * _BYTE - (count - 1) * self.period
        time = latest if self._next is None else self._next + lost * self.period
        late = latest - time
        leapt = broken and abs(late) > _LEAP
        if leapt:
            self.reset()
            time = latest
        elif late < 0.0:  # the clock had run ahead of what is possible
            self._fell += late
            time = latest
        self._least = min(self._least, max(late, 0.0))
        self._samples += count + lost
        if self._samples >= _WINDOW:
            time += self._least  # all of the window's packets came later than they had to
            self._follow((self._least + self._fell) / (self._samples * self.period))
            self._open_window()
        self._next = time + count * self.period
        return time, leapt

    def _follow(self, drift: float) -> None:
        """Correct the period by the share by which the clock was off; the first windows only find the delay."""
        self._windows += 1
        if self._windows > 2 and abs(drift) < _MOST_OFF:  # more is a host that was held up
            wanted = self.period * (1.0 + _GAIN * drift)
            self.period = min(max(wanted, PERIOD * (1.0 - _MOST_OFF)), PERIOD * (1.0 + _MOST_OFF))
