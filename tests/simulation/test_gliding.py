from collections.abc import Iterator
from itertools import count, islice, pairwise

import numpy as np
import pytest

from contourslam.geometry.poses import compose
from contourslam.simulation.follower import Habits
from contourslam.simulation.gliding import TICK, arc, glide

HABITS = Habits(0.8, 0.1, 20.0, 0.0)
WAY = [(0.0, 0.0), (5.0, 0.0), (5.0, 4.0), (2.0, 4.0)]


def test_the_robot_follows_the_waypoints_to_their_end() -> None:
    poses = np.array([tick.pose for tick in glide(WAY, HABITS)])
    assert np.hypot(*(poses[-1, :2] - WAY[-1])) < 0.2
    legs = [np.linspace(p, q, 400) for p, q in pairwise(WAY)]
    off = np.hypot(*np.moveaxis(poses[:, None, :2] - np.concatenate(legs)[None], 2, 0)).min(axis=1)
    assert off.max() < 0.2  # a bend is cut a little


def test_speed_and_turn_change_gently_and_keep_their_limits() -> None:
    ticks = list(glide(WAY, HABITS))
    v, omega = np.array([(tick.advance, tick.turn) for tick in ticks]).T / TICK
    assert v.max() < 0.89 and v.max() > 0.7
    assert np.abs(omega).max() <= HABITS.turn_limit + 1e-9
    assert np.abs(np.diff(v)).max() <= 0.5 * TICK + 1e-9
    assert np.abs(np.diff(omega)).max() <= 3.0 * TICK + 1e-9


def test_it_slows_down_for_a_bend() -> None:
    ticks = list(glide(WAY, HABITS))
    near = [t.advance / TICK for t in ticks if np.hypot(*(t.pose[:2] - [5.0, 0.0])) < 0.25]
    assert 0.05 < max(near) < 0.6


def test_each_pose_is_the_one_before_and_an_arc() -> None:
    ticks = list(glide(WAY, HABITS))
    for before, after in pairwise(ticks):
        np.testing.assert_allclose(compose(before.pose, arc(after.advance, after.turn)), after.pose, atol=1e-12)
        assert after.time == pytest.approx(before.time + TICK)


def test_an_arc_is_many_small_steps() -> None:
    pose = np.zeros(3)
    for _ in range(10000):
        pose += np.array([1.5e-4 * np.cos(pose[2]), 1.5e-4 * np.sin(pose[2]), 1e-4])
    np.testing.assert_allclose(arc(1.5, 1.0), pose, atol=1e-4)
    np.testing.assert_array_equal(arc(1.5, 0.0), [1.5, 0.0, 0.0])


def test_endless_waypoints_are_fetched_as_they_are_needed() -> None:
    fetched = 0

    def endless() -> Iterator[tuple[float, float]]:
        nonlocal fetched
        for k in count():
            fetched = k + 1
            yield float(k), 0.0

    *_, last = islice(glide(endless(), HABITS), 400)
    assert last.pose[0] > 10.0
    assert fetched < last.pose[0] + 5


def test_a_way_straight_back_is_turned_into_on_the_spot() -> None:
    poses = np.array([tick.pose for tick in glide([(0.0, 0.0), (3.0, 0.0), (0.2, 0.0)], HABITS)])
    assert np.hypot(*(poses[-1, :2] - [0.2, 0.0])) < 0.2
    assert poses[:, 0].max() < 3.5 and np.abs(poses[:, 1]).max() < 0.5
