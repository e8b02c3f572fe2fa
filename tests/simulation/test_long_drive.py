import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest

from contourslam.errors import ConfigError
from contourslam.geometry.poses import between, compose, interpolate, transform
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.buildings import office_building
from contourslam.simulation.config import YDLIDAR_X4, LidarModel, RobotModel
from contourslam.simulation.long_drive import BUILDING_LIDAR, LongDrive, Message, WheelErrors, building_drive
from contourslam.simulation.ray_casting import outlines

EXACT = WheelErrors(0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def drive() -> LongDrive:
    return building_drive(300.0, 1)


@pytest.fixture(scope="module")
def messages(drive: LongDrive) -> list[Message]:
    return list(islice(drive.messages(), 4000))


@pytest.mark.parametrize("seed", range(3))
def test_a_drive_never_touches_anything(seed: int, clearance: Callable[..., np.ndarray]) -> None:
    drive = building_drive(200.0, seed)
    places = np.array([tick.pose[:2] for tick in drive.ticks()])[::3]
    for height in (0.05, 0.2):
        matter = outlines(drive.building.room, height)
        nearest = [clearance(part, *matter).min() for part in np.array_split(places, 10)]
        assert min(nearest) > RobotModel().body_radius + 0.03


def test_a_drive_is_as_long_as_asked_and_comes_back_to_old_places(drive: LongDrive) -> None:
    places = np.array([tick.pose[:2] for tick in drive.ticks()])
    steps = np.hypot(*np.diff(places, axis=0).T)
    assert steps.sum() == pytest.approx(300.0, abs=0.3)
    some, apart = places[::20], 60  # a second and a minute
    again = [np.hypot(*(some[: k - apart] - some[k]).T).min() < 1.0 for k in range(apart + 1, len(some))]
    assert 0.3 < np.mean(again) < 0.8


def test_buildings_grow_with_the_drive_up_to_a_limit() -> None:
    sizes = [len(building_drive(length).building.junctions) for length in (100.0, 300.0, 1000.0)]
    assert sizes == [4, 9, 25]
    assert len(building_drive(1e5, most_corridors=4).building.junctions) == 16


def test_the_same_seed_gives_the_same_messages(drive: LongDrive, messages: list[Message]) -> None:
    again = list(islice(building_drive(300.0, 1).messages(), 300))
    for ours, theirs in zip(messages, again, strict=False):
        assert type(ours) is type(theirs) and ours.stamp == theirs.stamp
        value = "ranges" if isinstance(ours, LaserScan) else "pose"
        np.testing.assert_array_equal(getattr(ours, value), getattr(theirs, value))
    other = next(m for m in replace(drive, seed=2).messages() if isinstance(m, LaserScan))
    assert (other.ranges != next(m for m in messages if isinstance(m, LaserScan)).ranges).any()


def test_stamps_ascend_and_a_scan_comes_when_it_is_complete(messages: list[Message]) -> None:
    for kind in (LaserScan, Odometry, TruePose):
        stamps = np.array([m.stamp for m in messages if isinstance(m, kind)])
        assert (np.diff(stamps) > 0).all()
    now = 0.0
    for before, message in pairwise(messages):
        if isinstance(before, Odometry):
            now = before.stamp
        if isinstance(message, LaserScan):
            assert isinstance(before, TruePose) and before.stamp == message.stamp
            assert now - 0.05 < message.stamp + message.offsets[-1] <= now


def test_odometry_without_errors_is_the_truth(drive: LongDrive) -> None:
    exact = replace(drive, length=30.0, wheels=EXACT, robot=RobotModel(ticks_per_turn=10**8))
    believed = np.array([m.pose for m in exact.messages() if isinstance(m, Odometry)])
    truth = np.array([tick.pose for tick in exact.ticks()])
    np.testing.assert_allclose(believed, between(truth[0], truth), atol=1e-4)


def test_odometry_drifts_by_a_few_per_cent() -> None:
    drifts = []
    for seed in range(3):
        drive = building_drive(50.0, seed)
        wheels = [m for m in drive.messages() if isinstance(m, Odometry)]
        truth = np.array([tick.pose for tick in drive.ticks()])
        off = compose(truth[0], np.array([w.pose for w in wheels])) - truth
        drifts.append(np.hypot(off[:, 0], off[:, 1]).max())
    assert 0.3 < np.median(drifts) < 5.0


def test_scans_without_noise_lie_on_the_walls_once_motion_is_undone(
    drive: LongDrive, clearance: Callable[..., np.ndarray]
) -> None:
    quiet = replace(drive, length=20.0, lidar=replace(BUILDING_LIDAR, sigma_range=0.0))
    ticks, matter = list(quiet.ticks()), outlines(quiet.building.room, quiet.lidar.mount_height)
    times, truth = np.array([tick.time for tick in ticks]), np.array([tick.pose for tick in ticks])
    scans = [m for m in quiet.messages() if isinstance(m, LaserScan)]
    assert len(scans) > 100
    for scan in scans[::10]:
        lidar = compose(interpolate(times, truth, scan.stamp + scan.offsets), quiet.lidar_mount)
        back = np.isfinite(scan.ranges)
        local = scan.ranges[back, None] * np.stack([np.cos(scan.angles), np.sin(scan.angles)], axis=1)[back]
        points = np.array([transform(pose, point) for pose, point in zip(lidar[back], local, strict=True)])
        assert clearance(points, *matter).max() < 1e-6


def test_true_poses_are_those_at_the_scans_stamps(drive: LongDrive, messages: list[Message]) -> None:
    ticks = list(islice(drive.ticks(), 2700))
    times, truth = np.array([tick.time for tick in ticks]), np.array([tick.pose for tick in ticks])
    known = [m for m in messages if isinstance(m, TruePose)]
    expected = interpolate(times, truth, np.array([m.stamp for m in known]))
    np.testing.assert_allclose([m.pose for m in known], expected, atol=1e-12)


def test_ranges_have_the_noise_of_the_lidar(drive: LongDrive) -> None:
    def ranges(lidar: LidarModel) -> np.ndarray:
        found = replace(drive, length=10.0, lidar=lidar).messages()
        return np.concatenate([m.ranges for m in found if isinstance(m, LaserScan)])

    noisy, ideal = ranges(BUILDING_LIDAR), ranges(replace(BUILDING_LIDAR, sigma_range=0.0))
    back = np.isfinite(noisy) & np.isfinite(ideal)
    assert np.std(noisy[back] - ideal[back]) == pytest.approx(0.01, rel=0.05)


def test_a_lidar_with_a_varying_number_of_beams_will_do(drive: LongDrive) -> None:
    scans = [m for m in replace(drive, length=5.0, lidar=YDLIDAR_X4).messages() if isinstance(m, LaserScan)]
    assert len({len(scan.ranges) for scan in scans}) > 5
    assert all(scan.angles[0] > scan.angles[-1] for scan in scans)


def test_memory_does_not_grow_with_the_way() -> None:
    endless = LongDrive(office_building(2, 0), 1e6, 0).messages()
    next(endless)
    tracemalloc.start()
    try:
        held = []
        for _ in range(3):
            for _ in islice(endless, 600):
                pass
            held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert held[2] - held[0] < 30_000


@pytest.mark.parametrize(("name", "value"), [("length", 0.0), ("length", float("nan")), ("speed", 0.0), ("speed", 2.0)])
def test_a_drive_that_cannot_be_is_refused(drive: LongDrive, name: str, value: float) -> None:
    with pytest.raises(ConfigError, match=f"LongDrive.{name}"):
        replace(drive, **{name: value})
    with pytest.raises(ConfigError, match=r"WheelErrors.slip"):
        WheelErrors(slip=-0.1)
