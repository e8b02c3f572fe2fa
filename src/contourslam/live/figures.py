"""Rates, latencies and consistency over the last seconds, as the diagnostics tell them."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from contourslam.slam.result import ScanUpdate

MOST = 4000  # messages remembered, however fast they come


class Rate:
    """How often messages come; changed in place.

    Attributes
    ----------
    number : int
        How many have come.
    last : float
        When the last came, on the caller's clock, s; minus infinity before the first.
    """

    def __init__(self, remember: float) -> None:
        self._remember = remember
        self._times: deque[tuple[float, float]] = deque(maxlen=MOST)
        self.number, self.last = 0, -math.inf

    def count(self, stamp: float, now: float) -> None:
        """Count one that came now."""
        self.number += 1
        self.last = now
        self._times.append((now, stamp))

    def by_arrival(self, now: float) -> float:
        """Give how many came a second, by the caller's clock; 0 where fewer than two did."""
        return self._per_second(0, now)

    def by_stamps(self, now: float) -> float:
        """Give how many came a second by their own stamps; 0 where fewer than two did, or the stamps do not ascend."""
        return self._per_second(1, now)

    def _per_second(self, column: int, now: float) -> float:
        while self._times and self._times[0][0] < now - self._remember:
            self._times.popleft()
        if len(self._times) < 2:
            return 0.0
        span = self._times[-1][column] - self._times[0][column]
        return (len(self._times) - 1) / span if span > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Summary:
    """Scans mapped in the last seconds, in a few numbers; NaN where there is nothing to tell.

    Attributes
    ----------
    scans : int
    latency_median, latency_99 : float
        From a scan's coming to its pose: half of them, and 99 of 100, took no longer, s.
    quality : float
        Mean quality of the matching, 0 to 1.
    nis : float
        Normalised innovation squared over its degrees of freedom, 1 in the mean for a consistent map.
    nis_dof : int
        Degrees of freedom in it.
    """

    scans: int
    latency_median: float
    latency_99: float
    quality: float
    nis: float
    nis_dof: int


class MappedScans:
    """What the scans mapped in the last seconds were like; changed in place."""

    def __init__(self, remember: float) -> None:
        self._remember = remember
        self._rows: deque[tuple[float, float, ScanUpdate]] = deque(maxlen=MOST)

    def add(self, update: ScanUpdate, latency: float, now: float) -> None:
        """Count a scan that has been mapped."""
        self._rows.append((now, latency, update))

    def summary(self, now: float) -> Summary:
        """Sum up."""
        while self._rows and self._rows[0][0] < now - self._remember:
            self._rows.popleft()
        latencies = np.array([latency for _, latency, _ in self._rows])
        quality = [update.quality for _, _, update in self._rows if update.quality is not None]
        dof = sum(update.nis_dof for _, _, update in self._rows)
        nis = sum(update.nis for _, _, update in self._rows)
        median, most = np.percentile(latencies, [50.0, 99.0]).tolist() if len(latencies) else (math.nan, math.nan)
        mean = float(np.mean(quality)) if quality else math.nan
        return Summary(len(latencies), median, most, mean, nis / dof if dof else math.nan, dof)
