import math
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise

import numpy as np
import pytest
from x4_device import packets

from contourslam.geometry.angles import wrap
from contourslam.robot.lidar.even_beams import even_beams
from contourslam.robot.lidar.figures import LidarTally, polar_picture, range_noise
from contourslam.robot.lidar.x4_packets import encode_packet
from contourslam.robot.lidar.x4_turns import TurnAssembler
from contourslam.scan import LaserScan
from contourslam.simulation.hardware.plugged_x4 import square_room
from contourslam.simulation.hardware.x4 import BYTE

Damage = Callable[[bytes, np.random.Generator], bytes]


def assembled(stream: Iterable[tuple[float, bytes]], assembler: TurnAssembler | None = None) -> list[LaserScan]:
    assembler = assembler or TurnAssembler()
    return [scan for after, data in stream for scan in assembler.feed(data, 100.0 + after + len(data) * BYTE)]


def errors(scan: LaserScan, share: float = 0.0) -> np.ndarray:
    """How far each hit is off, m, less a share of its range."""
    hit = np.isfinite(scan.ranges)
    return np.asarray(np.abs(scan.ranges[hit] - square_room(scan.angles[hit])) - share * scan.ranges[hit])


@pytest.mark.parametrize(("rate", "size"), [(6.0, 40), (7.0, 40), (11.9, 40), (7.0, 13), (7.0, 80)])
def test_turns_are_whole_true_and_stamped(rate: float, size: int) -> None:
    scans = assembled(packets(6, rate=rate, size=size))
    beams = round(5000 / rate)
    assert [scan.ranges.size for scan in scans] == [beams] * 5
    for turn, scan in enumerate(scans):
        assert errors(scan).max() < 0.002
        assert scan.stamp == pytest.approx(100.0 + turn * beams / 5000, abs=1e-6)
        assert np.ptp(scan.offsets) == pytest.approx((beams - 1) / 5000, rel=1e-6)
        assert np.diff(np.unwrap(scan.angles)).max() <= 0.0
        assert np.abs(scan.angles).max() <= math.pi


def test_device_angles_run_clockwise_and_the_scan_counts_counter_clockwise() -> None:
    def ranges(bearing: np.ndarray) -> np.ndarray:  # something near on the left only
        return np.where(np.abs(wrap(bearing - math.pi / 2)) < 0.3, 1.0, 4.0)

    scan = assembled(packets(3, ranges=ranges))[0]
    near = scan.angles[scan.ranges < 2.0]
    assert near.min() == pytest.approx(math.pi / 2 - 0.3, abs=0.02)
    assert near.max() == pytest.approx(math.pi / 2 + 0.3, abs=0.02)


def test_no_return_is_nan_and_stays_between_its_neighbours() -> None:
    stream = []
    for turn in range(3):
        for k in range(18):
            mm = np.full(40, 3000)
            mm[10:14] = 0
            packet = encode_packet(20.0 * k, 20.0 * k + 19.5, mm, start=k == 0)
            stream.append(((turn * 18 + k + 1) * 0.008, packet))
    scan = assembled(stream)[0]
    assert np.isnan(scan.ranges).sum() == 18 * 4
    assert np.abs(np.diff(np.unwrap(scan.angles))).max() < math.radians(1.5)


def test_a_lost_start_does_not_join_two_turns() -> None:
    stream = [pair for pair in packets(12) if pair[1][2] == 0 or pair[0] < 0.4]
    assert {scan.ranges.size for scan in assembled(stream)[3:]} <= {712, 713, 714}
    assert len(assembled(stream)) == 11


STREAM = list(packets(100))


def substituted(share: float) -> Damage:
    def damage(data: bytes, rng: np.random.Generator) -> bytes:
        values = np.frombuffer(data, np.uint8).copy()
        hit = rng.random(values.size) < share
        values[hit] = rng.integers(0, 256, int(hit.sum()))
        return values.tobytes()

    return damage


def removed(share: float) -> Damage:
    return lambda data, rng: np.frombuffer(data, np.uint8)[rng.random(len(data)) >= share].tobytes()


def bursts(share: float) -> Damage:
    """A fifth of the packets hit, half of it cut away, half overwritten."""

    def damage(data: bytes, rng: np.random.Generator) -> bytes:
        if rng.random() >= 2.0 * share:
            return data
        begin = int(rng.integers(len(data)))
        other = rng.integers(0, 256, len(data) - begin, dtype=np.uint8).tobytes()
        return data[:begin] + (other if rng.random() < 0.5 else b"")

    return damage


@pytest.mark.parametrize(
    ("damage", "least"),
    [
        (substituted(0.2), 0),
        (removed(0.2), 0),
        (bursts(0.2), 20_000),
        (substituted(0.05), 15_000),
        (removed(0.05), 150),
        (substituted(0.01), 50_000),
    ],
)
def test_a_damaged_stream_yields_only_true_beams(damage: Damage, least: int) -> None:
    rng = np.random.default_rng(11)
    stream = [(after, damage(data, rng)) for after, data in STREAM]
    scans = assembled(stream)
    found = np.concatenate([np.empty(0), *[errors(scan, 0.01) for scan in scans]])
    assert found.size >= least
    assert found.max(initial=0.0) < 0.02  # what two hidden errors may do: the lidar's own noise
    assert all(scan.ranges.size <= 730 for scan in scans)
    assert all(a.stamp < b.stamp for a, b in pairwise(scans))


def test_late_and_gathered_bytes_move_a_stamp_by_less_than_five_milliseconds() -> None:
    """A bridge that hands on every 16 ms, a host that sleeps for up to 10 ms, and is held up for 0.3 s once."""
    rng = np.random.default_rng(5)

    def late() -> Iterator[tuple[float, bytes]]:
        held, free = b"", 0.0
        for after, data in packets(70, rate=7.0):
            held += data
            arrived = after + len(data) * BYTE
            if arrived < free:
                continue
            yield math.ceil(arrived / 0.016) * 0.016 + rng.uniform(0.0, 0.003), held
            held, free = b"", arrived + rng.uniform(0.0, 0.01) + 0.3 * (4.0 < arrived < 4.1)

    assembler = TurnAssembler()
    scans = [scan for read, data in late() for scan in assembler.feed(data, read)]
    assert {scan.ranges.size for scan in scans} == {714}
    true = np.arange(len(scans)) * 714 / 5000
    off = np.array([scan.stamp for scan in scans]) - true
    assert off[10:].max() - off[10:].min() < 0.005
    assert np.abs(off[10:]).max() < 0.012


def test_a_lidar_whose_clock_is_off_is_followed() -> None:
    scans = assembled((after * 1.008, data) for after, data in packets(130))
    steps = np.diff([scan.stamp for scan in scans])[80:]
    assert steps.mean() == pytest.approx(714 / 5000 * 1.008, rel=1e-3)


def test_a_head_that_stands_still_is_told_and_fills_no_memory() -> None:
    assembler = TurnAssembler()
    packet = encode_packet(30.0, 30.2, np.full(40, 900))
    assert assembled(((0.008 * k, packet) for k in range(300)), assembler) == []
    assert assembler.stalled == 2
    assert assembler.samples < 4000


def test_even_beams_see_the_same_room() -> None:
    scan = assembled(packets(3))[1]
    even = even_beams(scan)
    assert even.ranges.size == scan.ranges.size
    assert np.ptp(np.diff(even.angles)) < 1e-12 and np.ptp(np.diff(even.offsets)) < 1e-12
    off = np.abs(even.ranges - square_room(even.angles))
    assert np.nanmax(off) < 0.02 and np.nanmedian(off) < 0.001 and np.isfinite(even.ranges).mean() > 0.98
    assert even.stamp == pytest.approx(scan.stamp, abs=0.003)
    # A beam's time is that of the turning head.
    middle = np.argmin(np.abs(wrap(scan.angles - even.angles[350])))
    assert even.stamp + even.offsets[350] == pytest.approx(scan.stamp + scan.offsets[middle], abs=0.001)


def test_even_beams_leave_a_hole_where_beams_are_missing() -> None:
    scan = assembled(pair for k, pair in enumerate(packets(3)) if k % 19 != 6)[1]
    even = even_beams(scan)
    assert np.isnan(even.ranges).sum() >= 30
    hit = np.isfinite(even.ranges)
    assert np.abs(even.ranges[hit] - square_room(even.angles[hit])).max() < 0.03


@pytest.mark.parametrize("sigma", [0.005, 0.02])
def test_the_noise_is_estimated_to_a_fifth(sigma: float) -> None:
    rng = np.random.default_rng(2)
    angles = np.linspace(math.pi, -math.pi, 714, endpoint=False)
    tally = LidarTally()
    for k in range(10):
        ranges = square_room(angles) + sigma * rng.standard_normal(714)
        tally.add(LaserScan(0.142 * k, angles, ranges, np.zeros(714), 0.12, 10.0))
    figures = tally.figures()
    assert figures.noise == pytest.approx(sigma, rel=0.2)
    assert (figures.scans, figures.beams, figures.returns) == (10, 714, 1.0)
    assert figures.rate == pytest.approx(1 / 0.142)


def test_a_picture_has_ahead_up_and_left_left() -> None:
    scan = LaserScan(0.0, np.array([0.0, math.pi / 2]), np.array([2.0, 1.0]), np.zeros(2), 0.12, 10.0)
    lines, metres = polar_picture(scan, 41, 21)
    assert len(lines) == 21 and {len(line) for line in lines} == {41}
    assert lines[10][20] == "o"
    assert lines[round(10 - 2.0 / metres)][20] == "#"
    assert lines[10][round(20 - 2 * 1.0 / metres)] == "#"
    assert math.isnan(range_noise(scan))
    empty = LaserScan(0.0, np.empty(0), np.empty(0), np.empty(0), 0.12, 10.0)
    assert "".join(polar_picture(empty, 9, 5)[0]).strip() == "o"
