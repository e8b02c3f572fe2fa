"""All sightings of a drive become one landmark each thing, fitted to all of them, and a map."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import SlamConfig
from contourslam.geometry.poses import between_one, transform
from contourslam.graph.landmark_fit import fit
from contourslam.graph.landmark_maps import judge, records, to_maps
from contourslam.graph.landmark_set import LandmarkSet, find_landmark_set
from contourslam.graph.sightings import COLUMNS, DIRECTION, END, KIND, PTT, PXT, PXX, PYY, START, Sightings, X, Y
from contourslam.slam.landmark_filter import END_POINT_SIGMA
from contourslam.slam.measurement import CORNER, WALL

Floats = NDArray[np.float64]
Row = Callable[..., Floats]

POSES = np.array([[0.5 * k, 0.2 * k, 0.1 * k] for k in range(12)])


def drive(things: list[list[Floats]], poses: Floats = POSES) -> Sightings:
    """Sightings without noise: for each keyframe the things it saw, given in the world."""
    sightings = Sightings()
    for key, (rows, pose) in enumerate(zip(things, poses, strict=True)):
        seen = np.array(rows).reshape(-1, COLUMNS)
        for row in seen:
            row[X : DIRECTION + 1] = between_one(pose, row[X : DIRECTION + 1])
        sightings.append(key, seen)
    return sightings


def test_a_place_mapped_twice_before_a_loop_was_closed_becomes_one(corner_row: Row, wall_row: Row) -> None:
    sightings = drive([[corner_row(2.0, 3.0, 0.3), wall_row(4.0, 1.0, 0.2)]] * 12)
    sightings.ids[:12], sightings.ids[12:24] = np.tile([0, 1], 6), np.tile([2, 3], 6)
    found = find_landmark_set(sightings, POSES)
    assert sorted(found.table[:, KIND]) == [CORNER, WALL]
    assert found.observed.tolist() == [12, 12]
    ids, failed = records(found, sightings.ids[:24], [1, 0, 4, 0])
    assert sorted(ids) == [0, 1]
    assert failed[ids == 0] == 5


def test_overlapping_pieces_of_a_wall_become_one_and_doors_stay_open(wall_row: Row) -> None:
    pieces = [wall_row(4.0, y, length=2.0) for y in (0.0, 1.5, 3.0)]  # from -1 to 4
    behind_a_door = wall_row(4.0, 6.0, length=2.0)  # from 5 to 7
    other_face = wall_row(4.1, 1.0, math.pi, length=4.0)
    found = find_landmark_set(drive([[pieces[k % 3], behind_a_door, other_face] for k in range(12)]), POSES)
    assert len(found) == 3
    ends = found.table[:, [Y, Y]] + np.cos(found.table[:, [DIRECTION]]) * found.table[:, [START, END]]
    ends = np.sort(ends)
    np.testing.assert_allclose(ends[ends[:, 1].argsort()], [[-1, 3], [-1, 4], [5, 7]], atol=1e-3)


def test_the_end_of_a_wall_is_where_two_sightings_bear_it_out(wall_row: Row) -> None:
    too_long = wall_row(4.0, 2.0, length=6.0)
    found = find_landmark_set(drive([[wall_row(4.0, 0.0, length=2.0)]] * 11 + [[too_long]]), POSES)
    assert len(found) == 1
    assert found.table[0, END] - found.table[0, START] == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize(("keyframes", "expected"), [(2, 0), (3, 1)])
def test_what_fewer_than_three_keyframes_saw_is_no_landmark(corner_row: Row, keyframes: int, expected: int) -> None:
    rows = [[corner_row(2.0, 3.0)]] * keyframes + [[]] * (12 - keyframes)
    found = find_landmark_set(drive(rows), POSES)
    assert len(found) == expected
    assert (found.labels >= 0).sum() == expected * keyframes


def test_nothing_seen_is_an_empty_map() -> None:
    found = find_landmark_set(Sightings(), POSES)
    ids, failed = records(found, Sightings().ids[:0], [])
    corners, walls = to_maps(found, ids, failed, np.empty((0, 3)), np.empty((0, 3, 3)))
    assert len(corners.ids) == len(walls.ids) == 0
    assert walls.end_points.shape == (0, 2, 2)


def test_the_fit_is_weighted_least_squares_where_nothing_is_an_outlier(corner_row: Row, wall_row: Row) -> None:
    """Against a plain twin: normal equations over all sightings, with errors too small to be weighed down."""
    chance = np.random.default_rng(2)
    corners = [corner_row(*chance.normal([3.0, 4.0], 1e-4), 0.3, sigma=chance.uniform(0.01, 0.05)) for _ in range(20)]
    walls = []
    for along in chance.uniform(-4.0, 4.0, 20):
        row = wall_row(0.0, along, 0.0, length=1.0, sigma=chance.uniform(0.01, 0.05))
        row[X] = chance.normal(0.0, 1e-4)
        row[DIRECTION] = chance.normal(0.0, 1e-4)
        row[PXT] = 0.3 * math.sqrt(row[PXX] * row[PTT])
        walls.append(row)
    world = np.array(corners + walls)
    out = fit(world, np.repeat([0, 1, -1], [20, 20, 0]), np.array([corners[0], walls[0]]))
    weights = 1.0 / world[:20, PXX]
    np.testing.assert_allclose(out[0, [X, Y]], weights @ world[:20, [X, Y]] / weights.sum(), atol=1e-9)
    assert out[0, PXX] == pytest.approx(1.0 / weights.sum(), rel=1e-3)
    normal, right = np.zeros((2, 2)), np.zeros(2)
    for row in walls:
        information = np.linalg.inv([[row[PXX], row[PXT]], [row[PXT], row[PTT]]])
        jacobian = np.array([[1.0, -(row[Y] - out[1, Y])], [0.0, 1.0]])
        normal += jacobian.T @ information @ jacobian
        right += jacobian.T @ information @ row[[X, DIRECTION]]
    np.testing.assert_allclose(out[1, [X, DIRECTION]], np.linalg.solve(normal, right), atol=1e-7)
    np.testing.assert_allclose(
        [[out[1, PXX], out[1, PXT]], [out[1, PXT], out[1, PTT]]], np.linalg.inv(normal), rtol=0.05, atol=1e-8
    )


def test_an_outlier_hardly_moves_a_landmark(corner_row: Row) -> None:
    world = np.array([corner_row(0.0, 0.0)] * 9 + [corner_row(0.2, 0.0)])
    out = fit(world, np.zeros(10, np.int64), world[:1])
    assert abs(out[0, X]) < 0.003  # the mean would be 0.02


def test_what_is_mostly_missed_leaves_the_map() -> None:
    found = LandmarkSet(np.zeros((3, COLUMNS)), np.empty(0, np.int64), np.array([5, 5, 50]), np.zeros(3, np.int64))
    kept = judge(found, np.array([30, 10, 60]), SlamConfig(max_false_negative_rate=0.7, min_chances=20))
    assert kept.tolist() == [False, True, True]


def test_the_covariance_of_the_map_is_that_of_landmarks_hung_on_an_uncertain_keyframe(
    corner_row: Row, wall_row: Row
) -> None:
    """Monte Carlo: keyframes and fits drawn from their covariances; corners and ends of walls spread as claimed."""
    chance = np.random.default_rng(4)
    pose, spread = np.array([1.0, 2.0, 0.3]), np.array([[4e-4, 1e-4, 2e-5], [1e-4, 3e-4, 0.0], [2e-5, 0.0, 1e-4]])
    corner, wall = corner_row(4.0, 5.0, 0.5, sigma=0.01), wall_row(6.0, 1.0, 0.2, length=4.0, sigma=0.01)
    corner[PYY], wall[PXT] = 4e-4, 1e-4 * math.radians(1.0)
    found = LandmarkSet(np.array([corner, wall]), np.empty(0, np.int64), np.array([5, 6]), np.zeros(2, np.int64))
    numbers = np.array([7, 9])
    corners, walls = to_maps(found, numbers, np.array([1, 2]), np.tile(pose, (2, 1)), np.tile(spread, (2, 1, 1)))
    assert (corners.ids, walls.ids) == ([7], [9])
    assert (corners.observed, walls.failed) == ([5], [2])
    points, ends, lines = [], [], []
    for error in chance.multivariate_normal(np.zeros(3), spread, 4000):
        noisy = pose + error
        c = corner[X : DIRECTION + 1].copy()
        turn = np.array([[math.cos(c[2]), -math.sin(c[2])], [math.sin(c[2]), math.cos(c[2])]])
        c[:2] += turn @ chance.normal(0.0, np.sqrt(corner[[PXX, PYY]]))
        points.append(transform(noisy, transform(between_one(pose, np.zeros(3)), c[:2])))
        offset, tilt = chance.multivariate_normal(np.zeros(2), [[wall[PXX], wall[PXT]], [wall[PXT], wall[PTT]]])
        normal, there = wall[DIRECTION], wall[X : Y + 1]
        tangent = np.array([-math.sin(normal + tilt), math.cos(normal + tilt)])
        there = there + offset * np.array([math.cos(normal), math.sin(normal)])
        end = there + wall[END] * tangent + chance.normal(0.0, END_POINT_SIGMA) * tangent
        ends.append(transform(noisy, transform(between_one(pose, np.zeros(3)), end)))
        lines.append(normal + tilt + error[2])
    np.testing.assert_allclose(np.cov(np.array(points).T), corners.covariances[0], rtol=0.1, atol=3e-5)
    across = np.array([math.cos(wall[DIRECTION]), math.sin(wall[DIRECTION])])
    true, claimed = np.cov(np.array(ends).T), walls.end_point_covariances[0, 1]
    assert across @ true @ across == pytest.approx(across @ claimed @ across, rel=0.1)
    assert np.var(lines) == pytest.approx(walls.line_covariances[0, 0, 0], rel=0.1)
    np.testing.assert_allclose(np.mean(ends, axis=0), walls.end_points[0, 1], atol=0.01)
