import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import Config, LandmarkConfig, LidarConfig
from contourslam.contour import Contours
from contourslam.detectors import DETECTORS, make_detector
from contourslam.geometry.angles import wrap, wrap_angle
from contourslam.landmarks import Corners, detect, refine_corners, trace
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
Scans = Callable[..., LaserScan]
Rooms = Callable[..., Floats]
CornerScan = Callable[..., tuple[LaserScan, Floats, float]]
SQUARE = [(-2.0, -1.5), (2.5, -1.5), (2.5, 2.0), (-2.0, 2.0)]


def config_for(sigma: float, **landmarks: float | bool) -> Config:
    return Config(
        lidar=LidarConfig(sigma_range=max(sigma, 0.001)),
        landmarks=LandmarkConfig(**landmarks),  # type: ignore[arg-type]
    )


def corners_in(scan: LaserScan, sigma: float = 0.0, detector: str = "matched_filter", **landmarks: float) -> Corners:
    return detect(scan, make_detector(detector), config_for(sigma, **landmarks)).corners


@given(
    opening_deg=st.floats(35.0, 140.0),
    aspect=st.floats(-0.4, 0.4),
    distance=st.floats(0.8, 5.0),
    convex=st.booleans(),
    yaw=st.floats(-math.pi, math.pi),
)
def test_without_noise_a_corner_is_found_where_it_is_with_its_direction_opening_and_kind(
    corner_scan: CornerScan, opening_deg: float, aspect: float, distance: float, convex: bool, yaw: float
) -> None:
    # A side seen at a shallower angle than this is not followed (the breakpoints' lambda is 10 degrees).
    assume(0.5 * opening_deg * (1.0 - abs(aspect)) > 13.0)
    scan, position, direction = corner_scan(
        opening_deg=opening_deg, aspect=aspect, distance=distance, convex=convex, yaw=yaw, beams=720
    )
    corners = corners_in(scan)
    assert len(corners) == 1
    np.testing.assert_allclose(corners.positions[0], position, atol=2e-3)
    assert abs(wrap_angle(corners.directions[0] - direction)) < 0.01
    assert corners.openings[0] == pytest.approx(math.radians(opening_deg), abs=0.01)
    assert corners.convex[0] == convex
    assert (corners.sides[0] >= 0.25).all()
    assert (corners.sides[0] <= 1.51).all()


@pytest.mark.parametrize("detector", list(DETECTORS))
@pytest.mark.parametrize("yaw", [0.0, 0.7853981, math.pi / 2, 3.0])
def test_the_corners_of_a_room_are_found_also_where_the_ring_of_beams_begins(
    room: Rooms, scan_of: Scans, detector: str, yaw: float
) -> None:
    pose = (0.25, 0.25, yaw)
    corners = corners_in(scan_of(room(SQUARE), pose, sigma=0.005), 0.005, detector)
    assert len(corners) == 4
    assert not corners.convex.any()
    np.testing.assert_allclose(corners.openings, math.pi / 2, atol=0.03)
    cos, sin = math.cos(yaw), math.sin(yaw)
    world = corners.positions @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
    for true in SQUARE:
        i = int(np.argmin(np.linalg.norm(world - true, axis=1)))
        assert math.dist(world[i], true) < 0.01
        towards_middle = math.atan2(0.25 - true[1], 0.25 - true[0])
        assert abs(wrap_angle(corners.directions[i] + yaw - towards_middle)) < 0.3


@pytest.mark.parametrize("start", [-math.pi + 0.01, -2.356, 0.0, 2.0])
def test_corners_do_not_depend_on_the_beam_the_scan_begins_with(room: Rooms, scan_of: Scans, start: float) -> None:
    scan = scan_of(room(SQUARE), sigma=0.01)
    shift = round((start + math.pi) / (2.0 * math.pi) * 500)
    order = np.roll(np.arange(500), -shift)
    rolled = replace(scan, angles=scan.angles[order], ranges=scan.ranges[order])
    first, second = corners_in(scan, 0.01), corners_in(rolled, 0.01)
    assert len(first) == len(second) == 4
    order = np.argsort(np.arctan2(*second.positions.T))
    np.testing.assert_allclose(
        second.positions[order], first.positions[np.argsort(np.arctan2(*first.positions.T))], atol=0.005
    )


def test_the_edges_of_a_box_open_away_from_the_lidar(room: Rooms, scan_of: Scans) -> None:
    box = [(1.2, -0.6), (2.0, -0.6), (2.0, 0.3), (1.2, 0.3)]
    corners = corners_in(scan_of(room(box), (0.0, 1.2, 0.0), sigma=0.005), 0.005)
    assert len(corners) == 1
    np.testing.assert_allclose(corners.positions[0], [1.2, 0.3 - 1.2], atol=0.01)
    assert corners.convex[0]
    assert abs(wrap_angle(corners.directions[0] + math.pi / 4)) < 0.05


def statistics(make: CornerScan, runs: int, **case: float) -> tuple[float, list[float], list[float], list[float]]:
    """Share of scans with the corner, squared Mahalanobis errors, refined and raw errors (m)."""
    rng = np.random.default_rng(5)
    sigma = case["sigma"]
    squares: list[float] = []
    refined: list[float] = []
    raw: list[float] = []
    for _ in range(runs):
        scan, position, _ = make(yaw=rng.uniform(-3.1, 3.1), seed=rng, **case)
        corners = corners_in(scan, sigma, position_floor=1e-6)
        for i in range(len(corners)):
            error = corners.positions[i] - position
            squares.append(float(error @ np.linalg.solve(corners.covariances[i], error)))
            refined.append(float(np.hypot(*error)))
            raw.append(math.dist(corners.vertices[i], position))
    return len(squares) / runs, squares, refined, raw


@pytest.mark.parametrize("opening_deg", [60.0, 90.0, 120.0, 140.0])
@pytest.mark.parametrize("sigma", [0.005, 0.01, 0.03])
def test_the_covariance_of_a_corner_is_that_of_its_errors(
    corner_scan: CornerScan, opening_deg: float, sigma: float
) -> None:
    squares = []
    for distance, aspect, convex in ((1.5, 0.0, False), (3.0, 0.5, False), (3.0, -0.3, True), (5.0, 0.0, False)):
        for beams in (360, 500):
            found, some, _, _ = statistics(
                corner_scan, 25, opening_deg=opening_deg, distance=distance, aspect=aspect, convex=convex,
                sigma=sigma, beams=beams,
            )  # fmt: skip
            assert found > 0.5
            squares += some
    # Two degrees of freedom; a little below two, since grazing beams are trusted less than their noise alone says.
    assert 1.0 < np.mean(squares) < 2.3
    assert np.mean(np.array(squares) < 9.21) > 0.97


def test_the_floor_adds_its_variance(corner_scan: CornerScan) -> None:
    scan, _, _ = corner_scan(opening_deg=90.0, distance=2.0, sigma=0.01)
    without, with_floor = (corners_in(scan, 0.01, position_floor=floor) for floor in (0.0, 0.02))
    np.testing.assert_allclose(with_floor.covariances, without.covariances + 0.02**2 * np.eye(2), atol=1e-12)


def test_the_covariance_follows_from_those_of_the_two_lines(corner_scan: CornerScan) -> None:
    """Moving each line by its own standard deviation, numerically, gives the same ellipse as the closed form."""
    scan, _, _ = corner_scan(opening_deg=70.0, distance=2.0, aspect=0.3, sigma=0.01)
    corners = corners_in(scan, 0.01, position_floor=0.0)
    covariance = corners.covariances[0]
    np.testing.assert_allclose(covariance, covariance.T)
    assert (np.linalg.eigvalsh(covariance) > 0.0).all()
    half, bisector = 0.5 * corners.openings[0], corners.directions[0]
    normals = np.array([[-math.sin(bisector + s * half), math.cos(bisector + s * half)] for s in (1.0, -1.0)])
    across = normals @ covariance @ normals.T  # the offsets of the two lines at the corner are independent
    assert abs(across[0, 1]) < 1e-6 * math.sqrt(across[0, 0] * across[1, 1])


def test_refinement_cuts_the_error_of_the_raw_vertex_to_less_than_two_fifths(corner_scan: CornerScan) -> None:
    _, _, refined, raw = statistics(corner_scan, 150, opening_deg=90.0, distance=3.0, aspect=0.2, sigma=0.02, beams=500)
    assert np.sqrt(np.mean(np.square(refined))) * 2.5 < np.sqrt(np.mean(np.square(raw)))
    assert np.sqrt(np.mean(np.square(refined))) < 0.012


def test_unrefined_corners_are_raw_vertices_with_a_wider_covariance(corner_scan: CornerScan) -> None:
    scan, position, _ = corner_scan(opening_deg=90.0, distance=3.0, sigma=0.01)
    fine = corners_in(scan, 0.01)
    raw = detect(scan, make_detector("matched_filter"), config_for(0.01, refined=False)).corners
    np.testing.assert_array_equal(raw.positions, raw.vertices)
    np.testing.assert_array_equal(raw.vertices, fine.vertices)
    assert math.dist(fine.positions[0], position) < math.dist(raw.positions[0], position)
    assert np.linalg.eigvalsh(raw.covariances[0])[0] > np.linalg.eigvalsh(fine.covariances[0])[1]


@pytest.mark.parametrize("radius", [0.1, 0.2, 0.3, 0.5, 0.8])
def test_a_round_column_has_hardly_ever_a_corner(room: Rooms, scan_of: Scans, radius: float) -> None:
    rng = np.random.default_rng(0)
    rim = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False)
    seen = 0
    for _ in range(60):
        distance, bearing = rng.uniform(radius + 0.5, 4.0), rng.uniform(-3.0, 3.0)
        centre = distance * np.array([math.cos(bearing), math.sin(bearing)])
        column = centre + radius * np.stack([np.cos(rim), np.sin(rim)], axis=1)
        seen += len(corners_in(scan_of(room(column), sigma=0.01, seed=rng), 0.01))
    assert seen <= 10  # of 60 scans; 53 if roundness is not looked at


@pytest.mark.parametrize("detector", list(DETECTORS))
def test_the_edge_of_a_box_in_front_of_a_wall_makes_no_corner_of_the_two(
    room: Rooms, scan_of: Scans, detector: str
) -> None:
    rng = np.random.default_rng(1)
    for _ in range(25):
        angle, x, y = rng.uniform(-math.pi, math.pi), rng.uniform(-1.2, 1.7), rng.uniform(1.0, 1.4)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        box = np.array([[-0.3, -0.2], [0.3, -0.2], [0.3, 0.2], [-0.3, 0.2]]) @ turn.T + [x, y]
        big = [(-4.0, -3.0), (5.0, -3.0), (5.0, 2.5), (-4.0, 2.5)]
        corners = corners_in(scan_of(room(big, box), (0.2, -0.8, 0.0), sigma=0.01, seed=rng), 0.01, detector)
        true = np.concatenate([big, box]) - [0.2, -0.8]
        for position, convex in zip(corners.positions, corners.convex, strict=True):
            nearest = np.linalg.norm(true - position, axis=1)
            assert nearest.min() < 0.05
            assert convex == (int(np.argmin(nearest)) >= 4)


def test_two_surfaces_apart_have_no_corner_where_their_lines_would_meet(scan_of: Scans) -> None:
    rng = np.random.default_rng(1)
    for _ in range(250):  # nearer than two or three steps of the beams nobody can tell
        gap, angle, x = rng.uniform(0.25, 0.6), math.radians(rng.uniform(15.0, 165.0)), rng.uniform(-2.0, 2.0)
        end = np.array([x, 3.0 - gap])
        panel = [end, end + np.array([math.cos(angle), -math.sin(angle)])]
        scan = scan_of(np.array([[[-4.0, 3.0], [4.0, 3.0]], panel]), sigma=0.01, seed=rng)
        assert len(corners_in(scan, 0.01)) == 0


def test_a_side_shorter_than_asked_makes_no_corner(corner_scan: CornerScan) -> None:
    for side, found in ((0.2, 0), (0.35, 1)):
        scan, _, _ = corner_scan(opening_deg=90.0, distance=1.5, side=side, sigma=0.002)
        assert len(corners_in(scan, 0.002)) == found


def test_sides_are_never_shorter_than_asked_nor_openings_out_of_their_limits(room: Rooms, scan_of: Scans) -> None:
    rng = np.random.default_rng(7)
    for _ in range(40):
        clutter = [rng.uniform(-1.5, 1.5, 2) + rng.uniform(-0.5, 0.5, (4, 2)) for _ in range(4)]
        scan = scan_of(room(SQUARE, *clutter), (0.0, 0.0, 0.0), sigma=0.01, seed=rng)
        corners = corners_in(scan, 0.01, min_side=0.3, min_opening_deg=40.0, max_opening_deg=130.0)
        assert (corners.sides >= 0.3).all()
        assert (corners.openings >= math.radians(40.0)).all()
        assert (corners.openings <= math.radians(130.0)).all()
        assert np.isfinite(corners.covariances).all()
        assert (np.linalg.eigvalsh(corners.covariances) > 0.0).all()
        assert (np.abs(corners.directions) <= math.pi).all()


@given(opening_deg=st.sampled_from([10.0, 165.0, 178.0]), convex=st.booleans())
def test_an_angle_too_sharp_or_too_flat_is_no_corner(corner_scan: CornerScan, opening_deg: float, convex: bool) -> None:
    scan, _, _ = corner_scan(opening_deg=opening_deg, distance=2.0, convex=convex)
    assert len(corners_in(scan)) == 0


def test_candidates_around_one_corner_become_one_corner(corner_scan: CornerScan) -> None:
    scan, position, _ = corner_scan(opening_deg=90.0, distance=2.0, sigma=0.005)
    config = config_for(0.005)
    contours = trace(scan, config)
    vertex = int(np.argmin(np.linalg.norm(contours.points - position, axis=1)))
    one = refine_corners(contours, np.array([vertex], dtype=float), 0.005, config.landmarks)
    many = refine_corners(contours, vertex + np.array([-3.0, -1.4, 0.0, 0.5, 2.0]), 0.005, config.landmarks)
    assert len(one) == len(many) == 1
    np.testing.assert_allclose(many.positions, one.positions, atol=0.003)


def test_no_candidates_no_corners(corner_scan: CornerScan) -> None:
    scan, _, _ = corner_scan(opening_deg=90.0, distance=2.0)
    corners = refine_corners(trace(scan, Config()), np.empty(0), 0.01, LandmarkConfig())
    assert len(corners) == 0
    assert corners.positions.shape == (0, 2)
    assert corners.covariances.shape == (0, 2, 2)


@given(st.integers(0, 10_000), st.booleans())
def test_any_candidate_on_any_contour_gives_finite_corners_or_none(seed: int, closed: bool) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 60))
    points = np.cumsum(rng.normal(0.0, 0.05, (n, 2)), axis=0)
    points = points[rng.integers(0, n, n)] if seed % 3 == 0 else points  # some points twice
    contours = Contours(points, np.array([0, n]), np.array([closed]), 0.0, np.arange(n, dtype=float))
    candidates = rng.uniform(0, n - (0 if closed else 1), 10)
    config = LandmarkConfig(min_side=0.05, min_side_points=2)
    corners = refine_corners(contours, candidates, 0.02, config)
    for values in (corners.positions, corners.covariances, corners.directions, corners.openings, corners.sides):
        assert np.isfinite(values).all()
    assert (corners.sides >= 0.05).all()


@given(st.floats(-3.1, 3.1))
def test_corners_turn_with_the_lidar_and_covariances_too(room: Rooms, scan_of: Scans, turn: float) -> None:
    scan = scan_of(room(SQUARE), (0.3, 0.1, 0.2), sigma=0.01)
    turned = replace(scan, angles=scan.angles + turn)
    first, second = corners_in(scan, 0.01), corners_in(turned, 0.01)
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    assert len(first) == len(second) == 4
    np.testing.assert_allclose(second.positions, first.positions @ rotation.T, atol=1e-6)
    np.testing.assert_allclose(second.covariances, rotation @ first.covariances @ rotation.T, atol=1e-8)
    np.testing.assert_allclose(wrap(second.directions - first.directions - turn), 0.0, atol=1e-6)
    np.testing.assert_allclose(second.openings, first.openings, atol=1e-6)
