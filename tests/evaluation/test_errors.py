import numpy as np
import pytest

from contourslam.evaluation.errors import fit, pose_errors, rmse
from contourslam.geometry.poses import compose


def test_the_rmse_of_a_constant_error_is_that_error(circle_drive):
    truth = circle_drive()
    found = rmse(truth + np.array([0.03, -0.04, 0.0]), truth)
    assert (found.x, found.y, found.theta) == pytest.approx((0.03, 0.04, 0.0))


def test_a_heading_error_across_the_cut_is_small():
    errors = pose_errors(np.array([[0.0, 0.0, -np.pi + 0.01]]), np.array([[0.0, 0.0, np.pi - 0.01]]))
    assert errors[0, 2] == pytest.approx(0.02)


def test_alignment_at_the_first_pose_undoes_a_rigid_motion(circle_drive):
    truth = circle_drive()
    moved = compose(np.array([4.0, -2.0, 2.5]), truth)
    assert np.abs(pose_errors(moved, truth)).max() > 1.0
    np.testing.assert_allclose(pose_errors(moved, truth, aligned=True), 0.0, atol=1e-12)


def test_poses_without_a_known_truth_do_not_count(circle_drive):
    truth = circle_drive()
    poses = truth + np.array([0.03, 0.0, 0.0])
    truth[:5] = np.nan
    poses[7] += 0.0
    assert np.isnan(pose_errors(poses, truth)[:5]).all()
    assert rmse(poses, truth).x == pytest.approx(0.03)
    assert rmse(poses, truth, aligned=True).x == pytest.approx(0.0, abs=1e-12)


def test_without_any_truth_the_rmse_is_unknown():
    assert np.isnan(rmse(np.zeros((4, 3)), np.full((4, 3), np.nan)).x)
    assert np.isnan(rmse(np.empty((0, 3)), np.empty((0, 3))).theta)


def test_trajectories_of_different_length_are_refused():
    with pytest.raises(ValueError, match=r"\(4, 3\).*\(5, 3\)"):
        pose_errors(np.zeros((4, 3)), np.zeros((5, 3)))


def test_the_rigid_motion_that_fits_best_is_found():
    rng = np.random.default_rng(0)
    points, motion = rng.normal(size=(50, 2)), np.array([3.0, -2.0, 2.5])
    moved = compose(motion, np.column_stack([points, np.zeros(50)]))
    np.testing.assert_allclose(fit(points, moved[:, :2]), motion, atol=1e-9)
    np.testing.assert_allclose(fit(points[:1], moved[:1, :2])[:2], moved[0, :2] - points[0])
    assert np.isnan(fit(points[:0], points[:0])).all()
