import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.poses import compose, inverse, transform
from contourslam.scan import LaserScan
from contourslam.scan.deskew import deskew
from contourslam.scan.validity import valid_beams

Floats = NDArray[np.float64]
WALLS = np.array([[[-3.0, 2.0], [4.0, 2.0]], [[4.0, 2.0], [4.0, -3.0]], [[4.0, -3.0], [-3.0, -3.0]]])


def path(times: Floats, v: float, omega: float) -> Floats:
    """Driving on an arc at constant speed: pose at each time; the start heads near pi, so that headings wrap."""
    start = np.array([0.3, -0.2, 3.0])
    if omega == 0.0:
        steps = np.stack([v * times, 0.0 * times, 0.0 * times], axis=-1)
    else:
        turned = omega * times
        steps = np.stack([v / omega * np.sin(turned), v / omega * (1.0 - np.cos(turned)), turned], axis=-1)
    return compose(start, steps)


def moving_scan(
    cast: Callable[..., Floats], v: float, omega: float, mount: Floats, *, beams: int = 500, hertz: float = 7.0
) -> LaserScan:
    angles = -math.pi + 2.0 * math.pi / beams * np.arange(beams)
    offsets = np.arange(beams) / (beams * hertz)
    lidar = compose(path(offsets, v, omega), mount)
    return LaserScan(5.0, angles, cast(WALLS, lidar[:, :2], lidar[:, 2] + angles), offsets, 0.05, 30.0)


def distance_to_walls(points: Floats) -> Floats:
    start, edge = WALLS[:, 0], WALLS[:, 1] - WALLS[:, 0]
    where = ((points[:, None] - start) * edge).sum(-1) / (edge**2).sum(-1)
    nearest = start + np.clip(where, 0.0, 1.0)[..., None] * edge
    return np.linalg.norm(points[:, None] - nearest, axis=-1).min(axis=1)


@pytest.mark.parametrize("omega", [1.7, -1.7, 0.4, 0.0])
@pytest.mark.parametrize("mount", [[0.0, 0.0, 0.0], [0.15, -0.05, 0.4]])
def test_walls_seen_while_driving_and_turning_come_out_within_a_millimetre(
    cast: Callable[..., Floats], omega: float, mount: list[float]
) -> None:
    scan = moving_scan(cast, 0.5, omega, np.array(mount))
    valid = valid_beams(scan, 30.0)
    times = np.arange(-0.05, 0.2, 0.02)
    points, beams = deskew(scan, valid, times, path(times, 0.5, omega), np.array(mount))
    world = transform(compose(path(np.zeros(1), 0.5, omega)[0], np.array(mount)), points)
    assert len(points) == valid.sum() > 300
    assert distance_to_walls(world).max() < 1e-3
    np.testing.assert_array_equal(beams, np.flatnonzero(valid))


def test_the_same_walls_are_bent_by_centimetres_where_the_motion_is_not_undone(cast: Callable[..., Floats]) -> None:
    scan = moving_scan(cast, 0.5, 1.7, np.zeros(3))
    points, _ = deskew(scan, valid_beams(scan, 30.0), np.empty(0), np.empty((0, 3)), np.zeros(3))
    assert distance_to_walls(transform(path(np.zeros(1), 0.5, 1.7)[0], points)).max() > 0.05


@pytest.mark.parametrize("readings", [0, 1])
def test_none_or_one_reading_leaves_the_points_where_the_lidar_saw_them(
    cast: Callable[..., Floats], readings: int
) -> None:
    scan = moving_scan(cast, 0.5, 1.7, np.zeros(3))
    valid = valid_beams(scan, 30.0)
    points, beams = deskew(scan, valid, np.zeros(readings), np.ones((readings, 3)), np.array([0.2, 0.1, 0.3]))
    ranges, angles = scan.ranges[beams], scan.angles[beams]
    np.testing.assert_allclose(points, np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1))


@pytest.mark.parametrize("times", [[-0.06, -0.03], [-0.02, 0.01], [0.16, 0.19]])
def test_beams_outside_the_readings_are_extrapolated_at_the_nearest_twist(
    cast: Callable[..., Floats], times: list[float]
) -> None:
    scan = moving_scan(cast, 0.5, 0.0, np.zeros(3))
    stamps = np.array(times)
    points, _ = deskew(scan, valid_beams(scan, 30.0), stamps, path(stamps, 0.5, 0.0), np.zeros(3))
    assert distance_to_walls(transform(path(np.zeros(1), 0.5, 0.0)[0], points)).max() < 1e-9


@pytest.mark.parametrize("twice", [0, 1, 2, 3])
def test_a_stamp_that_comes_twice_throws_no_point_away(cast: Callable[..., Floats], twice: int) -> None:
    scan = moving_scan(cast, 0.5, 0.0, np.zeros(3))
    stamps = np.array([-0.10, -0.05, 0.08, 0.2])
    poses = path(stamps, 0.5, 0.0)
    order = sorted([0, 1, 2, 3, twice])
    poses = poses[order]
    poses[twice + 1, 1] += 1e-4  # the second reading of that stamp is not quite the first one
    points, _ = deskew(scan, valid_beams(scan, 30.0), stamps[order], poses, np.zeros(3))
    assert distance_to_walls(transform(path(np.zeros(1), 0.5, 0.0)[0], points)).max() < 2e-3


def test_readings_before_the_scan_only_and_with_one_stamp_leave_the_points_near(cast: Callable[..., Floats]) -> None:
    scan = moving_scan(cast, 0.5, 0.0, np.zeros(3))
    poses = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.021, 0.0, 0.0]])
    points, _ = deskew(scan, valid_beams(scan, 30.0), np.array([-0.1, -0.05, -0.05]), poses, np.zeros(3))
    assert np.abs(points).max() < 10.0


def test_a_turn_of_more_than_half_a_circle_during_the_readings_is_followed() -> None:
    omega, beams = 4.0, 400
    offsets = np.linspace(0.0, 1.0, beams)
    wall = np.stack([np.full(beams, 2.0), np.linspace(-1.0, 1.0, beams)], axis=1)
    angles = np.arctan2(wall[:, 1], wall[:, 0]) - omega * offsets
    scan = LaserScan(0.0, angles, np.hypot(wall[:, 0], wall[:, 1]), offsets, 0.1, 10.0)
    times = np.arange(-0.2, 1.3, 0.05)
    points, _ = deskew(scan, valid_beams(scan, 30.0), times, path(times, 0.0, omega), np.zeros(3))
    np.testing.assert_allclose(points, wall, atol=1e-9)


def twin(scan: LaserScan, valid: NDArray[np.bool_], times: Floats, poses: Floats, mount: Floats) -> Floats:
    """Interpolation of x, y and the unwrapped heading with np.interp, in the lidar's frame at the scan's stamp."""
    lidar = compose(poses, mount)
    heading = np.unwrap(lidar[:, 2])
    start = np.array([*(np.interp(0.0, times, lidar[:, i]) for i in range(2)), np.interp(0.0, times, heading)])
    out = []
    for i in np.flatnonzero(valid):
        x, y = (np.interp(scan.offsets[i], times, lidar[:, k]) for k in range(2))
        bearing = scan.angles[i] + np.interp(scan.offsets[i], times, heading)
        out.append([x + scan.ranges[i] * math.cos(bearing), y + scan.ranges[i] * math.sin(bearing)])
    return transform(inverse(start), np.array(out))


@given(st.integers(0, 1000))
def test_the_kernel_agrees_with_plain_numpy_whatever_the_order_of_the_beams_in_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.sort(np.concatenate([[-0.05, 0.2], rng.uniform(-0.05, 0.2, rng.integers(0, 8))]))
    poses = np.array([1.0, -2.0, 3.1]) + np.cumsum(rng.normal(0.0, [0.02, 0.02, 0.1], (len(times), 3)), axis=0)
    poses[:, 2] = np.angle(np.exp(1j * poses[:, 2]))
    beams = 60
    ranges = np.where(rng.random(beams) < 0.2, np.nan, rng.uniform(0.5, 5.0, beams))
    scan = LaserScan(0.0, rng.uniform(-3.2, 3.2, beams), ranges, rng.uniform(0.0, 0.15, beams), 0.1, 10.0)
    valid = valid_beams(scan, 30.0)
    mount = rng.uniform(-0.3, 0.3, 3)
    points, _ = deskew(scan, valid, times, poses, mount)
    np.testing.assert_allclose(points, twin(scan, valid, times, poses, mount), atol=2e-9)


def test_an_empty_scan_has_no_points() -> None:
    scan = LaserScan(0.0, np.empty(0), np.empty(0), np.empty(0), 0.1, 10.0)
    points, beams = deskew(scan, np.zeros(0, np.bool_), np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros(3))
    assert points.shape == (0, 2)
    assert beams.shape == (0,)
