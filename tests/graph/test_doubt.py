"""The doubt between two places of a tree, against what noisy chains do when they are driven a thousand times."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.geometry.poses import between, compose

pytest.importorskip("gtsam", reason="needs the extra 'graph'")

from contourslam.graph.doubt import DoubtTree

Floats = NDArray[np.float64]

# A way with bends: poses of the places, and of the robot after the last of them.
WAY = np.array([[0, 0, 0], [6, 0, 0.3], [11, 3, 1.2], [12, 9, 2.0], [8, 13, 3.0], [2, 14, -2.8]], dtype=float)
COVARIANCE = np.diag([0.04**2, 0.03**2, math.radians(0.5) ** 2])
SURE = np.diag([1e-3**2, 1e-3**2, 1e-4**2])
# The first place has a doubt of its own, which lies at the start: a turn there moves what is far from it.
X, Y = WAY[4, :2]
TURN = COVARIANCE[2, 2]
COVARIANCE_AT_START = COVARIANCE + TURN * np.array([[Y * Y, -X * Y, -Y], [-X * Y, X * X, X], [-Y, X, 0.0]])


def tree_of(parents: list[int], poses: Floats, covariances: list[Floats]) -> DoubtTree:
    tree = DoubtTree()
    for parent, pose, covariance in zip(parents, poses, covariances, strict=True):
        tree.add(parent, pose, covariance)
    return tree


def chain(covariance: Floats = COVARIANCE) -> DoubtTree:
    n = len(WAY)
    return tree_of([0, *range(n - 1)], WAY, [covariance] * n)


def driven(way: Floats, runs: int, seed: int) -> Iterator[Floats]:
    """Poses of each place of a way, driven with the noise of COVARIANCE in the world's axes, shape (runs, 3)."""
    rng = np.random.default_rng(seed)
    pose = np.tile(way[0], (runs, 1))
    yield pose
    for a, b in pairwise(way):
        noise = rng.multivariate_normal(np.zeros(3), COVARIANCE, runs)
        pose = compose(pose, between(a, b))
        # The noise of a step is in the axes of the world as they would be without the noise before it.
        turn = pose[:, 2] - b[2]
        pose = pose + np.column_stack(
            [
                np.cos(turn) * noise[:, 0] - np.sin(turn) * noise[:, 1],
                np.sin(turn) * noise[:, 0] + np.cos(turn) * noise[:, 1],
                noise[:, 2],
            ]
        )
        yield pose


@pytest.mark.parametrize("seen_from", [0, 1, 3])
def test_the_doubt_along_a_chain_is_the_spread_of_many_drives(seen_from: int) -> None:
    end = len(WAY) - 1
    doubt = chain().between(end, np.array([seen_from]), WAY[end])[0]
    *_, last = driven(WAY[seen_from:], 20_000, seed=1)
    spread = np.cov((last - WAY[end]).T)
    scale = np.sqrt(np.outer(np.diag(spread), np.diag(spread)))
    np.testing.assert_allclose(doubt / scale, spread / scale, atol=0.05)
    np.testing.assert_allclose(np.diag(doubt), np.diag(spread), rtol=0.05)


def test_a_branch_counts_only_from_the_common_ancestor() -> None:
    parents, poses = [0, 0, 1, 2, 2], WAY[:5]
    wild = np.diag([3.0, 2.0, 0.5])
    calm = tree_of(parents, poses, [COVARIANCE] * 5)
    unsure = tree_of(parents, poses, [COVARIANCE, wild, wild, COVARIANCE, COVARIANCE])
    own, others = poses[4], np.array([3])
    np.testing.assert_allclose(unsure.between(4, others, own), calm.between(4, others, own), atol=1e-9)
    assert unsure.from_start(4, own)[0, 0] > 2.0
    # Both branches count, and the one to the other place turns the robot about that place.
    lever = own - poses[3]
    doubt = calm.between(4, others, own)[0]
    turned = COVARIANCE[2, 2] * np.array([lever[1] ** 2, lever[0] ** 2])
    np.testing.assert_allclose(np.diag(doubt)[:2], 2.0 * np.diag(COVARIANCE)[:2] + turned)
    np.testing.assert_allclose(doubt[2, 2], 2.0 * COVARIANCE[2, 2])


def test_the_doubt_of_a_place_about_itself_is_nothing() -> None:
    np.testing.assert_allclose(chain().between(4, np.array([4]), WAY[4]), np.zeros((1, 3, 3)), atol=1e-12)


def test_a_surer_way_is_taken_and_the_child_follows() -> None:
    tree = chain()
    before = tree.from_start(5, WAY[5])
    step = tree.between(5, np.array([4]), WAY[5])
    tree.better(4, 0, WAY[4], SURE)
    np.testing.assert_allclose(tree.from_start(4, WAY[4]), SURE + COVARIANCE_AT_START, atol=1e-9)
    assert np.trace(tree.from_start(5, WAY[5])) < 0.5 * np.trace(before)
    np.testing.assert_allclose(tree.between(5, np.array([4]), WAY[5]), step, atol=1e-12)
    # Seen from place 3 the way now leads over the start, and the old chain to it is what is unsure.
    assert np.trace(tree.between(4, np.array([3]), WAY[4])[0]) > np.trace(SURE)


def test_a_way_that_is_less_sure_changes_nothing() -> None:
    tree, same = chain(), chain()
    tree.better(4, 1, WAY[4], 100.0 * COVARIANCE)
    every = np.arange(6)
    np.testing.assert_array_equal(tree.between(5, every, WAY[5]), same.between(5, every, WAY[5]))


@pytest.mark.parametrize("seed", range(5))
def test_every_doubt_is_symmetric_and_positive_however_the_tree_has_grown(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree = DoubtTree()
    for i in range(60):
        root = rng.normal(size=(3, 3)) * [[0.1], [0.1], [0.02]]
        pose = rng.uniform(-500.0, 500.0, 3)
        tree.add(int(rng.integers(0, max(i, 1))), pose, root @ root.T)
        if i > 5 and i % 4 == 0:
            tree.better(i, int(rng.integers(0, i)), pose, root @ root.T)
    doubts = tree.between(59, np.arange(60), rng.uniform(-500.0, 500.0, 3))
    np.testing.assert_array_equal(doubts, doubts.transpose(0, 2, 1))
    sizes = np.trace(doubts, axis1=1, axis2=2)
    assert (np.linalg.eigvalsh(doubts)[:, 0] > -1e-9 * np.maximum(sizes, 1.0)).all()
    assert (sizes[:-1] > 0.0).all()
