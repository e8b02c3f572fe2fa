"""Which maps belong together: joints that agree hold, one that contradicts surer ones is left out."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

pytest.importorskip("gtsam", reason="needs the extra 'graph'")

from contourslam.errors import MapError
from contourslam.geometry.poses import between, between_one, compose, compose_one, inverse
from contourslam.joining.groups import find_groups
from contourslam.joining.joint import Evidence, Joint, Tie
from contourslam.maps import Contoured, Relations, SavedMap, Seen, Stretches
from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]

STEP = np.array([1.0, 0.0, 0.05])
SIGMA = np.array([0.01, 0.01, 0.002])  # of a step of the drive, and of a tie
FRAMES = np.array([[0.0, 0.0, 0.0], [5.0, -2.0, 2.0], [-3.0, 4.0, -1.0], [1.0, 9.0, 3.0]])  # in the building


def drive(count: int, first: int = 0) -> SavedMap:
    """A drive of some steps in a frame of its own, whose contours are those of no other."""
    poses = np.zeros((count, 3))
    for i in range(1, count):
        poses[i] = compose_one(poses[i - 1], STEP)
    points = np.arange(4 * count, dtype=np.float32).reshape(-1, 4) + 1000.0 * first
    information = np.tile(np.diag(SIGMA**-2.0), (count, 1, 1))
    keys = np.arange(count)
    return SavedMap(
        CornerMap(*(np.zeros((0, *s)) for s in ((), (2,), (2, 2), (), (), (), (), ()))),  # type: ignore[arg-type]
        WallMap(*(np.zeros((0, *s)) for s in ((), (2, 2), (2, 2, 2), (), (2, 2), (), ()))),  # type: ignore[arg-type]
        Contoured(
            keys + 100.0 * first, poses, np.tile(np.eye(3) * 1e-6, (count, 1, 1)), np.zeros(count),
            np.arange(count + 1), points, np.zeros(count, np.int64),
        ),
        Relations(
            keys - 1, keys, np.vstack([poses[0], between(poses[:-1], poses[1:])]), information,
            np.full(count, np.nan), np.zeros(count, np.bool_),
        ),
        Seen(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros((0, 13), np.float32), np.zeros(0, np.int64)),
        Stretches(keys, np.arange(count + 1), keys, np.zeros((count, 3))),
    )  # fmt: skip


def joint(frames: Floats, first: int, second: int, *, off: Floats | None = None, agreeing: float = 20.0) -> Joint:
    """The second map laid on the first where it is, or so far off, by keyframe 1 of the one and 2 of the other."""
    maps = drive(4).keyframes
    assert maps is not None
    pose = compose_one(inverse(frames[first]), frames[second])
    if off is not None:
        pose = compose_one(pose, off)
    tie = Tie(1, 2, between_one(maps.poses[1], compose_one(pose, maps.poses[2])), np.diag(SIGMA**2))
    return Joint(pose, (tie,), Evidence(5, 5, agreeing, 0.0, 10.0, 0.1), "constellation")


def test_three_maps_in_a_ring_that_agree_are_one_group() -> None:
    maps = [drive(5), drive(9, 1), drive(7, 2)]
    joints = {pair: joint(FRAMES, *pair) for pair in ((0, 1), (1, 2), (0, 2))}
    (group,) = find_groups(maps, joints)
    assert group.members == (1, 0, 2)  # the one with the most keyframes, then as they came
    assert set(group.joints) == set(joints)
    assert group.left_out == ()
    np.testing.assert_allclose(between(compose(FRAMES[1], group.frames), FRAMES[[1, 0, 2]]), 0.0, atol=1e-9)


@pytest.mark.parametrize("weakest", [(0, 1), (1, 2), (0, 2)])
def test_the_weakest_joint_of_a_ring_that_contradicts_itself_is_left_out_and_told(weakest: tuple[int, int]) -> None:
    maps = [drive(5), drive(5, 1), drive(5, 2)]
    joints = {pair: joint(FRAMES, *pair) for pair in ((0, 1), (1, 2), (0, 2))}
    joints[weakest] = joint(FRAMES, *weakest, off=np.array([3.6, 0.0, 0.0]), agreeing=10.0)  # the next door
    (group,) = find_groups(maps, joints)
    assert set(group.joints) == set(joints) - {weakest}
    (left,) = group.left_out
    assert left.maps == weakest
    assert math.hypot(left.off[0], left.off[1]) == pytest.approx(3.6, abs=1e-6)
    assert (left.sigma[:2] < 0.5).all()


def test_what_the_drift_of_the_maps_explains_is_no_contradiction() -> None:
    long, short = [drive(400), drive(5, 1), drive(5, 2)], [drive(5), drive(5, 1), drive(5, 2)]
    frames = FRAMES[:3].copy()
    joints = {pair: joint(frames, *pair) for pair in ((0, 1), (1, 2))}
    assert long[0].keyframes is not None
    pose = compose_one(inverse(long[0].keyframes.poses[390]), compose_one(frames[2], long[0].keyframes.poses[2]))
    bent = Tie(390, 2, compose_one(pose, np.array([0.5, 0.5, 0.05])), np.diag(SIGMA**2))
    joints[0, 2] = Joint(frames[2], (bent,), Evidence(5, 5, 10.0, 0.0, 10.0, 0.1), "search")
    assert set(find_groups(long, joints)[0].joints) == set(joints)
    joints[0, 2] = joint(frames, 0, 2, off=np.array([0.5, 0.5, 0.05]), agreeing=10.0)  # here nothing explains it
    assert set(find_groups(short, joints)[0].joints) == {(0, 1), (1, 2)}


def test_maps_without_a_joint_stay_apart() -> None:
    maps = [drive(5), drive(6, 1), drive(7, 2), drive(8, 3)]
    groups = find_groups(maps, {(0, 1): joint(FRAMES, 0, 1)})
    assert [group.members for group in groups] == [(1, 0), (3,), (2,)]


def test_maps_that_hold_the_same_drive_belong_together_without_a_joint() -> None:
    maps = [drive(5), drive(9), drive(5, 2)]  # the second went on where the first ended
    groups = find_groups(maps, {})
    assert [group.members for group in groups] == [(1, 0), (2,)]
    np.testing.assert_allclose(groups[0].frames, 0.0, atol=1e-12)


def test_maps_of_landmarks_alone_cannot_be_joined() -> None:
    alone = SavedMap(drive(3).corners, drive(3).walls)
    with pytest.raises(MapError, match="it holds no keyframes"):
        find_groups([drive(3), alone], {})


@settings(max_examples=30, deadline=None)
@given(
    st.permutations(range(4)),
    st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)).filter(lambda pair: pair[0] != pair[1]), max_size=6),
)
def test_in_whatever_order_the_maps_come_the_same_ones_belong_together_in_the_same_way(
    order: list[int], pairs: list[tuple[int, int]]
) -> None:
    maps = [drive(4 + number, number) for number in range(4)]
    joints = {pair: joint(FRAMES, *pair) for pair in pairs}
    there = {number: place for place, number in enumerate(order)}
    found = find_groups([maps[number] for number in order], {(there[a], there[b]): j for (a, b), j in joints.items()})
    expected = find_groups(maps, joints)
    assert {frozenset(order[n] for n in group.members) for group in found} == {
        frozenset(group.members) for group in expected
    }
    for group in found:
        numbers = [order[n] for n in group.members]
        assert numbers[0] == max(numbers)  # the longest
        np.testing.assert_allclose(between(compose(FRAMES[numbers[0]], group.frames), FRAMES[numbers]), 0.0, atol=1e-9)
