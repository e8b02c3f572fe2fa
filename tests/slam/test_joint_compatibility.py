"""Joint compatibility against the best of all hypotheses, tried one by one with dense matrices."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import SlamConfig
from contourslam.geometry.poses import compose, inverse, transform
from contourslam.landmarks import Corners, Walls
from contourslam.slam.association import Model, associate
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.measurement import innovation, predict_measurements
from contourslam.slam.observation import Observations, to_world

stats = pytest.importorskip("scipy.stats", reason="needs the extra 'report'")

Floats = NDArray[np.float64]
MapOf = Callable[..., LandmarkFilter]
See = Callable[..., Observations]
MakeCorners = Callable[..., Corners]

MOUNT = np.zeros(3)


def model_of(filter_: LandmarkFilter) -> Model:
    return predict_measurements(filter_.mean[:3], MOUNT, filter_.mean, filter_.table, filter_.count, False)


def match(filter_: LandmarkFilter, seen: Observations, association: str, probability: float = 0.99) -> list[int]:
    world = to_world(filter_.mean[:3], MOUNT, seen.looks)
    config = SlamConfig(association=association, gate_probability=probability)
    return associate(seen, world, filter_, model_of(filter_), config).tolist()


def joint_distance(P: Floats, seen: Observations, model: Model, kinds: Floats, pairs: list[tuple[int, int]]) -> float:
    """Squared Mahalanobis distance of all innovations together, with every matrix written out."""
    expected, by_pose, by_landmark = model
    m = len(pairs)
    H, nu, Q = np.zeros((2 * m, len(P))), np.zeros(2 * m), np.zeros((2 * m, 2 * m))
    for q, (i, j) in enumerate(pairs):
        at = slice(2 * q, 2 * q + 2)
        H[at, :3], H[at, 3 + 2 * j : 5 + 2 * j] = by_pose[j], by_landmark[j]
        nu[at], Q[at, at] = innovation(kinds[j], seen.values[i], expected[j]), seen.noises[i]
    return float(nu @ np.linalg.solve(H @ P @ H.T + Q, nu))


def best_hypothesis(filter_: LandmarkFilter, P: Floats, seen: Observations, probability: float) -> tuple[int, float]:
    """Most pairs, and the least joint distance with so many, of all hypotheses.

    A hypothesis counts if each of its pairs passes the gate alone and it stays compatible pair by pair, in the order of
    the observations, as the tree of Neira and Tardos is grown.
    """
    kinds, model = filter_.table[: filter_.count, 0], model_of(filter_)
    gate = {m: stats.chi2.ppf(probability, 2 * m) for m in range(1, len(seen) + 1)}
    best = (0, 0.0)
    for picks in itertools.product(range(-1, filter_.count), repeat=len(seen)):
        pairs = [(i, j) for i, j in enumerate(picks) if j >= 0]
        if len({j for _, j in pairs}) < len(pairs) or len(pairs) < best[0]:
            continue
        if any(joint_distance(P, seen, model, kinds, [pair]) > gate[1] for pair in pairs):
            continue
        distances = [joint_distance(P, seen, model, kinds, pairs[: m + 1]) for m in range(len(pairs))]
        if any(d > gate[m + 1] for m, d in enumerate(distances)):
            continue
        if pairs and (len(pairs) > best[0] or distances[-1] < best[1]):
            best = (len(pairs), distances[-1])
    return best


@given(seed=st.integers(0, 2**32 - 1), landmarks=st.integers(1, 5), seen=st.integers(1, 4))
@settings(max_examples=60)
def test_the_hypothesis_is_the_best_of_all(
    map_of: MapOf, see: See, corners_at: MakeCorners, full: Callable[..., Floats], seed: int, landmarks: int, seen: int
) -> None:
    # Landmarks about as far apart as the pose is in doubt: most observations could be several of them.
    rng = np.random.default_rng(seed)
    positions = [2.5, 0.0] + rng.normal(size=(landmarks, 2)) * 0.06
    filter_ = map_of(corners_at(positions, sigma=0.02))
    root = rng.normal(size=(3, 3)) * [[0.04], [0.04], [0.01]]
    filter_.covariance[:3, :3] += np.tril(root @ root.T)
    chosen = rng.integers(0, landmarks, seen)
    observed = see(corners_at(positions[chosen] + rng.normal(size=(seen, 2)) * 0.05, sigma=0.02))
    result = match(filter_, observed, "joint")
    pairs = [(i, j) for i, j in enumerate(result) if j >= 0]
    assert len({j for _, j in pairs}) == len(pairs)
    size, distance = best_hypothesis(filter_, full(filter_), observed, 0.99)
    assert len(pairs) == size
    if size:
        kinds = filter_.table[: filter_.count, 0]
        reached = joint_distance(full(filter_), observed, model_of(filter_), kinds, pairs)
        assert reached == pytest.approx(distance, rel=1e-6)


def test_corners_and_walls_are_judged_together(
    map_of: MapOf, see: See, corners_at: MakeCorners, walls_at: Callable[..., Walls], full: Callable[..., Floats]
) -> None:
    corners = corners_at([[2.0, 1.0], [1.0, -1.5]])
    walls = walls_at([[[2.0, -1.0], [2.0, 1.0]], [[2.0, 1.0], [-1.0, 1.0]]])
    filter_ = map_of(corners, walls)
    filter_.covariance[:3, :3] += np.diag([0.1, 0.1, 0.03]) ** 2
    # All seen from a pose that is a little off in x, y and heading.
    slip = inverse(np.array([0.08, -0.1, 0.02]))
    ends = transform(slip, walls.end_points)
    seen = see(corners_at(transform(slip, corners.positions)), walls_at(ends))
    assert match(filter_, seen, "joint") == [0, 1, 2, 3]
    assert best_hypothesis(filter_, full(filter_), seen, 0.99)[0] == 4


def spurious(map_of: MapOf, see: See, corners_at: MakeCorners) -> tuple[LandmarkFilter, Observations]:
    """Two corners seen 20 cm to the left; a third, whose landmark is unknown, seems to be a known one 20 cm right."""
    filter_ = map_of(corners_at([[2.0, 1.0], [3.0, -0.5], [2.5, 2.5]]))
    filter_.covariance[:3, :3] += np.diag([0.001, 0.1, 0.001]) ** 2  # in doubt sideways only
    return filter_, see(corners_at([[2.0, 1.2], [3.0, -0.3], [2.5, 2.3]]))


@pytest.mark.parametrize("mode", ["nearest", "mahalanobis", "mutual"])
def test_individual_gates_accept_the_classic_spurious_pairing(
    map_of: MapOf, see: See, corners_at: MakeCorners, mode: str
) -> None:
    assert match(*spurious(map_of, see, corners_at), mode) == [0, 1, 2]


def test_joint_compatibility_rejects_the_classic_spurious_pairing(
    map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    assert match(*spurious(map_of, see, corners_at), "joint") == [0, 1, -1]


def test_a_row_of_look_alike_columns_is_matched_as_one_row(map_of: MapOf, see: See, corners_at: MakeCorners) -> None:
    # The robot is in doubt along the row by more than the columns' spacing: each alone has several candidates.
    row = np.array([[1.0, 5.0], [1.6, 5.0], [2.4, 5.0], [2.7, 5.0], [3.6, 5.0]])
    filter_ = map_of(corners_at(row))
    filter_.covariance[:3, :3] += np.diag([0.25, 0.001, 0.001]) ** 2
    seen = see(corners_at(row - [0.35, 0.0]))
    assert match(filter_, seen, "joint") == [0, 1, 2, 3, 4]
    assert match(filter_, seen, "nearest") != [0, 1, 2, 3, 4]


def test_a_match_that_says_no_more_than_news_would_is_left_open(
    map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    filter_ = map_of(corners_at([2.0, 0.0]))
    assert match(filter_, see(corners_at([2.0, 0.2])), "joint") == [-1]
    filter_.covariance[:3, :3] += np.diag([0.1, 0.1, 0.02]) ** 2
    assert match(filter_, see(corners_at([2.0, 0.2])), "joint") == [0]
    filter_.covariance[:3, :3] += np.diag([2.0, 2.0, 0.02]) ** 2
    assert match(filter_, see(corners_at([2.0, 0.2])), "joint") == [-1]


def test_a_crowd_of_look_alikes_ends_within_the_nodes_allowed_and_keeps_to_one_landmark_each(
    map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    # 20 observations with dozens of candidates each: far more hypotheses than can be tried.
    rng = np.random.default_rng(1)
    positions = [3.0, 0.0] + rng.normal(size=(40, 2)) * 0.1
    filter_ = map_of(corners_at(positions, sigma=0.1))
    result = match(filter_, see(corners_at(positions[:20], sigma=0.1)), "joint")
    matched = [j for j in result if j >= 0]
    assert len(set(matched)) == len(matched) >= 15


@given(heading=st.floats(-math.pi, math.pi))
def test_the_joint_match_does_not_depend_on_the_heading(
    map_of: MapOf, see: See, corners_at: MakeCorners, heading: float
) -> None:
    positions = np.array([[2.0, 1.0], [-2.0, 0.0], [0.5, -2.0]])
    filter_ = map_of(corners_at(positions), pose=(1.0, 2.0, heading))
    filter_.covariance[:3, :3] += np.diag([0.02, 0.02, 0.01]) ** 2
    moved = transform(inverse(compose(np.array([0.02, 0.01, 0.01]), np.zeros(3))), positions)
    assert match(filter_, see(corners_at(moved)), "joint") == [0, 1, 2]
