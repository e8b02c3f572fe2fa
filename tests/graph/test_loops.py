"""Places seen again: what is closed is true, one look is not enough, and what looks alike is left open."""

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, GraphConfig
from contourslam.detectors import make_detector
from contourslam.geometry.poses import between, compose_one
from contourslam.matching.odometry import LocalMap
from contourslam.matching.oriented import move
from contourslam.replay import replay
from contourslam.slam.result import RunResult

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.graph import loops as module
from contourslam.graph.doubt import DoubtTree
from contourslam.graph.landmarks import Landmarks
from contourslam.graph.loops import Candidates, LoopFinder, Tie
from contourslam.graph.places import Keyframe, Places
from contourslam.simulation.long_drive import LongDrive, building_drive

Floats = NDArray[np.float64]
Look = Callable[..., list[tuple[int, Tie]]]

# A room with a niche, the floor on the left of each wall; nothing else in it is as long as any two walls.
ROOM = np.array([[-3.0, -2.5], [3.5, -2.5], [3.5, 1.0], [2.0, 1.0], [2.0, 2.8], [-1.0, 2.8], [-1.0, 2.0], [-3.0, 2.0]])
APART = 9.0  # m from a room to its double


def contours(dx: float = 0.0) -> Floats:
    """Points and normals of the room's walls, each 5 cm, shape (n, 4)."""
    rows = []
    for a, b in zip(ROOM, np.roll(ROOM, -1, axis=0), strict=True):
        length = math.dist(a, b)
        along = (b - a) / length
        points = a + np.arange(0.025, length, 0.05)[:, None] * along
        rows.append(np.column_stack([points + np.array([dx, 0.0]), np.tile([-along[1], along[0]], (len(points), 1))]))
    return np.concatenate(rows)


class Scene:
    """A finder that knows one place, the room at the origin, and looks at what the robot has seen since."""

    def __init__(self, *known: Floats) -> None:
        keyframe = Keyframe(0.0, np.zeros(3), np.concatenate(known).astype(np.float32))
        self.places, self.doubt = Places([keyframe], 40.0), DoubtTree()
        local = LocalMap(0, np.zeros(3), 40.0)
        local.insert(0, keyframe.oriented, np.zeros(3), 0.0)
        self.node = self.doubt.add(0, np.zeros(3), np.diag([1e-4, 1e-4, 1e-6]))
        self.places.add(local, self.node, np.zeros(3))
        landmarks = Landmarks(Config(), make_detector("matched_filter", adapted=True), np.zeros(3), self.doubt)
        self.finder = LoopFinder(self.places, self.doubt, landmarks)

    def look(self, true: Floats, wrong: Floats, sigma: float, travelled: float, key: int) -> list[tuple[int, Tie]]:
        """Look from a true pose in the room, believed to be off by `wrong`, with a doubt of `sigma` (m)."""
        believed = compose_one(true, wrong)
        odometry = compose_one(np.array([50.0, 20.0, 1.0]), true)  # a frame of its own
        patch = LocalMap(5, odometry, 40.0)
        patch.insert(5, move(contours(), np.array([50.0, 20.0, 1.0])), np.zeros(3), 0.0)
        unsure = Candidates(np.array([0]), np.diag([sigma**2, sigma**2, 0.1**2])[None])
        return self.finder.search(patch, odometry, believed, unsure, key, travelled)


FIRST, SECOND = np.array([0.5, -1.0, 0.4]), np.array([-1.5, 0.5, 2.0])
WRONG = np.array([0.9, -0.7, 0.1])


def test_two_looks_that_agree_close_the_loop_and_give_the_true_poses() -> None:
    scene = Scene(contours())
    assert scene.look(FIRST, WRONG, 1.0, 100.0, 10) == []
    found = scene.look(SECOND, WRONG, 1.0, 103.0, 17)
    assert [key for key, _ in found] == [10, 17]
    for (_, tie), true in zip(found, (FIRST, SECOND), strict=True):
        assert np.abs(between(true, tie.alignment.pose)).max() < 0.02
        np.testing.assert_allclose(tie.shift, between(compose_one(true, WRONG), true), atol=0.02)
        assert tie.method == "search"
        assert 0.0 <= tie.runner_up <= module.MOST_RIVAL
        assert tie.alignment.overlap > 0.9


def test_looks_from_one_spot_are_one_look_however_many() -> None:
    scene = Scene(contours())
    for i in range(20):
        assert scene.look(FIRST, WRONG, 1.0, 100.0 + 0.1 * i, 10 + i) == []
    assert scene.finder.searches >= 2


def test_a_first_look_is_forgotten_after_a_while() -> None:
    scene = Scene(contours())
    scene.look(FIRST, WRONG, 1.0, 100.0, 10)
    assert scene.look(SECOND, WRONG, 1.0, 100.0 + module.FORGET + 1.0, 50) == []


def test_looks_that_disagree_close_nothing() -> None:
    """Each finds the room, but the way between the two is not the one that the contour odometry has gone."""
    scene = Scene(contours())
    scene.look(FIRST, WRONG, 1.0, 100.0, 10)
    patch = LocalMap(5, np.zeros(3), 40.0)  # in another frame than before
    patch.insert(5, contours(), np.zeros(3), 0.0)
    unsure = Candidates(np.array([0]), np.diag([1.0, 1.0, 0.01])[None])
    assert scene.finder.search(patch, SECOND, compose_one(SECOND, WRONG), unsure, 17, 103.0) == []


def test_two_rooms_that_look_alike_leave_the_loop_open() -> None:
    """Both lie inside the doubt: whichever is taken, the other is as good."""
    scene, lonely = Scene(contours(), contours(APART)), Scene(contours())
    for i, pose in enumerate((FIRST, SECOND, FIRST, SECOND)):
        assert scene.look(pose, np.zeros(3), 4.0, 100.0 + (module.REST + 1.0) * i, 10 + i) == []
    assert scene.finder.searches == 4
    lonely.look(FIRST, np.zeros(3), 4.0, 100.0, 10)
    assert len(lonely.look(SECOND, np.zeros(3), 4.0, 103.0, 11)) == 2


def test_a_place_searched_in_vain_is_let_be_for_a_while() -> None:
    scene = Scene(contours(), contours(APART))
    for i in range(3):
        assert scene.look(FIRST, np.zeros(3), 4.0, 100.0 + 0.4 * module.REST * i, 10 + i) == []
    assert scene.finder.searches == 1
    assert scene.look(FIRST, np.zeros(3), 4.0, 100.0 + module.REST, 14) == []
    assert scene.finder.searches == 2


def test_a_room_that_looks_partly_alike_is_named_as_the_runner_up() -> None:
    other = contours(APART)
    scene = Scene(contours(), other[: len(other) * 8 // 10])
    scene.look(FIRST, np.zeros(3), 4.0, 100.0, 10)
    found = scene.look(SECOND, np.zeros(3), 4.0, 103.0, 11)
    assert len(found) == 2
    for (_, tie), true in zip(found, (FIRST, SECOND), strict=True):
        assert np.abs(between(true, tie.alignment.pose)).max() < 0.02
        assert 0.8 <= tie.runner_up < module.MOST_RIVAL  # worse ones are not looked for


def test_a_double_beyond_the_doubt_is_not_taken_for_the_room() -> None:
    """The robot is in another room, equal to the one that is known, and sure that it is not in that one."""
    scene, lonely = Scene(contours(-APART)), Scene(contours())
    for i, pose in enumerate((FIRST, SECOND)):
        assert scene.look(pose, np.zeros(3), 0.5, 100.0 + 3.0 * i, 10 + i) == []
        closed = lonely.look(pose, np.zeros(3), 0.5, 100.0 + 3.0 * i, 10 + i)
    assert len(closed) == 2


def test_a_pose_that_is_sure_is_aligned_and_one_that_is_not_is_searched_for() -> None:
    scene = Scene(contours())
    local = scene.places.list[0]
    finder, places = scene.finder, scene.places
    for _ in range(module.APART):  # so many newest places are passed over
        patch = LocalMap(local.anchor, np.zeros(3), 40.0)
        patch.insert(0, contours(), np.zeros(3), 0.0)
        places.add(patch, scene.node, np.array([100.0, 0.0, 0.0]))
    for sigma, sure in ((0.02, True), (1.0, False)):
        node = scene.doubt.add(scene.node, FIRST, np.diag([sigma**2, sigma**2, 1e-4]))
        sharp, unsure = finder.candidates(FIRST, node)
        assert (sharp.numbers.tolist(), unsure.numbers.tolist()) == (([0], []) if sure else ([], [0]))
    far = np.array([200.0, 0.0, 0.0])
    assert not any(len(c.numbers) for c in finder.candidates(far, node))


def test_a_keyframe_is_tied_to_a_place_only_where_its_contours_fit() -> None:
    scene = Scene(contours())
    sharp = Candidates(np.array([0]), np.diag([0.05**2, 0.05**2, 0.02**2])[None])
    seen = move(contours(), between(FIRST, np.zeros(3)))
    off = np.array([0.05, -0.04, 0.01])
    tie = scene.finder.tie(seen, compose_one(FIRST, off), sharp)
    assert tie is not None
    assert np.abs(between(FIRST, tie.alignment.pose)).max() < 0.01
    assert tie.method == "nearby"
    elsewhere = move(seen * [1.0, -1.0, 1.0, -1.0], np.array([0.7, 0.3, 0.5]))  # a mirror image
    assert scene.finder.tie(elsewhere, FIRST, sharp) is None


@cache
def building() -> tuple[RunResult, LongDrive]:
    drive = building_drive(150.0, 1)
    return replay(drive.messages(), Config(back_end="graph"), lidar_mount=drive.lidar_mount), drive


def test_every_loop_of_a_drive_through_a_building_is_true() -> None:
    result, _ = building()
    assert result.truth is not None
    for loop in result.loops:
        first, second = np.searchsorted(result.stamps, [loop.earlier_stamp - 1e-6, loop.later_stamp - 1e-6])
        true = between(result.truth[first], result.truth[second])
        off = between(true, loop.relative_pose)
        assert math.hypot(off[0], off[1]) < 0.1
        assert abs(off[2]) < math.radians(2.0)
        np.testing.assert_allclose(loop.covariance, loop.covariance.T, rtol=1e-9, atol=1e-15)
        assert np.linalg.eigvalsh(loop.covariance)[0] > 0.0
        assert loop.earlier_stamp < loop.later_stamp
        assert 0.0 <= loop.runner_up < 1.0
    assert len(result.loops) > 20
    assert {loop.method for loop in result.loops} > {"nearby"}


def test_without_loops_none_is_closed() -> None:
    with_loops, drive = building()
    config = Config(back_end="graph", graph=GraphConfig(loops=False, refine=False))
    result = replay(drive.messages(), config, lidar_mount=drive.lidar_mount)
    assert result.loops == ()
    assert result.truth is not None
    assert with_loops.truth is not None
    drift = np.hypot(*(result.poses - result.truth)[:, :2].T).mean()
    assert np.hypot(*(with_loops.poses - with_loops.truth)[:, :2].T).mean() < drift
