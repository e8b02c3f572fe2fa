from collections.abc import Callable

import numpy as np
import pytest

from contourslam.errors import ConfigError
from contourslam.geometry.poses import compose
from contourslam.simulation.config import LidarModel, RobotModel
from contourslam.simulation.drive import drive
from contourslam.simulation.lidar import cast_scans
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import SimulatedRun


def test_the_paper_lidar_turns_counter_clockwise_from_minus_pi(short_run: SimulatedRun) -> None:
    for index, scan in enumerate(short_run.ideal_scans):
        assert len(scan.angles) == 500
        assert scan.stamp == pytest.approx(0.1 * index)
        assert scan.angles[0] == -np.pi
        np.testing.assert_allclose(np.diff(scan.angles), 2 * np.pi / 500)
        np.testing.assert_allclose(scan.offsets, np.arange(500) * 2e-4)
    assert len(short_run.ideal_scans) == 150


def test_noise_free_scans_agree_with_the_plane_within_a_millimetre(
    short_run: SimulatedRun, cast_ray: Callable[..., np.ndarray], clearance: Callable[..., np.ndarray]
) -> None:
    segments, circles = short_run.room.segments(0.2), short_run.room.circles(0.2)
    agreeing = []
    for scan in short_run.ideal_scans[::5]:
        lidar = compose(short_run.truth(scan.stamp + scan.offsets), short_run.lidar_mount)
        angles = lidar[:, 2] + scan.angles
        hits = lidar[:, :2] + scan.ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        assert clearance(hits, segments, circles).max() < 1e-3
        # Along the beam a millimetre across it shows as more, the shallower the beam strikes.
        off = np.abs(scan.ranges - cast_ray(lidar[:, :2], angles, segments, circles)) * np.sin(scan.incidences)
        agreeing.append(off < 1e-3)
    assert np.mean(agreeing) > 0.995  # the rest pass an edge on its other side


def test_each_beam_starts_where_the_lidar_is_at_its_own_time(
    short_run: SimulatedRun, cast_ray: Callable[..., np.ndarray]
) -> None:
    turning = np.abs(
        [np.diff(np.unwrap(short_run.truth(s.stamp + s.offsets)[:, 2])).sum() for s in short_run.ideal_scans]
    )
    scan = short_run.ideal_scans[int(np.argmax(turning))]
    frozen = compose(short_run.truth(np.array([scan.stamp])), short_run.lidar_mount)
    segments, circles = short_run.room.segments(0.2), short_run.room.circles(0.2)
    as_if_still = cast_ray(np.repeat(frozen[:, :2], 500, axis=0), frozen[0, 2] + scan.angles, segments, circles)
    off = np.abs(scan.ranges - as_if_still)
    assert off[0] < 1e-3
    assert np.median(off[400:]) > 0.01


def test_the_ydlidar_turns_clockwise_with_a_varying_number_of_beams(x4_run: SimulatedRun) -> None:
    counts = np.array([len(scan.angles) for scan in x4_run.ideal_scans])
    assert counts.min() >= 420 and counts.max() <= 830
    assert counts.max() - counts.min() > 100
    assert 600 < counts.mean() < 800
    for scan, following in zip(x4_run.ideal_scans, x4_run.ideal_scans[1:], strict=False):
        np.testing.assert_allclose(np.diff(scan.angles), -2 * np.pi / len(scan.angles))
        np.testing.assert_allclose(scan.offsets, np.arange(len(scan.angles)) / 5000.0)
        assert following.stamp == pytest.approx(scan.stamp + len(scan.angles) / 5000.0)


def test_a_lidar_that_looks_over_everything_meets_nothing() -> None:
    room = ROOMS["furnished_room"]
    driven = drive(room, RobotModel(), 0, duration=0.2)
    scans = cast_scans(room, driven, LidarModel(mount_height=3.0), 0)
    assert len(scans) == 2
    assert np.isinf(scans[0].ranges).all()


def test_the_incidence_is_the_angle_to_the_surface(short_run: SimulatedRun) -> None:
    scan = short_run.ideal_scans[0]
    lidar = compose(short_run.truth(scan.stamp + scan.offsets), short_run.lidar_mount)
    angles = lidar[:, 2] + scan.angles
    hits = lidar[:, :2] + scan.ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    on_east_wall = np.abs(hits[:, 0] - 8.0) < 1e-3
    assert on_east_wall.sum() > 5
    np.testing.assert_allclose(np.sin(scan.incidences[on_east_wall]), np.cos(angles[on_east_wall]), atol=1e-5)


@pytest.mark.parametrize(
    "wrong",
    [{"turn_rate": 0.0}, {"range_min": 5.0, "range_max": 1.0}, {"sigma_range": -0.1}, {"drop_rate": float("nan")}],
)
def test_a_lidar_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="LidarModel"):
        LidarModel(**wrong)
