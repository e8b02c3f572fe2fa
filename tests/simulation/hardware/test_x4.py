from itertools import repeat

import numpy as np

from contourslam.robot.lidar.x4_packets import PacketParser, distance_mm
from contourslam.simulation.hardware.x4 import BYTE, HEALTH, INFO, SCAN, X4


def lidar() -> X4:
    return X4(lambda times, degrees: np.rint(1000.0 + degrees), lambda: repeat(714))


def test_it_answers_commands_also_in_pieces_and_among_noise() -> None:
    x4 = lidar()
    assert x4.receive(b"\x07\xa5", 0.0) == b""
    assert x4.receive(b"\x90\xa5\x91", 0.0) == INFO + HEALTH
    assert not x4.scanning and x4.due == float("inf")
    assert x4.receive(b"\xa5\x60", 1.0) == SCAN
    assert x4.receive(b"\xa5\x60", 1.1) == b""  # it scans already
    assert x4.scanning and x4.due > 1.0
    x4.receive(b"\xa5\x65", 2.0)
    assert not x4.scanning and x4.commands == [0x90, 0x91, 0x60, 0x60, 0x65]


def test_five_thousand_samples_a_second_each_sent_after_it_was_taken() -> None:
    x4, parser = lidar(), PacketParser()
    x4.receive(b"\xa5\x60", 0.0)
    assert x4.begun is not None
    samples = 0
    for millisecond in range(1, 2001):
        now = 1e-3 * millisecond
        packets = parser.feed(x4.advance(now))
        samples += int(packets.counts.sum())
        assert not samples or (samples - 1) / 5000 + x4.begun + 12 * BYTE <= now + 1e-9
        assert (packets.counts <= 40).all() and (packets.counts[packets.starts] == 1).all()
    assert parser.bad == parser.skipped == 0
    assert abs(samples - 5000 * (2.0 - x4.begun)) < 80


def test_it_measures_at_the_times_and_angles_of_its_samples() -> None:
    asked: list[tuple[float, float]] = []

    def measure(times: np.ndarray, degrees: np.ndarray) -> np.ndarray:
        asked.extend(zip(times.tolist(), degrees.tolist(), strict=True))
        return np.rint(1000.0 + degrees)

    x4 = X4(measure, lambda: repeat(500), rate=4990.0)
    x4.begin(0.0)
    packets = PacketParser().feed(x4.advance(0.3))
    times, degrees = np.array(asked).T
    assert np.allclose(np.diff(times), 1 / 4990)
    assert np.allclose(np.diff(degrees) % 360.0, 360 / 500)
    assert distance_mm(packets.raw).tolist() == np.rint(1000.0 + degrees).tolist()


def test_a_silent_one_keeps_its_time() -> None:
    x4 = lidar()
    x4.begin(0.0)
    x4.silent = True
    assert x4.advance(0.5) == b""
    x4.silent = False
    assert 900 < len(x4.advance(0.6)) < 1800  # a tenth of a second, not all that was kept back
