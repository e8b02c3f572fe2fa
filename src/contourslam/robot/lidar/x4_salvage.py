"""Damaged packets of an X4 whose angles their neighbours confirm: most of their samples are sound all the same.

On a line that hits each twentieth byte, one packet in a hundred passes its checksum, but nine samples in ten are right.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.robot.lidar.x4_packets import Packets, spans_deg

_AGREE = 0.12  # degrees by which the angles on both sides of a seam may miss one step


@dataclass(frozen=True, slots=True)
class Candidate:
    """One packet: its place in the stream, angles in degrees, raw distances; damaged where it is not sound."""

    sound: bool
    starts: bool
    first: float
    span: float
    raw: NDArray[np.uint16]
    begin: int
    end: int


class Salvage:
    """Passes sound packets on, and of the damaged ones those whose angles fit both neighbours; changed in place.

    The angle at which a packet ends and that at which the next one begins are written in different bytes and lie a step
    apart. Where they do, neither was hit. A damaged packet therefore waits for the next one.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget what waits."""
        self._before: Candidate | None = None
        self._waiting: Candidate | None = None

    def passed(self, packets: Packets, step: float | None) -> Iterator[Candidate]:
        """Take the next packets and give those that can be trusted, in their order.

        Parameters
        ----------
        packets : Packets
        step : float, optional
            Degrees between two samples, as of late; None where that is not known, and no damaged packet is trusted.
        """
        at = 0
        heads = zip(
            packets.sound.tolist(), packets.starts.tolist(), packets.first_deg.tolist(), spans_deg(packets).tolist(),
            packets.counts.tolist(), packets.begins.tolist(), packets.ends.tolist(), strict=True,
        )  # fmt: skip
        for sound, starts, first, span, count, begin, end in heads:
            now = Candidate(sound, starts, first, span, packets.raw[at : at + count], begin, end)
            at += count
            waited, self._waiting = self._waiting, None
            if waited is not None and step is not None:
                if _joined(self._before, waited, step) and _joined(waited, now, step):
                    yield waited
                self._before = waited
            if now.sound:
                yield now
                self._before = now
            else:
                self._waiting = now


def _joined(a: Candidate | None, b: Candidate, step: float) -> bool:
    """Whether one packet follows the other without a byte between, and a step after it."""
    if a is None or a.end != b.begin:
        return False
    miss = b.first - (a.first + a.span + step)
    return abs((miss + 180.0) % 360.0 - 180.0) < _AGREE
