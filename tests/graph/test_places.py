"""Finished stretches of the drive: their contours can be let go, and those near a pose are found in order."""

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.geometry.poses import compose_one

pytest.importorskip("gtsam", reason="needs the extra 'graph'")

from contourslam.graph import places as module
from contourslam.graph.places import Keyframe, Places
from contourslam.matching.odometry import LocalMap

Floats = NDArray[np.float64]
HALF_WIDTH = 20.0


def filled(count: int, spacing: float = 5.0, *, keyframes_each: int = 3, seed: int = 0) -> Places:
    """Places in a row along x, each from a few keyframes whose contours are points strewn around them."""
    rng = np.random.default_rng(seed)
    keyframes: list[Keyframe] = []
    places = Places(keyframes, HALF_WIDTH)
    for number in range(count):
        local = None
        for step in range(keyframes_each):
            pose = np.array([spacing * number + 0.5 * step, 0.1 * step, 0.02 * number])
            angles = rng.uniform(-np.pi, np.pi, 80)
            points = rng.uniform(-4.0, 4.0, (80, 2))
            oriented = np.column_stack([points, np.cos(angles), np.sin(angles)]).astype(np.float32)
            keyframes.append(Keyframe(float(len(keyframes)), pose, oriented))
            local = local or LocalMap(len(keyframes) - 1, pose, HALF_WIDTH)
            local.insert(len(keyframes) - 1, oriented, pose, 0.5)
        assert local is not None
        places.add(local, node=number, anchor_pose=local.pose)
    return places


def test_contours_that_were_let_go_are_put_together_the_same_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "KEPT", 2)
    places = filled(5)
    first = places.cells(0)
    points, index = first.points.copy(), first.index.copy()
    assert places.cells(0) is first
    for number in range(1, 5):
        places.cells(number)
    again = places.cells(0)
    assert again is not first
    np.testing.assert_array_equal(again.points, points)
    np.testing.assert_array_equal(again.index, index)


def test_the_contours_used_last_are_those_that_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "KEPT", 2)
    places = filled(3)
    first, second = places.cells(0), places.cells(1)
    assert places.cells(0) is first
    places.cells(2)
    assert places.cells(0) is first
    assert places.cells(1) is not second


def test_a_place_holds_the_contours_of_its_members_about_its_anchor() -> None:
    keyframes = [
        Keyframe(0.0, np.array([3.0, 2.0, np.pi / 2]), np.array([[1.0, 0.0, 1.0, 0.0]], np.float32)),
        Keyframe(1.0, np.array([3.0, 4.0, np.pi / 2]), np.array([[1.0, 0.0, 1.0, 0.0]], np.float32)),
    ]
    places, local = Places(keyframes, HALF_WIDTH), LocalMap(0, keyframes[0].local, HALF_WIDTH)
    for number, keyframe in enumerate(keyframes):
        local.insert(number, keyframe.oriented, keyframe.local, 2.0)
    places.add(local, 0, np.array([-7.0, 1.0, 0.3]))
    np.testing.assert_allclose(places.cells(0).points, [[1, 0, 1, 0, 1], [3, 0, 1, 0, 1]], atol=1e-6)


def test_places_near_a_pose_come_nearest_first_and_within_reach() -> None:
    places = filled(30)
    pose = np.array([52.0, 1.0, 0.0])
    numbers, distances = places.near(pose, until=30, reach=12.0)
    centres = np.array([places.centre(n)[:2] for n in range(30)])
    every = np.hypot(*(centres - pose[:2]).T)
    assert set(numbers.tolist()) == set(np.flatnonzero(every < 12.0).tolist())
    assert len(numbers) > 3
    np.testing.assert_allclose(distances, every[numbers])
    assert (np.diff(distances) >= 0.0).all()


def test_only_places_before_the_last_few_are_given_out() -> None:
    places = filled(6)
    here = np.array([27.0, 0.0, 0.0])
    assert places.near(here, until=3, reach=100.0)[0].tolist() == [2, 1, 0]
    assert places.near(here, until=0, reach=100.0)[0].size == 0
    assert places.near(here, until=-2, reach=100.0)[0].size == 0
    assert places.near(here, until=6, reach=1e-6)[0].size == 0


def test_a_place_moves_with_its_anchor() -> None:
    places = filled(20)
    correction = np.array([10.0, -4.0, 0.5])
    before = np.array([places.centre(n) for n in range(20)])
    seen = np.array([1.0, 2.0, 0.3])
    places.move(np.array([compose_one(correction, anchor) for anchor in places.anchors]))
    for number in range(20):
        np.testing.assert_allclose(places.centre(number), compose_one(correction, before[number]), atol=1e-9)
        np.testing.assert_allclose(places.into(number, places.out_of(number, seen)), seen, atol=1e-9)
    assert places.near(compose_one(correction, before[7]), 20, 0.1)[0].tolist() == [7]


def test_around_a_place_its_neighbours_are_seen_in_its_own_frame() -> None:
    places = filled(4)
    own = len(places.cells(1).points)
    around = places.around(1)
    assert len(around) == sum(len(places.cells(n).points) for n in range(3))
    first = len(places.cells(0).points)
    np.testing.assert_allclose(around[first : first + own], places.cells(1).points[:, :4], atol=1e-9)
    # The place before lies 5 m behind; what is strewn around it too.
    assert around[:first, 0].mean() == pytest.approx(places.cells(0).points[:, 0].mean() - 5.0, abs=0.2)
