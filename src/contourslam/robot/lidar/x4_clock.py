"""When each sample was taken, from when its bytes were read."""

from contourslam.robot.device_clock import DeviceClock

PERIOD = 1.0 / 5000.0
"""Time between two samples as the maker states it, s."""
_BYTE = 10.0 / 128000.0  # s on the wire: eight bits, a start and a stop bit


class SampleClock:
    """Host times of the lidar's samples, which are taken evenly, from what a packet's head says."""

    def __init__(self) -> None:
        self._clock = DeviceClock(PERIOD)
        self._before = 0  # samples of the last packet

    @property
    def period(self) -> float:
        """Time between two samples as it turned out, s."""
        return self._clock.period

    def reset(self) -> None:
        """Forget when the last sample was, as after the port was opened anew; the lidar's period stays."""
        self._clock.reset()
        self._before = 0

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
        since, self._before = self._before + lost, count
        return self._clock.at(since, latest, broken)
