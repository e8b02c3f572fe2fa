import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, LandmarkConfig, LidarConfig
from contourslam.contour import Contours
from contourslam.geometry.angles import wrap
from contourslam.landmarks import Walls, extract_walls, trace
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
Scans = Callable[..., LaserScan]
Rooms = Callable[..., Floats]
SQUARE = [(-2.0, -1.5), (2.5, -1.5), (2.5, 2.0), (-2.0, 2.0)]
LINES = np.array([[-math.pi / 2, 1.5], [0.0, 2.5], [math.pi / 2, 2.0], [math.pi, 2.0]])  # normal and distance


def walls_in(scan: LaserScan, sigma: float, **landmarks: float) -> Walls:
    lidar = LidarConfig(sigma_range=max(sigma, 0.001))
    contours = trace(scan, Config(lidar=lidar))
    return extract_walls(contours, lidar.sigma_range, LandmarkConfig(**landmarks))  # type: ignore[arg-type]


def true_lines(pose: tuple[float, float, float]) -> Floats:
    """The room's walls in the lidar's frame."""
    x, y, yaw = pose
    normals = LINES[:, 0]
    return np.stack([wrap(normals - yaw), LINES[:, 1] - np.cos(normals) * x - np.sin(normals) * y], axis=1)


def errors(lines: Floats, pose: tuple[float, float, float]) -> Floats:
    """Each line less the true one that it fits best."""
    true = true_lines(pose)
    best = [true[np.argmin(np.abs(wrap(true[:, 0] - line[0])))] for line in lines]
    difference = lines - np.array(best).reshape(-1, 2)
    difference[:, 0] = wrap(difference[:, 0])
    return difference


@pytest.mark.parametrize("yaw", [0.0, 0.9, math.pi, -2.0])
def test_every_wall_of_a_room_is_found_with_a_normal_that_points_away_from_the_lidar(
    room: Rooms, scan_of: Scans, yaw: float
) -> None:
    pose = (0.4, -0.3, yaw)
    walls = walls_in(scan_of(room(SQUARE), pose), 0.0)
    assert 4 <= len(walls) <= 5  # the one across the first beam may come in two
    assert np.abs(errors(walls.lines, pose)).max() < 1e-3
    assert {int(np.argmin(np.abs(wrap(true_lines(pose)[:, 0] - line[0])))) for line in walls.lines} == {0, 1, 2, 3}
    assert (walls.lines[:, 1] > 0.0).all()
    assert (np.abs(walls.lines[:, 0]) <= math.pi).all()
    normals = np.stack([np.cos(walls.lines[:, 0]), np.sin(walls.lines[:, 0])], axis=1)
    np.testing.assert_allclose((walls.end_points * normals[:, None]).sum(-1), walls.lines[:, [1, 1]], atol=1e-9)
    first, last = np.moveaxis(walls.end_points, 1, 0)
    assert (first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0] > 0.0).all()  # counter-clockwise around the lidar


def test_end_points_lie_within_a_few_beams_of_the_walls_true_ends(room: Rooms, scan_of: Scans) -> None:
    walls = walls_in(scan_of(room(SQUARE), (0.25, 0.25, 0.2), beams=720, sigma=0.003), 0.003)
    cos, sin = math.cos(0.2), math.sin(0.2)
    world = walls.end_points @ np.array([[cos, sin], [-sin, cos]]) + [0.25, 0.25]
    distance = np.linalg.norm(world[:, :, None] - np.array(SQUARE), axis=-1).min(axis=-1)
    assert np.sum(distance < 0.15) >= 7  # eight ends; the wall across the first beam has two more
    assert len(walls) <= 5


@pytest.mark.parametrize("sigma", [0.005, 0.01, 0.03])
@pytest.mark.parametrize("beams", [360, 500])
def test_the_covariance_of_a_wall_is_that_of_its_errors(room: Rooms, scan_of: Scans, sigma: float, beams: int) -> None:
    rng = np.random.default_rng(0)
    squares, ends, cautious = [], [], []
    for _ in range(40):
        pose = (rng.uniform(-1.0, 1.0), rng.uniform(-0.8, 1.0), rng.uniform(-3.1, 3.1))
        scan = scan_of(room(SQUARE), pose, sigma=sigma, beams=beams, seed=rng)
        walls = walls_in(scan, sigma, position_floor=1e-6, angle_floor_deg=1e-6)
        error = errors(walls.lines, pose)
        squares += list(np.einsum("ki,kij,kj->k", error, np.linalg.inv(walls.covariances), error))
        floored = walls_in(scan, sigma)
        cautious += list(np.einsum("ki,kij,kj->k", error, np.linalg.inv(floored.covariances), error))
        # The end points across their wall: their distance from the true line, over its standard deviation.
        true = walls.lines - error
        normals = np.stack([np.cos(true[:, 0]), np.sin(true[:, 0])], axis=1)
        off = (walls.end_points * normals[:, None]).sum(-1) - true[:, 1:]
        variance = np.einsum("ki,keij,kj->ke", normals, walls.end_point_covariances, normals)
        ends += list((off**2 / variance).ravel())
    assert 1.3 < np.mean(squares) < 2.6  # two degrees of freedom
    assert 0.6 < np.mean(ends) < 1.5  # one
    assert np.mean(cautious) < np.mean(squares)


def test_the_floors_add_their_variances(room: Rooms, scan_of: Scans) -> None:
    scan = scan_of(room(SQUARE), sigma=0.01)
    bare = walls_in(scan, 0.01, position_floor=0.0, angle_floor_deg=0.0)
    floored = walls_in(scan, 0.01, position_floor=0.02, angle_floor_deg=1.0)
    np.testing.assert_array_equal(bare.lines, floored.lines)
    added = floored.covariances - bare.covariances
    angle = math.radians(1.0) ** 2
    np.testing.assert_allclose(added[:, 0, 0], angle)
    lever = added[:, 0, 1] / angle
    np.testing.assert_allclose(added[:, 1, 1], 0.02**2 + lever**2 * angle, atol=1e-9)
    middle = walls_middle(bare)
    np.testing.assert_allclose(lever, middle, atol=0.25)  # the foot of the normal to the centroid


def walls_middle(walls: Walls) -> Floats:
    along = np.stack([-np.sin(walls.lines[:, 0]), np.cos(walls.lines[:, 0])], axis=1)
    return np.asarray((walls.end_points.mean(axis=1) * along).sum(axis=1))


def test_covariances_are_symmetric_and_positive(room: Rooms, scan_of: Scans) -> None:
    walls = walls_in(scan_of(room(SQUARE), sigma=0.01), 0.01)
    for covariances in (walls.covariances, walls.end_point_covariances.reshape(-1, 2, 2)):
        np.testing.assert_allclose(covariances, np.swapaxes(covariances, 1, 2))
        assert (np.linalg.eigvalsh(covariances) > 0.0).all()


def test_a_wall_partly_hidden_comes_in_two_segments_on_one_line(room: Rooms, scan_of: Scans) -> None:
    pillar = [(1.0, -0.2), (1.3, -0.2), (1.3, 0.2), (1.0, 0.2)]
    scan = scan_of(np.concatenate([[[[2.0, -2.0], [2.0, 2.0]]], room(pillar)]))
    walls = walls_in(scan, 0.0)
    assert len(walls) == 2
    np.testing.assert_allclose(walls.lines, [[0.0, 2.0], [0.0, 2.0]], atol=1e-3)
    lower, upper = walls.end_points[np.argsort(walls.end_points[:, 0, 1])]
    assert -2.0 <= lower[0, 1] < lower[1, 1] <= -0.39  # the shadow of the pillar's near edge
    assert 0.39 <= upper[0, 1] < upper[1, 1] <= 2.0


@pytest.mark.parametrize(("length", "found"), [(0.4, 0), (0.7, 1)])
def test_a_wall_shorter_than_asked_is_none(scan_of: Scans, length: float, found: int) -> None:
    scan = scan_of(np.array([[[1.5, -0.5 * length], [1.5, 0.5 * length]]]), sigma=0.003)
    assert len(walls_in(scan, 0.003)) == found


def test_a_wall_of_too_few_beams_is_none(scan_of: Scans) -> None:
    scan = scan_of(np.array([[[9.0, -0.5], [9.0, 0.5]]]), sigma=0.003)  # nine beams
    assert len(walls_in(scan, 0.003, min_wall_points=5)) == 1
    assert len(walls_in(scan, 0.003, min_wall_points=8)) == 0


def test_a_round_room_has_no_walls(room: Rooms, scan_of: Scans) -> None:
    rim = np.linspace(0.0, 2.0 * math.pi, 720, endpoint=False)
    scan = scan_of(room(np.stack([np.cos(rim), np.sin(rim)], axis=1)), sigma=0.003)
    assert len(walls_in(scan, 0.003)) == 0


def test_nothing_comes_of_nothing_and_hardly_anything() -> None:
    for n in range(9):
        points = np.stack([np.full(n, 1.0), np.arange(n) * 0.05], axis=1)
        contours = Contours(points, np.array([0, n]), np.array([False]), 0.0, np.arange(n, dtype=float))
        assert len(extract_walls(contours, 0.01, LandmarkConfig())) == 0
    none = Contours(np.empty((0, 2)), np.zeros(1, np.int64), np.zeros(0, np.bool_), 0.0, np.empty(0))
    walls = extract_walls(none, 0.01, LandmarkConfig())
    assert walls.end_points.shape == (0, 2, 2)
    assert walls.end_point_covariances.shape == (0, 2, 2, 2)
