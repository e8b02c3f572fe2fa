"""What a sighting says about its landmark, and what it leaves open."""

import math
from collections.abc import Callable

import gtsam
import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, LandmarkConfig
from contourslam.geometry.poses import between_one, compose_one
from contourslam.graph.landmark_factors import LANDMARK, measured, relations
from contourslam.graph.landmark_set import find_landmark_set
from contourslam.graph.pose_graph import PoseGraph, relation
from contourslam.graph.sightings import (
    ANGLE_FLOOR,
    DIRECTION,
    POSITION_FLOOR,
    PTT,
    PXT,
    PXX,
    SHARE,
    Sightings,
    X,
    Y,
    sight,
    to_world,
)
from contourslam.landmarks import extract_walls, refine_corners, trace
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
Row = Callable[..., Floats]
Scans = Callable[..., LaserScan]

ORIGIN = np.zeros(3)
NO_CANDIDATES = np.empty(0)


def cost(pose: Floats, information: Floats, keyframe: Floats, landmark: Floats) -> float:
    values = gtsam.Values()
    values.insert(0, gtsam.Pose2(*keyframe))
    values.insert(LANDMARK, gtsam.Pose2(*landmark))
    return float(relation(0, LANDMARK, pose, information).error(values))


@pytest.mark.parametrize("along", [-3.0, 0.0, 4.0])
@pytest.mark.parametrize("normal", [0.0, 2.5, math.pi])
def test_a_wall_may_slide_along_its_line_but_neither_leave_nor_turn(wall_row: Row, along: float, normal: float) -> None:
    keyframe = np.array([1.0, -2.0, 0.7])
    seen = wall_row(3.0, 1.0, normal)
    world = to_world(seen[None], np.zeros(1, np.int64), keyframe[None])[0]
    pose, information = measured(seen, world, world)
    there = world[[X, Y, DIRECTION]]
    assert cost(pose, information, keyframe, compose_one(there, np.array([0.0, along, 0.0]))) == pytest.approx(0.0)
    assert cost(pose, information, keyframe, compose_one(there, np.array([0.02, along, 0.0]))) == pytest.approx(0.5)
    tilt = cost(pose, information, keyframe, compose_one(there, np.array([0.0, 0.0, math.radians(1.0)])))
    assert tilt == pytest.approx(0.5)


def test_the_point_on_the_line_is_the_landmarks_own(wall_row: Row) -> None:
    keyframe = np.array([1.0, -2.0, 0.7])
    seen = wall_row(3.0, 1.0, 2.0)
    world = to_world(seen[None], np.zeros(1, np.int64), keyframe[None])[0]
    landmark = world.copy()
    landmark[X : DIRECTION + 1] = compose_one(world[X : DIRECTION + 1], np.array([0.0, 2.5, 0.0]))
    pose, _ = measured(seen, world, landmark)
    np.testing.assert_allclose(compose_one(keyframe, pose), landmark[[X, Y, DIRECTION]], atol=1e-12)


@pytest.mark.parametrize("lever", [0.0, 3.0])
def test_a_walls_information_is_that_of_its_noisy_beams(scan_of: Scans, lever: float) -> None:
    """Monte Carlo: one wall, a thousand scans; the measured poses spread as is reported, less the floors."""
    segments = np.array([[[2.0, -1.0], [2.0, 1.5]]])
    config = Config(landmarks=LandmarkConfig(position_floor=0.0, angle_floor_deg=0.0))
    anchor = np.array([2.0, 0.25 + lever, 0.0])
    landmark = np.zeros(13)
    landmark[X : DIRECTION + 1] = anchor
    errors, covariances = [], []
    chance = np.random.default_rng(1)
    for _ in range(1000):
        scan = scan_of(segments, (0.0, 0.0, 0.2), sigma=0.01, beams=360, seed=chance)
        contours = trace(scan, config)
        walls = extract_walls(contours, 0.01, config.landmarks)
        corners = refine_corners(contours, NO_CANDIDATES, 0.01, config.landmarks)
        rows = sight(corners, walls, ORIGIN)
        if len(rows) != 1:
            continue
        keyframe = np.array([[0.0, 0.0, 0.2]])
        pose, information = measured(rows[0], to_world(rows, np.zeros(1, np.int64), keyframe)[0], landmark)
        errors.append(between_one(anchor, compose_one(keyframe[0], pose))[[0, 2]])
        covariances.append(np.linalg.inv(information[np.ix_([0, 2], [0, 2])]))
    s = lever
    floor = np.array([[POSITION_FLOOR**2 + (s * ANGLE_FLOOR) ** 2, -s * ANGLE_FLOOR**2], [-s * ANGLE_FLOOR**2, 0.0]])
    floor[1, 1] = ANGLE_FLOOR**2
    claimed = np.mean(covariances, axis=0) / SHARE - floor
    true = np.cov(np.array(errors).T)
    assert len(errors) > 900
    np.testing.assert_allclose(true[0, 0], claimed[0, 0], rtol=0.2)
    np.testing.assert_allclose(true[1, 1], claimed[1, 1], rtol=0.2)
    if lever:
        np.testing.assert_allclose(true[0, 1], claimed[0, 1], rtol=0.2)


def test_a_walls_covariance_moves_along_its_line_as_the_line_does(wall_row: Row) -> None:
    """Monte Carlo of the lever alone, with a correlation between offset and direction."""
    seen = wall_row(3.0, 1.0, 0.5)
    seen[PXX], seen[PXT], seen[PTT] = 4e-4, -1.5e-4, 1e-4
    chance = np.random.default_rng(0)
    landmark = seen.copy()
    landmark[X : DIRECTION + 1] = compose_one(seen[X : DIRECTION + 1], np.array([0.0, 2.0, 0.0]))
    _, information = measured(seen, seen, landmark)
    noise = chance.multivariate_normal(np.zeros(2), [[seen[PXX], seen[PXT]], [seen[PXT], seen[PTT]]], 4000)
    errors = []
    for offset, turn in noise:
        noisy = seen.copy()
        noisy[X : DIRECTION + 1] = compose_one(seen[X : DIRECTION + 1], np.array([offset, 0.0, turn]))
        pose, _ = measured(noisy, noisy, landmark)
        errors.append(between_one(landmark[X : DIRECTION + 1], pose)[[0, 2]])
    claimed = np.linalg.inv(information[np.ix_([0, 2], [0, 2])])
    np.testing.assert_allclose(np.cov(np.array(errors).T), claimed, rtol=0.1, atol=2e-6)


def test_a_corner_seen_from_many_keyframes_converges(corner_row: Row) -> None:
    chance = np.random.default_rng(3)
    true = np.array([2.0, 1.0, 0.4])
    poses = np.column_stack([chance.uniform(-2, 2, (60, 2)), chance.uniform(-3, 3, 60)])
    sightings, graph = Sightings(), PoseGraph()
    for key, pose in enumerate(poses):
        graph.add(key, pose)
        graph.fix(key, pose, np.full(3, 1e-4))
        at = between_one(pose, true) + chance.normal(0.0, [0.02, 0.02, 0.03])
        sightings.append(key, corner_row(*at)[None])
    found = find_landmark_set(sightings, poses)
    assert len(found) == 1
    assert found.observed[0] == 60
    factors, values = relations(found, sightings, poses)
    for key, pose in enumerate(poses):
        values.insert(key, gtsam.Pose2(*pose))
    factors.push_back(graph.factors)
    solved = gtsam.LevenbergMarquardtOptimizer(factors, values).optimize().atPose2(LANDMARK)
    for x, y, direction in ((solved.x(), solved.y(), solved.theta()), found.table[0, [X, Y, DIRECTION]]):
        assert math.hypot(x - true[0], y - true[1]) < 4.0 * 0.02 / math.sqrt(60)
        assert abs(direction - true[2]) < 4.0 * 0.03 / math.sqrt(60)
    assert found.table[0, PXX] == pytest.approx(0.02**2 / 60, rel=0.5)


def test_online_factors_reach_the_solver_but_not_the_refinement(corner_row: Row) -> None:
    graph = PoseGraph()
    graph.add(0, ORIGIN)
    graph.fix(0, ORIGIN, np.full(3, 1e-4))
    kept = graph.factors.size()
    graph.add(LANDMARK, np.array([0.5, 0.0, 0.0]))
    pose, information = measured(corner_row(1.0, 2.0, 0.3), corner_row(1.0, 2.0, 0.3), corner_row(1.0, 2.0, 0.3))
    graph.sight(0, LANDMARK, pose, information)
    graph.update(2)
    np.testing.assert_allclose(graph.pose(LANDMARK), [1.0, 2.0, 0.3], atol=1e-6)
    assert graph.factors.size() == kept
    assert graph.estimate(1).size() == 1
