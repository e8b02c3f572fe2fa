"""Share of one core that the YDLidar X4's stream takes, from bytes to scans; target 2 % at 5,000 samples a second."""

import time
from collections.abc import Callable

import numpy as np

from contourslam.robot.lidar.even_beams import even_beams
from contourslam.robot.lidar.x4_packets import encode_packet
from contourslam.robot.lidar.x4_turns import TurnAssembler
from table import Table, publish

RATE, TURNS, SAMPLES = 7.0, 350, 5000.0
BATCH = 0.015  # s of bytes that the driver reads at once


def stream() -> list[tuple[float, bytes]]:
    """What is read every 15 ms, from a head that turns 7 times a second."""
    number = round(SAMPLES / RATE)
    raw, mm = 351.2 + 360.0 / number * np.arange(number), 2000.0 + 1500.0 * np.sin(np.arange(number) / 50.0)
    reads: dict[int, bytes] = {}
    for turn in range(TURNS):
        for begin in (0, *range(1, number, 40)):
            end = min(begin + (40 if begin else 1), number)
            packet = encode_packet(raw[begin], raw[end - 1], mm[begin:end], start=begin == 0)
            batch = int((turn * number + end) / SAMPLES / BATCH)
            reads[batch] = reads.get(batch, b"") + packet
    return [(BATCH * (batch + 1), data) for batch, data in reads.items()]


def damaged(reads: list[tuple[float, bytes]], share: float) -> list[tuple[float, bytes]]:
    """The same with a share of the bytes replaced."""
    rng = np.random.default_rng(1)
    out = []
    for read, data in reads:
        values = np.frombuffer(data, np.uint8).copy()
        hit = rng.random(values.size) < share
        values[hit] = rng.integers(0, 256, int(hit.sum()))
        out.append((read, values.tobytes()))
    return out


def row(name: str, reads: list[tuple[float, bytes]], after: Callable[..., object] | None = None) -> list[object]:
    """CPU time of the stream over its own length; the best of three."""
    best, scans = np.inf, 0
    for _ in range(3):
        assembler, begun = TurnAssembler(), time.process_time()
        for read, data in reads:
            for scan in assembler.feed(data, read):
                if after is not None:
                    after(scan)
        best, scans = min(best, time.process_time() - begun), assembler.turns
    seconds = reads[-1][0]
    return [name, scans, f"{100.0 * best / seconds:.2f} %", f"{seconds / best:,.0f}"]


def main() -> None:
    reads = stream()
    rows = [
        row("clean", reads),
        row("clean, and put on even beams for a recording", reads, even_beams),
        row("1 % of the bytes damaged", damaged(reads, 0.01)),
        row("20 % of the bytes damaged", damaged(reads, 0.2)),
    ]
    publish(Table("lidar", ["stream", "scans", "of one core", "times real time"], rows))


if __name__ == "__main__":
    main()
