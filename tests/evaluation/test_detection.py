from dataclasses import replace

import numpy as np
import pytest

from contourslam.evaluation.detection import DetectedCorners, match_corners, score_detections
from contourslam.evaluation.visibility import visible_corners
from contourslam.geometry.poses import inverse, transform

TURN = np.linspace(-np.pi, np.pi, 720, endpoint=False)
POSES = np.array([[-1.0, 1.0, 0.3], [-1.2, 0.8, 2.0], [-1.5, 0.5, -3.0]])


def _detect(room, pose, which, noise=0.0, raw=0.0, rng=None):
    """What a detector with the given noise returns for some of the true corners."""
    rng = rng or np.random.default_rng(0)
    local = transform(inverse(pose), room.positions[which])
    return DetectedCorners(
        local + rng.normal(0.0, noise, local.shape) if noise else local,
        room.directions[which] - pose[2],
        room.convex[which],
        local + rng.normal(0.0, raw, local.shape) if raw else None,
    )


def _perfect(room):
    return [_detect(room, pose, visible_corners(room, pose, TURN)) for pose in POSES]


def test_a_perfect_detector_scores_one(square_room):
    score = score_detections(_perfect(square_room), POSES, square_room, TURN)
    assert (score.precision, score.recall, score.repeatability) == (1.0, 1.0, 1.0)
    assert score.rms_error == pytest.approx(0.0, abs=1e-12)
    assert score.visible.min() >= 3
    np.testing.assert_array_equal(score.detected, score.visible)


def test_false_corners_cost_precision_and_missed_ones_recall(square_room):
    scans = _perfect(square_room)
    false = DetectedCorners(np.array([[0.4, 0.3]]), np.zeros(1), np.array([False]))
    first = scans[0]
    scans[0] = DetectedCorners(
        np.concatenate([first.positions, false.positions]),
        np.concatenate([first.directions, false.directions]),
        np.concatenate([first.convex, false.convex]),
    )
    last = scans[2]
    scans[2] = DetectedCorners(last.positions[1:], last.directions[1:], last.convex[1:])
    score = score_detections(scans, POSES, square_room, TURN)
    total = int(score.visible.sum())
    assert score.precision == pytest.approx((total - 1) / total)
    assert score.recall == pytest.approx((total - 1) / total)
    both = [visible_corners(square_room, pose, TURN) for pose in POSES]
    chances = int((both[0] & both[1]).sum() + (both[1] & both[2]).sum())
    assert score.repeatable == chances
    assert score.repeated == chances - 1


def test_a_detector_that_sees_a_corner_every_other_scan_repeats_nothing(square_room):
    scans = _perfect(square_room)
    scans[1] = DetectedCorners(np.empty((0, 2)), np.empty(0), np.empty(0, dtype=bool))
    score = score_detections(scans, POSES, square_room, TURN)
    assert score.repeatability == 0.0
    assert score.precision == 1.0


def test_the_localisation_error_is_the_detectors_noise(square_room):
    rng = np.random.default_rng(9)
    poses = np.tile(POSES, (200, 1))
    scans = [_detect(square_room, p, visible_corners(square_room, p, TURN), 0.01, 0.03, rng) for p in poses]
    score = score_detections(scans, poses, square_room, TURN)
    assert score.rms_error == pytest.approx(0.01 * np.sqrt(2), rel=0.05)
    assert score.mean_error == pytest.approx(0.01 * np.sqrt(np.pi / 2), rel=0.05)
    assert score.raw_rms_error == pytest.approx(0.03 * np.sqrt(2), rel=0.05)
    assert score.raw_mean_error > score.mean_error


def test_a_corner_matches_one_detection_only(square_room):
    two = _detect(square_room, POSES[0], np.array([0, 0]))
    two = replace(two, positions=two.positions + np.array([[0.1, 0.0], [0.01, 0.0]]))
    rows, columns = match_corners(two, POSES[0], square_room)
    assert rows.tolist() == [1]
    assert columns.tolist() == [0]


def test_as_many_pairs_as_possible_come_before_short_distances(square_room):
    room = replace(square_room, positions=np.array([[0.0, 0.0], [0.15, 0.0], *[[9.0, 9.0 + i] for i in range(6)]]))
    room = replace(room, directions=np.zeros(8), convex=np.zeros(8, dtype=bool))
    # The first corner could take either detection; the second only the one the first is closest to.
    found = DetectedCorners(np.array([[0.01, 0.0], [-0.19, 0.0]]), np.zeros(2), np.zeros(2, dtype=bool))
    rows, columns = match_corners(found, np.zeros(3), room)
    assert dict(zip(rows.tolist(), columns.tolist(), strict=True)) == {0: 1, 1: 0}


@pytest.mark.parametrize("change", ["far", "turned", "other kind"])
def test_a_corner_elsewhere_turned_or_of_the_other_kind_is_no_match(square_room, change):
    found = _detect(square_room, POSES[0], np.array([0]))
    if change == "far":
        found = replace(found, positions=found.positions + 0.2)
    elif change == "turned":
        found = replace(found, directions=found.directions + np.radians(31))
    else:
        found = replace(found, convex=~found.convex)
    assert len(match_corners(found, POSES[0], square_room)[0]) == 0


def test_a_bisector_across_the_cut_still_matches(square_room):
    found = _detect(square_room, POSES[0], np.array([0]))
    found = replace(found, directions=found.directions + 2 * np.pi)
    assert len(match_corners(found, POSES[0], square_room)[0]) == 1


def test_without_scans_there_is_no_score(square_room):
    score = score_detections([], np.empty((0, 3)), square_room, TURN)
    for value in (score.precision, score.recall, score.repeatability, score.mean_error, score.raw_rms_error):
        assert np.isnan(value)


def test_beams_may_change_from_scan_to_scan(square_room):
    half = np.linspace(-np.pi / 2, np.pi / 2, 361)
    score = score_detections(_perfect(square_room), POSES, square_room, [TURN, half, TURN])
    assert score.visible[1] < score_detections(_perfect(square_room), POSES, square_room, TURN).visible[1]


def test_counts_that_disagree_are_refused(square_room):
    with pytest.raises(ValueError, match="3 scans, 2 poses"):
        score_detections(_perfect(square_room), POSES[:2], square_room, TURN)
