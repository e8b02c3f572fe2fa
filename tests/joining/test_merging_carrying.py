"""A trajectory goes where its keyframes go."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.poses import between, compose
from contourslam.joining.carrying import carry, frame_among

Floats = NDArray[np.float64]
COUNT = 6


def way(seed: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Stamps and poses of scans, and of the keyframes among them."""
    rng = np.random.default_rng(seed)
    stamps = np.cumsum(rng.uniform(0.05, 0.15, 10 * COUNT))
    poses = np.cumsum(rng.normal(0.05, 0.05, (10 * COUNT, 3)), axis=0)
    keys = np.arange(5, 10 * COUNT, 10)
    return stamps, poses, stamps[keys], poses[keys]


def assert_same(first: Floats, second: Floats, within: float = 1e-9) -> None:
    np.testing.assert_allclose(between(first, second), 0.0, atol=within)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.tuples(*[st.floats(-9.0, 9.0)] * 3))
def test_a_map_that_moves_as_a_whole_takes_its_trajectory_along(seed: int, frame: tuple[float, float, float]) -> None:
    stamps, poses, key_stamps, before = way(seed)
    moved = np.array([frame])
    assert_same(carry(stamps, poses, key_stamps, before, compose(moved, before)), compose(moved, poses), 1e-8)
    found, bent = frame_among(before, compose(moved, before))
    assert_same(found[None], moved, 1e-8)
    assert bent < 1e-8


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000))
def test_at_a_keyframe_the_trajectory_is_where_the_keyframe_is_and_between_two_it_is_whole(seed: int) -> None:
    stamps, poses, key_stamps, before = way(seed)
    after = compose(before, np.random.default_rng(seed + 1).normal(0.0, 0.1, before.shape))
    carried = carry(stamps, poses, key_stamps, before, after)
    at = np.searchsorted(stamps, key_stamps)
    assert_same(carried[at], after)
    # No step differs from what it was by more than the two keyframes around it moved against each other.
    was, now = between(poses[:-1], poses[1:]), between(carried[:-1], carried[1:])
    assert np.abs(now - was)[:, :2].max() < 0.2


def test_neither_scans_nor_keyframes_need_be_in_the_order_of_time() -> None:
    stamps, poses, key_stamps, before = way(3)
    after = compose(before, np.random.default_rng(4).normal(0.0, 0.1, before.shape))
    order, other = np.random.default_rng(5).permutation(len(stamps)), np.random.default_rng(6).permutation(COUNT)
    mixed = carry(stamps[order], poses[order], key_stamps[other], before[other], after[other])
    np.testing.assert_array_equal(mixed, carry(stamps, poses, key_stamps, before, after)[order])


def test_one_keyframe_carries_everything() -> None:
    stamps, poses, key_stamps, before = way(7)
    moved = np.array([[3.0, -2.0, 1.0]])
    carried = carry(stamps, poses, key_stamps[:1], before[:1], compose(moved, before[:1]))
    assert_same(carried, compose(moved, poses))


def test_a_map_that_was_bent_says_by_how_much() -> None:
    _, _, _, before = way(8)
    after = before.copy()
    after[0, 0] += 0.6
    frame, bent = frame_among(before, after)
    assert abs(bent - 0.6 * (1.0 - 1.0 / COUNT)) < 1e-9
    assert abs(frame[0] - 0.6 / COUNT) < 1e-9
