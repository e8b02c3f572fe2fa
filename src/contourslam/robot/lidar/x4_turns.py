"""Packets of a YDLidar X4 put together to scans, one for each turn of its head."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.robot.lidar.x4_clock import SampleClock
from contourslam.robot.lidar.x4_packets import PacketParser, Packets, correction_deg, distance_mm
from contourslam.robot.lidar.x4_salvage import Salvage
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]

RANGE_MIN, RANGE_MAX = 0.12, 10.0
"""Limits of the X4, m."""
MOST_BEAMS = 4000
"""A turn of more samples is none: the head turns slower than 1.25 times a second, or stands."""
_AT_INFINITY = float(np.degrees(np.arctan(-21.8 / 155.3)))  # the correction's limit
_CLEAN = 0.002  # share of failed packets below which the checksum alone is trusted
_START_SWAY = 10.0  # degrees between the angles at which two turns start


@dataclass(frozen=True, slots=True)
class _Piece:
    """One packet of a turn: degrees clockwise since the turn's start, raw distances, times in s."""

    first: float
    span: float
    raw: NDArray[np.uint16]
    time: float
    period: float
    doubtful: bool


class TurnAssembler:
    """Bytes of an X4 in, whole turns out.

    A turn ends where the lidar says that the next one starts, or, where those bytes were lost, where the angle comes
    round. The turn in which the listening begins is left out. Where packets fail, what two damaged bytes could hide
    from a checksum of 16 bits is held against its surroundings too: beams that agree with neither neighbour and
    packets whose angles do not fit the turn's speed are left out, until the line is clean again.

    Attributes
    ----------
    parser : PacketParser
        Its counters.
    turns : int
        Scans until now.
    stalled : int
        Times that the samples of a turn did not end.
    samples : int
        Samples since the last turn ended.
    """

    def __init__(self) -> None:
        self.parser = PacketParser(salvage=True)
        self._salvage = Salvage()
        self.turns = self.stalled = self.samples = 0
        self._clock = SampleClock()
        self._whole_mm = True  # as the X4 has it: until a clean line shows quarters
        self._failures = 0.0  # share of failed packets among the last, each a 200th
        self._forget()

    def _forget(self) -> None:
        self._pieces: list[_Piece] = []
        self._begun = False  # the turn's start was seen
        self._origin: float | None = None  # degrees at which a turn starts
        self._end = -1  # of the last packet, in the stream
        self._guessed = False  # no start was seen yet: the origin is where the listening began
        self._last_start: float | None = None
        self._cut_at = 0.0  # degrees at which the present turn started
        self._at = 0.0  # degrees since then of the last packet's middle
        self._last_deg: float | None = None
        self._steps: deque[float] = deque(maxlen=15)
        self.samples = 0

    def reset(self) -> None:
        """Drop what has begun, as after the port was opened anew; the counters go on."""
        self.parser.reset()
        self._salvage.reset()
        self._clock.reset()
        self._forget()

    @property
    def failing(self) -> float:
        """Share of the last 200 packets or so that failed."""
        return self._failures

    @property
    def noisy(self) -> bool:
        """Whether packets fail, so that the checksum alone is not enough."""
        return self._failures > _CLEAN

    def feed(self, data: bytes, read: float) -> list[LaserScan]:
        """Take the next bytes.

        Parameters
        ----------
        data : bytes
            As they were read.
        read : float
            Host time at which they were, s.

        Returns
        -------
        list of LaserScan
            The turns that these bytes end: angles counter-clockwise in (-pi, pi], falling, in the lidar's frame; ranges
            in m, NaN for no return.
        """
        bad, skipped = self.parser.bad, self.parser.skipped
        packets = self.parser.feed(data)
        # Bytes that belong to nothing are a packet whose header was hit, but for those before the first packet.
        failed = max(self.parser.bad - bad, int(self.parser.skipped > skipped and self._last_deg is not None))
        seen = failed + int(packets.sound.sum())
        if seen:
            weight = 0.995**seen
            self._failures = weight * self._failures + (1.0 - weight) * (failed / seen)
        return self._assemble(packets, read) if len(packets) else []

    def _assemble(self, packets: Packets, read: float) -> list[LaserScan]:
        """Hand packet by packet to its turn; the samples are decoded together when the turn ends."""
        scans: list[LaserScan] = []
        noisy = self.noisy
        if not noisy and self._whole_mm:
            sound = np.repeat(packets.sound, packets.counts)
            self._whole_mm = not (packets.raw[sound] & 3).any()
        step = float(self._steps[-1]) if self._steps else None
        for packet in self._salvage.passed(packets, step):
            first, span, raw, count = packet.first, packet.span, packet.raw, packet.raw.size
            # A damaged start mark would end the turn; a packet that starts one has a single sample.
            starts = packet.starts and (packet.sound or count == 1)
            if (noisy or not packet.sound) and not self._fits(count, first, span, starts):
                continue
            lost, broken = self._lost(first), packet.begin != self._end
            time, leapt = self._clock.first_sample(count, lost, broken, read, self.parser.received - packet.end)
            self._end, self._last_deg = packet.end, first + span
            if count > 9:
                self._steps.append(span / (count - 1))
            self._cut(starts, first, first + 0.5 * span, leapt, scans)
            # The packet's middle is what belongs to this turn; its first sample may lie a little before the start.
            base = (first - self._cut_at + 0.5 * span) % 360.0 - 0.5 * span
            doubtful = noisy or not packet.sound
            wrong = raw & 3 != 0 if doubtful and self._whole_mm else None
            if wrong is not None and not packet.sound:
                raw = np.where(wrong, 0, raw).astype(np.uint16)
            if wrong is None or not packet.sound or not wrong.any():
                self._pieces.append(_Piece(base, span, raw, time, self._clock.period, doubtful))
            self.samples += count
            if self.samples > MOST_BEAMS:
                self.stalled += 1
                self._forget()
        return scans

    def _fits(self, count: int, first: float, span: float, starts: bool) -> bool:
        """Whether a packet's angles are believable, where two damaged bytes may have passed the checksum."""
        if starts:
            known = [angle for angle in (self._origin, self._last_start) if angle is not None]
            self._last_start = first
            near = any(abs((first - angle + 180.0) % 360.0 - 180.0) < _START_SWAY for angle in known)
            return near or self._guessed or self._origin is None
        if count < 3:
            return False
        if len(self._steps) < 3:
            return 0.0 < span < 2.0 * (count - 1)
        usual = sorted(self._steps)[len(self._steps) // 2] * (count - 1)
        return abs(span - usual) < 0.1 * usual + 0.5

    def _lost(self, first: float) -> int:
        """Samples between the last packet and one that begins at `first`, up to a turn; 0 where nothing is known."""
        if self._last_deg is None or not self._steps:
            return 0
        step = float(self._steps[-1])
        gap = (first - self._last_deg + 2.0) % 360.0 - 2.0
        return max(round(gap / step) - 1, 0) if step > 0.05 and gap > 3.0 * step else 0

    def _cut(self, starts: bool, first: float, middle: float, leapt: bool, scans: list[LaserScan]) -> None:
        """End the turn where this packet belongs to the next one."""
        if starts:
            self._begun = self._begun and not self._guessed
            self._origin, self._guessed = first, False
        elif self._origin is None:
            self._origin, self._guessed = first, True
        assert self._origin is not None
        at = (middle - self._origin) % 360.0
        if starts or leapt or at < self._at - 180.0:
            scan = _scan(self._pieces, self._cut_at) if self._begun and self._pieces else None
            if scan is not None:
                scans.append(scan)
                self.turns += 1
            self._pieces, self._begun, self.samples = [], True, 0
            self._cut_at = self._origin
        self._at = 0.0 if starts else at


def _in_company(mm: Floats, places: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mark the samples in a row of three or more of one packet that goes on smoothly, none of them a spike.

    A spike stands out from the median of five; a slope, however steep, does not. No return joins nothing.
    """
    joined = np.abs(np.diff(mm)) < 30.0 + 0.02 * mm[1:]
    joined &= (mm[1:] > 0.0) & (mm[:-1] > 0.0) & (places[1:] > 0)
    row = np.cumsum(np.concatenate([[0], ~joined]))
    middle = np.median(sliding_window_view(np.pad(mm, 2, mode="edge"), 5), axis=1)
    kept = np.flatnonzero((np.bincount(row)[row] >= 3) & (np.abs(mm - middle) < 15.0 + 0.01 * mm))
    marks = np.zeros(mm.size, dtype=np.bool_)
    marks[kept[_straight(mm[kept], kept, places[kept])]] = True
    return marks


def _straight(mm: Floats, at: NDArray[np.int64], places: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mark the samples that lie on the line of the two nearest of their packet, on both sides or else on one."""
    if mm.size < 3:
        return np.zeros(mm.size, dtype=np.bool_)
    steps = np.diff(at)
    near = (steps < 4) & (np.diff(places) == steps)  # two seen in one packet, with no more than two lost between
    slopes = np.diff(mm) / steps
    inside = near[:-1] & near[1:]
    out = np.full(mm.size, np.inf)
    middle = mm[:-2] + (mm[2:] - mm[:-2]) / (at[2:] - at[:-2]) * steps[:-1]
    out[1:-1] = np.where(inside, np.abs(mm[1:-1] - middle), np.inf)
    # Where there is no neighbour on one side, the two on the other tell where it should lie.
    after, before = np.full(mm.size, np.inf), np.full(mm.size, np.inf)
    after[2:] = np.where(inside, np.abs(mm[2:] - mm[1:-1] - slopes[:-1] * steps[1:]), np.inf)
    before[:-2] = np.where(inside, np.abs(mm[:-2] - mm[1:-1] + slopes[1:] * steps[:-1]), np.inf)
    alone = ~np.isfinite(out)
    out[alone] = np.minimum(after, before)[alone]
    return np.asarray(out < 15.0 + 0.01 * mm)


def _scan(pieces: list[_Piece], start_deg: float) -> LaserScan | None:
    """Decode a turn; None where it measured nothing at all."""
    counts = np.array([piece.raw.size for piece in pieces])
    head = np.array([(p.first, p.span, p.time, p.period, p.doubtful) for p in pieces], dtype=np.float64)
    head[:, 1] /= np.maximum(counts - 1, 1)
    places = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    first, step, begun, period, doubtful = np.repeat(head, counts, axis=0).T
    mm = distance_mm(np.concatenate([piece.raw for piece in pieces]))
    if doubtful.any():
        mm = np.where((doubtful > 0.0) & ~_in_company(mm, places), 0.0, mm)
    measured = mm > 0.0
    if not measured.any():
        return None
    times = begun + period * places
    # Where nothing came back, the beam looked to infinity; so its direction lies between those of its neighbours.
    turned = first + step * places + np.where(measured, correction_deg(mm), _AT_INFINITY)
    # At the edge of something near, the correction lets beams overtake one another by some degrees.
    order = np.argsort(turned, kind="stable")
    stamp = float(times.min())
    angles = -np.radians(turned[order] + start_deg)
    ranges = np.where(measured, mm / 1000.0, math.nan)[order]
    return LaserScan(stamp, wrap(angles), ranges, times[order] - stamp, RANGE_MIN, RANGE_MAX)
