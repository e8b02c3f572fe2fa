from dataclasses import replace

import numpy as np
import pytest

from contourslam.config import MotionConfig
from contourslam.evaluation.cramer_rao import (
    ScanModel,
    cramer_rao_bound,
    odometry_covariances,
    range_jacobian,
    scan_information,
)
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import compose

ANGLES = np.linspace(-np.pi, np.pi, 90, endpoint=False)
MOUNTED = ScanModel(ANGLES, sigma_range=0.01, mount=(0.2, -0.1, 0.5))
COLUMN = np.array([[-1.5, 0.5, 0.3]])
POSE = np.array([0.3, 0.6, 2.9])


def test_the_range_jacobian_agrees_with_finite_differences(square_room):
    ranges, jacobian = range_jacobian(square_room.segments, COLUMN, POSE, MOUNTED)
    step = 1e-6
    for k in range(3):
        ahead, _ = range_jacobian(square_room.segments, COLUMN, POSE + step * np.eye(3)[k], MOUNTED)
        behind, _ = range_jacobian(square_room.segments, COLUMN, POSE - step * np.eye(3)[k], MOUNTED)
        used = jacobian.any(axis=1)
        np.testing.assert_allclose(jacobian[used, k], ((ahead - behind) / (2 * step))[used], rtol=1e-4, atol=1e-5)
    assert np.isfinite(ranges).all()
    assert used.sum() > 80


def test_beams_without_a_return_and_grazing_ones_tell_nothing(square_room):
    model = replace(MOUNTED, max_range=2.0, min_incidence_deg=30.0)
    ranges, jacobian = range_jacobian(square_room.segments, COLUMN, POSE, model)
    assert np.isinf(ranges).any()
    assert not jacobian[np.isinf(ranges)].any()
    sine = 1.0 / np.hypot(jacobian[:, 0], jacobian[:, 1])[jacobian.any(axis=1)]
    assert sine.min() >= 0.5 - 1e-12
    every = range_jacobian(square_room.segments, COLUMN, POSE, replace(MOUNTED, min_incidence_deg=0.0))[1]
    assert every.any(axis=1).all()


def _most_likely(room, measured, start, model):
    """Maximum-likelihood pose by Gauss-Newton."""
    pose = start.copy()
    for _ in range(5):
        ranges, jacobian = range_jacobian(room.segments, COLUMN, pose, model)
        # A beam that changes surface between the poses is no measurement of the model's.
        residual = np.where(np.abs(measured - ranges) < 0.2, measured - ranges, 0.0)
        pose = pose + np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    return pose


def test_most_likely_localisation_attains_the_bound(square_room):
    rng = np.random.default_rng(10)
    true_ranges, _ = range_jacobian(square_room.segments, COLUMN, POSE, MOUNTED)
    noise = rng.normal(0.0, 0.01, (500, len(ANGLES)))
    found = np.array([_most_likely(square_room, true_ranges + e, POSE, MOUNTED) for e in noise])
    errors = found - POSE
    errors[:, 2] = wrap(errors[:, 2])
    bound = cramer_rao_bound(square_room.segments, COLUMN, POSE[None], MOUNTED)
    np.testing.assert_allclose(np.sqrt(np.mean(errors**2, axis=0)), bound.scan_sd[0], rtol=0.15)


def test_the_bound_follows_the_noise_and_the_number_of_beams(square_room):
    def sd(**changes):
        model = replace(MOUNTED, **changes)
        return cramer_rao_bound(square_room.segments, COLUMN, POSE[None], model).scan_sd[0]

    np.testing.assert_allclose(sd(sigma_range=0.03), 3 * sd(), rtol=1e-9)
    np.testing.assert_allclose(sd(sigma_range=np.full(len(ANGLES), 0.02)), 2 * sd(), rtol=1e-9)
    dense = sd(angles=np.linspace(-np.pi, np.pi, 360, endpoint=False))
    np.testing.assert_allclose(dense, 0.5 * sd(), rtol=0.15)


def test_a_straight_corridor_leaves_the_way_along_it_open():
    walls = np.array([[[-100.0, 1.0], [100.0, 1.0]], [[100.0, -1.0], [-100.0, -1.0]]])
    poses = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]])
    bound = cramer_rao_bound(walls, np.empty((0, 3)), poses, ScanModel(ANGLES))
    assert np.isinf(bound.scan_sd).all()
    assert np.isinf(bound.filtered_sd).all()
    known = cramer_rao_bound(walls, np.empty((0, 3)), poses, ScanModel(ANGLES), initial_covariance=np.zeros((3, 3)))
    x, y, theta = known.filtered_sd[1]
    assert x == pytest.approx(MotionConfig().forward_per_sqrt_m * np.sqrt(0.5), rel=0.01)  # the wheels' alone
    assert y < 0.002
    assert theta < np.radians(0.2)


def test_scans_of_a_standing_robot_add_up(square_room):
    poses = np.tile(POSE, (16, 1))
    bound = cramer_rao_bound(square_room.segments, COLUMN, poses, MOUNTED)
    np.testing.assert_allclose(bound.filtered_sd[0], bound.scan_sd[0], rtol=1e-9)
    np.testing.assert_allclose(bound.filtered_sd[15], bound.scan_sd[15] / 4, rtol=0.02)
    np.testing.assert_allclose(bound.filtered_rms, np.sqrt(np.mean(bound.filtered_sd**2, axis=0)))
    assert (bound.filtered_rms < bound.scan_rms).all()


def test_the_filtered_bound_is_the_recursion_of_information_matrices(square_room):
    poses = np.array([[0.0, 0.5, 0.0], [0.3, 0.5, 0.2], [0.6, 0.7, 0.9]])
    noise = odometry_covariances(poses, MotionConfig())
    bound = cramer_rao_bound(square_room.segments, COLUMN, poses, MOUNTED)
    information = scan_information(square_room.segments, COLUMN, poses[0], MOUNTED)
    for t in (1, 2):
        dx, dy = (poses[t] - poses[t - 1])[:2]
        F = np.array([[1, 0, -dy], [0, 1, dx], [0, 0, 1.0]])
        information = np.linalg.inv(noise[t - 1] + F @ np.linalg.inv(information) @ F.T)
        information += scan_information(square_room.segments, COLUMN, poses[t], MOUNTED)
        np.testing.assert_allclose(bound.filtered_sd[t], np.sqrt(np.diag(np.linalg.inv(information))), rtol=1e-7)


def test_odometry_noise_lies_along_the_heading():
    motion = MotionConfig()
    poses = np.array([[0.0, 0.0, np.pi / 2], [0.0, 4.0, np.pi / 2]])
    covariance = odometry_covariances(poses, motion)[0]
    assert covariance[1, 1] == pytest.approx(4 * motion.forward_per_sqrt_m**2, rel=1e-3)
    assert covariance[0, 0] == pytest.approx(4 * motion.lateral_per_sqrt_m**2, rel=1e-3)
    assert covariance[0, 1] == pytest.approx(0.0, abs=1e-12)
    turned = odometry_covariances(compose(np.array([1.0, 2.0, -np.pi / 4]), poses), motion)[0]
    np.testing.assert_allclose(np.linalg.eigvalsh(turned), np.linalg.eigvalsh(covariance), rtol=1e-9)
    assert turned[0, 1] > 0
