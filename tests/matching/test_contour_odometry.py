import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.geometry.poses import between_one, compose_one
from contourslam.matching.certainty import Hold
from contourslam.matching.odometry import FEWEST, KEY_DISTANCE, LENGTH, ContourOdometry, LocalMap, Step

Floats = NDArray[np.float64]
See = Callable[..., Floats]
NOISE = np.diag([0.02**2, 0.01**2, math.radians(1.5) ** 2])


def way(steps: int) -> list[Floats]:
    """A slalom up and down a hall, up to 0.1 m a step."""
    times = 0.1 * np.arange(steps)
    shares = [4.0 * np.sin(0.25 * times), 0.6 * np.sin(0.8 * times), 0.5 * np.sin(0.5 * times)]
    return list(np.stack(shares, axis=1))


@pytest.fixture(scope="module")
def hall() -> Floats:
    """Walls of a long hall with niches and pillars, as rows of two ends."""
    outline = np.array(
        [[-9.0, -2.0], [9.0, -2.0], [9.0, 2.0], [2.0, 2.0], [2.0, 3.5], [0.5, 3.5], [0.5, 2.0], [-9.0, 2.0]]
    )
    boxes = [np.array([[x, y], [x + 0.3, y], [x + 0.3, y + 0.3], [x, y + 0.3]]) for x, y in ((-5.0, 1.3), (5.0, -1.7))]
    return np.vstack([np.hstack([p, np.roll(p, -1, axis=0)]) for p in (outline, *boxes)])


def drive(
    see: See, walls: Floats, poses: list[Floats], *, wheels: bool = True, seed: int = 0, errs: float = 0.3
) -> list[Step]:
    """Steps along poses, the first of them its origin; the wheels err by `errs` of what they state."""
    chance, odometry, steps, last = np.random.default_rng(seed), ContourOdometry(30.0), [], np.zeros(3)
    for before, pose in pairwise([poses[0], *poses]):
        noise = NOISE if wheels else np.diag([0.05**2, 0.05**2, math.radians(6.0) ** 2])
        motion = between_one(before, pose) + errs * np.sqrt(np.diag(NOISE)) * chance.standard_normal(3)
        start = odometry.pose
        steps.append(odometry.push(see(walls, pose, chance, beams=180), motion if wheels else last, noise))
        last = between_one(start, steps[-1].pose)
    return steps


def drift(poses: list[Floats], steps: list[Step]) -> Floats:
    """Errors of all poses seen from the first, shape (n, 3)."""
    pairs = zip(poses, steps, strict=True)
    return np.array([between_one(between_one(poses[0], pose), step.pose) for pose, step in pairs])


@pytest.fixture(scope="module")
def driven(see: See, hall: Floats) -> tuple[list[Floats], list[Step]]:
    poses = way(200)
    return poses, drive(see, hall, poses)


def test_it_drifts_by_centimetres_only_and_says_that_all_is_well(driven: tuple[list[Floats], list[Step]]) -> None:
    errors = drift(*driven)
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.08
    assert np.abs(errors[:, 2]).max() < math.radians(1.5)
    assert np.mean([step.quality for step in driven[1][5:]]) > 0.9
    assert not any(step.slipped for step in driven[1])


def test_it_goes_without_wheels(see: See, hall: Floats) -> None:
    poses = way(150)
    errors = drift(poses, drive(see, hall, poses, wheels=False))
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.1


def test_a_scan_some_way_from_the_last_keyframe_becomes_one(driven: tuple[list[Floats], list[Step]]) -> None:
    keys = [step for step in driven[1] if step.keyframe is not None]
    assert [step.keyframe for step in keys] == list(range(len(keys)))
    assert keys[0] is driven[1][0]
    for a, b in pairwise(keys):
        way_between = between_one(a.pose, b.pose)
        assert math.hypot(way_between[0], way_between[1]) < 2.0 * KEY_DISTANCE
    assert len(keys) < len(driven[1]) / 3


def test_every_keyframe_but_the_first_knows_its_pose_from_its_anchor(
    driven: tuple[list[Floats], list[Step]],
) -> None:
    first, *others = (step for step in driven[1] if step.keyframe is not None)
    assert first.match is None
    poses = {step.keyframe: (true, step.pose) for true, step in zip(*driven, strict=True) if step.keyframe is not None}
    values = []
    for step in others:
        assert step.keyframe is not None
        assert step.match is not None
        (true_anchor, anchor), (true, pose) = poses[step.anchor], poses[step.keyframe]
        error = between_one(between_one(true_anchor, true), between_one(anchor, pose))
        values.append(error @ np.linalg.solve(step.match, error))
    assert 0.2 < np.mean(values) < 8.0
    assert all(step.match is None for step in driven[1] if step.keyframe is None)


def test_local_maps_overlap_and_each_keyframe_is_in_one_or_two(driven: tuple[list[Floats], list[Step]]) -> None:
    finished: list[LocalMap] = [step.finished for step in driven[1] if step.finished is not None]
    assert len(finished) >= 3
    for local in finished:
        assert local.travelled >= LENGTH
        assert len(local.members) >= FEWEST
        assert local.members[0] == local.anchor
        assert local.members == list(range(local.members[0], local.members[-1] + 1))
        assert isinstance(local.hold, Hold)
        assert local.hold is local.hold
    for a, b in pairwise(finished):
        assert a.anchor < b.anchor < a.members[-1] < b.members[-1]


def test_a_push_that_the_wheels_do_not_feel_is_noticed_and_undone(see: See, hall: Floats) -> None:
    poses = way(60)
    chance, odometry = np.random.default_rng(1), ContourOdometry(30.0)
    for before, pose in pairwise([poses[0], *poses]):
        odometry.push(see(hall, pose, chance), between_one(before, pose), NOISE)
    pushed = compose_one(poses[-1], np.array([0.35, 0.25, math.radians(12.0)]))
    steps = [odometry.push(see(hall, pushed, chance), np.zeros(3), 0.01 * NOISE) for _ in range(3)]
    assert steps[0].slipped
    error = between_one(between_one(poses[0], pushed), steps[-1].pose)
    assert np.abs(error).max() < 0.05


@pytest.mark.parametrize("errs", [0.3, 1.0, 3.0])
def test_the_innovation_is_as_large_as_the_wheels_errors_are_beside_what_they_state(
    see: See, hall: Floats, errs: float
) -> None:
    steps = drive(see, hall, way(200), seed=3, errs=errs)
    mean = np.mean([step.nis for step in steps if step.alignment is not None and not step.slipped]) / 3.0
    assert 0.6 * errs**2 < mean < 1.4 * errs**2 + 0.1


def test_the_quality_drops_where_the_lidar_sees_something_else(see: See, hall: Floats) -> None:
    poses = way(60)
    chance, odometry = np.random.default_rng(2), ContourOdometry(30.0)
    for before, pose in pairwise([poses[0], *poses]):
        step = odometry.push(see(hall, pose, chance), between_one(before, pose), NOISE)
    assert step.quality > 0.9
    crowd = np.array([[0.6, -0.3, 0.6, 0.4], [-0.5, 0.2, -0.4, -0.5], [-0.3, 0.6, 0.4, 0.5], [0.4, -0.6, -0.3, -0.6]])
    blocked = odometry.push(see(crowd, (0.0, 0.0, 0.0), chance), np.zeros(3), 0.01 * NOISE)
    assert blocked.quality < 0.6


def test_without_points_the_wheels_word_is_taken(see: See, hall: Floats) -> None:
    chance, odometry = np.random.default_rng(3), ContourOdometry(30.0)
    odometry.push(see(hall, (0.0, 0.0, 0.0), chance), np.zeros(3), NOISE)
    before = odometry.pose
    for k in range(4):
        step = odometry.push(np.empty((0, 4)), np.array([0.1, 0.0, 0.0]), NOISE)
        np.testing.assert_allclose(step.pose, compose_one(before, np.array([0.1 * (k + 1), 0.0, 0.0])), atol=1e-12)
        assert step.alignment is None
        assert step.match is None
        assert step.quality == 0.0
    with pytest.raises(RuntimeError, match="no scan"):
        _ = ContourOdometry(30.0).newest


def test_it_learns_how_much_less_the_wheels_err_than_they_say(see: See, hall: Floats) -> None:
    chance, odometry, poses = np.random.default_rng(4), ContourOdometry(30.0), way(200)
    true = math.radians(0.5)
    for before, pose in pairwise([poses[0], *poses]):
        increment = between_one(before, pose) + np.array([0.0, 0.0, true * chance.standard_normal()])
        odometry.push(see(hall, pose, chance), increment, NOISE, 1.0 / 3.0)
    # Held against a third less than stated, for these scans were taken in no time and their contours know the rest.
    expected = true**2 / (NOISE[2, 2] * 2.0 / 3.0)
    assert odometry.turn_excess == pytest.approx(expected, rel=0.6)
    assert odometry.blur == pytest.approx(odometry.turn_excess * NOISE[2, 2] / 3.0)
