"""The graph of poses: information may lack directions, loops close, and a false tie does no harm."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.geometry.poses import between, compose

pytest.importorskip("gtsam", reason="needs the extra 'graph'")

from contourslam.graph.pose_graph import PoseGraph, joined, noise_model, poses_of, solve, spreads
from contourslam.matching.small import square_root

Floats = NDArray[np.float64]
SHARP = np.diag([1e4, 1e4, 4e4])  # 1 cm, 0.3 degrees
START = np.full(3, 1e-4)


def square(side: int = 4, step: float = 2.0) -> Floats:
    """Poses once around a square, back to the first."""
    forward, turn = np.array([step, 0.0, 0.0]), np.array([step, 0.0, math.pi / 2])
    poses = [np.zeros(3)]
    for i in range(4 * side):
        poses.append(compose(poses[-1], turn if i % side == side - 1 else forward))
    return np.array(poses)


def driven(truth: Floats, steps: Floats, information: Floats = SHARP) -> PoseGraph:
    """A graph of the steps alone, with each variable where they put it."""
    graph, pose = PoseGraph(), truth[0]
    graph.add(0, pose)
    graph.fix(0, pose, START)
    for key, step in enumerate(steps, 1):
        pose = compose(pose, step)
        graph.add(key, pose)
        graph.relate(key - 1, key, step, information)
    return graph


def off(found: Floats, truth: Floats) -> Floats:
    return np.abs(between(truth, found))


@pytest.mark.parametrize("rank", [0, 1, 2, 3])
def test_the_square_root_gives_back_an_information_that_lacks_directions(rank: int) -> None:
    rng = np.random.default_rng(rank)
    for _ in range(50):
        root = rng.normal(size=(rank, 3)) * [300.0, 300.0, 1000.0]
        information = root.T @ root
        found = square_root(information)
        np.testing.assert_array_equal(found, np.triu(found))
        np.testing.assert_allclose(found.T @ found, information, atol=1e-5 * max(np.trace(information), 1.0))
        if rank == 3:
            expected = np.linalg.cholesky(information).T
            np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())
        else:
            assert np.linalg.matrix_rank(found, tol=1e-4 * max(np.abs(found).max(), 1.0)) == rank


def test_a_corridor_leaves_its_length_free() -> None:
    """Known across and in heading only: the factor says nothing about the way along."""
    direction = 0.7
    across = np.array([-math.sin(direction), math.cos(direction), 0.0])
    information = 1e4 * np.outer(across, across) + np.diag([0.0, 0.0, 1e4])
    model = noise_model(information, None)
    along = np.array([math.cos(direction), math.sin(direction), 0.0])
    np.testing.assert_allclose(model.whiten(along), 0.0, atol=1e-6)
    assert np.linalg.norm(model.whiten(0.02 * across)) == pytest.approx(2.0, rel=1e-6)


@pytest.mark.parametrize("at_once", [False, True], ids=["isam2", "solve"])
def test_a_square_with_one_wrong_step_closes(at_once: bool) -> None:
    truth = square()
    steps, last = between(truth[:-1], truth[1:]), len(truth) - 1
    steps[9] = compose(steps[9], np.array([0.3, -0.1, math.radians(6.0)]))
    graph = PoseGraph()
    wrong = driven(truth, steps).poses(range(last + 1))
    pose = truth[0]
    graph.add(0, pose)
    graph.fix(0, pose, START)
    for key, step in enumerate(steps, 1):
        pose = compose(pose, step)
        graph.add(key, pose)
        graph.relate(key - 1, key, step, SHARP, 1.0 if key == 10 else None)
    # Three places of the start seen again at the end.
    for key in range(3):
        graph.relate(key, last, between(truth[key], truth[last]), SHARP, tie=True)
    start = graph.estimate(last + 1)
    graph.update(20)
    every = joined(graph.factors, graph.ties)
    found = poses_of(solve(every, start), last + 1) if at_once else graph.poses(range(last + 1))
    assert off(wrong, truth)[:, :2].max() > 0.5
    assert off(found, truth)[-1].max() < 0.01
    assert off(found, truth)[:, :2].max() < 0.1


@pytest.mark.parametrize("at_once", [False, True], ids=["isam2", "solve"])
def test_one_false_tie_among_true_ones_moves_nothing(at_once: bool) -> None:
    truth = np.concatenate([square(), square()[1:]])
    rng = np.random.default_rng(3)
    noise = rng.normal(size=(len(truth) - 1, 3)) * [0.01, 0.01, 0.003]
    graph = driven(truth, compose(between(truth[:-1], truth[1:]), noise))
    lap, count = len(square()) - 1, len(truth)
    for key in range(lap, count, 2):
        graph.relate(key - lap, key, between(truth[key - lap], truth[key]), SHARP, 3.0, tie=True)
    graph.update(10)
    honest = graph.poses(range(count))
    graph.relate(3, lap + 9, np.array([0.1, 0.2, 0.0]), SHARP, 3.0, tie=True)
    start = graph.estimate(count)
    graph.update(10)
    values = solve(joined(graph.factors, graph.ties), start) if at_once else None
    found = graph.poses(range(count)) if values is None else poses_of(values, count)
    assert np.linalg.norm((truth[lap + 9] - truth[3])[:2]) > 5.0
    moved = off(found, honest)
    assert moved[:, :2].max() < 0.01
    assert moved[:, 2].max() < math.radians(0.3)


def test_a_graph_asked_before_it_was_updated_knows_what_waits() -> None:
    truth = square()
    graph = driven(truth, between(truth[:-1], truth[1:]))
    np.testing.assert_allclose(off(graph.pose(5), truth[5]), 0.0, atol=1e-6)
    np.testing.assert_allclose(off(graph.poses([7, 2]), truth[[7, 2]]), 0.0, atol=1e-6)
    np.testing.assert_allclose(off(poses_of(graph.estimate(len(truth)), len(truth)), truth), 0.0, atol=1e-6)
    assert graph.poses([]).shape == (0, 3)


def test_ties_are_kept_apart_from_what_stays() -> None:
    truth = square()
    graph = driven(truth, between(truth[:-1], truth[1:]))
    before = graph.factors.size()
    graph.relate(0, 16, np.zeros(3), SHARP, 3.0, tie=True)
    assert (graph.factors.size(), graph.ties.size()) == (before, 1)


def test_marginals_are_given_in_the_axes_of_the_world() -> None:
    """A step along y whose sharp axis is across: the doubt of the end lies along y."""
    pose = np.array([0.0, 0.0, math.pi / 2])
    graph = PoseGraph()
    graph.add(0, pose)
    graph.fix(0, pose, START)
    graph.add(1, compose(pose, np.array([2.0, 0.0, 0.0])))
    graph.relate(0, 1, np.array([2.0, 0.0, 0.0]), np.diag([1 / 0.5**2, 1 / 0.01**2, 1e6]))
    spread = spreads(graph.factors, graph.estimate(2), np.array([1]))[0]
    np.testing.assert_allclose(np.sqrt(np.diag(spread)[:2]), [0.01, 0.5], rtol=0.05)
    np.testing.assert_array_equal(spread, spread.T)
    assert np.linalg.eigvalsh(spread)[0] > 0.0
