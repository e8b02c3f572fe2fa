"""What the tests of the lidar share: the packets of whole turns in a square room."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from contourslam.robot.lidar.x4_packets import encode_packet
from contourslam.simulation.hardware.plugged_x4 import measured, square_room

Floats = NDArray[np.float64]


def packets(
    turns: int,
    *,
    rate: float = 7.0,
    size: int = 40,
    start_deg: float = 351.2,
    ranges: Callable[[Floats], Floats] = square_room,
) -> Iterator[tuple[float, bytes]]:
    """Packets of whole turns, each with the time of its last sample, s."""
    number = round(5000 / rate)
    step = 360.0 / number
    raw = start_deg + step * np.arange(number)
    mm = measured(raw, ranges)
    for turn in range(turns):
        at = 0
        while at < number:
            end = min(at + (size if at else 1), number)
            yield (turn * number + end - 1) / 5000, encode_packet(raw[at], raw[end - 1], mm[at:end], start=at == 0)
            at = end
