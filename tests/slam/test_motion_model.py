"""Prediction (eqs 23-24, 28) against the printed equation, finite differences, dense NumPy and Monte Carlo."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import MotionConfig
from contourslam.geometry.angles import wrap
from contourslam.geometry.motion import unicycle_step
from contourslam.geometry.poses import between, compose
from contourslam.slam.ekf import symmetric
from contourslam.slam.motion import motion_noise, predict

Floats = NDArray[np.float64]

metres = st.floats(-20.0, 20.0)
headings = st.one_of(st.floats(-math.pi, math.pi), st.sampled_from([math.pi, -math.pi + 1e-9, math.pi - 1e-9, 0.0]))
poses = st.builds(lambda x, y, t: np.array([x, y, t]), metres, metres, headings)
increments = st.builds(
    lambda x, y, t: np.array([x, y, t]), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5), st.floats(-1.5, 1.5)
)


def pose_jacobian(pose: Floats, increment: Floats) -> Floats:
    """Jacobian of the pose after the increment by the pose before, by central differences."""
    step = 1e-6
    columns = []
    for k in range(3):
        ahead, behind = (compose(pose + sign * step * np.eye(3)[k], increment) for sign in (1.0, -1.0))
        difference = ahead - behind
        difference[2] = wrap(difference[2])
        columns.append(difference / (2.0 * step))
    return np.stack(columns, axis=1)


@given(pose=poses, v=st.floats(-2.0, 2.0), omega=st.floats(-3.0, 3.0), dt=st.floats(0.0, 0.5))
def test_the_increment_of_eq_28_moves_the_pose_as_eq_28_is_printed(
    pose: Floats, v: float, omega: float, dt: float
) -> None:
    increment = np.array([v * dt * math.cos(omega * dt), v * dt * math.sin(omega * dt), omega * dt])
    mean = pose.copy()
    predict(mean, np.eye(3), 3, increment, np.eye(3), pose)
    expected = unicycle_step(pose, v, omega, dt)
    np.testing.assert_allclose(mean[:2], expected[:2], atol=1e-12)
    assert abs(wrap(mean[2] - expected[2])) < 1e-12
    assert -math.pi <= mean[2] <= math.pi


@given(pose=poses, increment=increments)
def test_the_predicted_mean_is_the_composition_of_pose_and_increment(pose: Floats, increment: Floats) -> None:
    mean = pose.copy()
    predict(mean, np.eye(3), 3, increment, np.eye(3), pose)
    expected = compose(pose, increment)
    np.testing.assert_allclose(mean[:2], expected[:2], atol=1e-12)
    assert abs(wrap(mean[2] - expected[2])) < 1e-12


@given(pose=poses, increment=increments, correction=increments, first_estimates=st.booleans())
def test_the_covariance_becomes_that_of_eq_24_with_all_cross_covariances(
    random_covariance: Callable[..., Floats],
    pose: Floats,
    increment: Floats,
    correction: Floats,
    first_estimates: bool,
) -> None:
    rng = np.random.default_rng(3)
    size = 11
    before = random_covariance(size, rng)
    noise = np.diag([1e-3, 4e-4, 2e-3])
    # With first estimates the Jacobian starts where the last prediction ended, before a correction moved the mean.
    linearised_at = compose(pose, 0.1 * correction) if first_estimates else pose
    mean = np.concatenate([pose, np.zeros(8)])
    covariance = np.tril(before) + np.triu(np.full((size, size), np.nan), 1)
    predict(mean, covariance, size, increment, noise, linearised_at)
    G = np.eye(size)
    # The motion that leads from where it is linearised to the predicted pose.
    carried = between(np.array([*linearised_at[:2], pose[2]]), mean[:3])
    G[:3, :3] = pose_jacobian(np.array([*linearised_at[:2], pose[2]]), carried)
    turn = np.eye(size)[:, :3]
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    turn[:2, :2] = [[cos, -sin], [sin, cos]]
    expected = G @ before @ G.T + turn @ noise @ turn.T
    np.testing.assert_allclose(symmetric(covariance, size), expected, atol=1e-8)
    assert np.isnan(covariance[np.triu_indices(size, 1)]).all()  # only the lower triangle is touched


def test_first_estimate_jacobians_of_successive_steps_multiply_to_that_of_the_whole_way() -> None:
    # This is what keeps the heading unobservable: corrections in between must not leave a trace in the product.
    rng = np.random.default_rng(0)
    mean, start = np.array([1.0, 2.0, 0.5]), np.array([1.0, 2.0, 0.5])
    linearised_at = mean.copy()
    covariance = np.diag([0.0, 0.0, 1.0])  # only the heading is in doubt, so column 2 shows what it does to x and y
    for _ in range(20):
        predict(mean, covariance, 3, rng.normal(size=3) * [0.3, 0.1, 0.2], np.zeros((3, 3)), linearised_at)
        linearised_at = mean.copy()
        mean += rng.normal(size=3) * [0.05, 0.05, 0.02]  # a correction
    np.testing.assert_allclose(
        covariance[2], [-(linearised_at[1] - start[1]), linearised_at[0] - start[0], 1.0], atol=1e-12
    )


@pytest.mark.parametrize("increment", [(2.0, 0.0, 0.0), (-1.5, 0.0, 0.0), (0.0, 0.0, 1.2), (0.0, 0.0, -0.7)])
def test_noise_adds_up_alike_over_short_and_long_steps(increment: tuple[float, float, float]) -> None:
    config = MotionConfig()
    whole = motion_noise(np.array(increment), config)
    parts = sum(motion_noise(np.array(increment) / 50, config) for _ in range(50))
    np.testing.assert_allclose(parts, whole, rtol=1e-5, atol=1e-8)


def test_noise_after_one_metre_and_one_radian_is_what_the_configuration_says() -> None:
    config = MotionConfig(0.02, 1.5, 2.5, 0.01)
    sigma = np.sqrt(np.diag(motion_noise(np.array([1.0, 0.0, 0.0]), config)))
    np.testing.assert_allclose(sigma, [0.02, 0.01, math.radians(1.5)], rtol=1e-4)
    turning = motion_noise(np.array([0.0, 0.0, -1.0]), config)
    assert math.sqrt(turning[2, 2]) == pytest.approx(math.radians(2.5), rel=1e-4)


def test_a_standing_robot_keeps_a_positive_definite_covariance() -> None:
    covariance, mean = np.zeros((3, 3)), np.zeros(3)
    predict(mean, covariance, 3, np.zeros(3), motion_noise(np.zeros(3), MotionConfig()), np.zeros(3))
    assert np.linalg.eigvalsh(symmetric(covariance, 3)).min() > 0.0


def test_the_predicted_covariance_is_that_of_sampled_motions() -> None:
    rng = np.random.default_rng(5)
    pose, increment = np.array([3.0, -1.0, 2.9]), np.array([0.8, 0.1, 0.6])
    root = np.array([[0.02, 0.0, 0.0], [0.01, 0.015, 0.0], [0.005, -0.004, 0.01]])
    noise = np.diag([0.02, 0.01, 0.015]) ** 2
    n = 200_000
    starts = pose + rng.normal(size=(n, 3)) @ root.T
    moved = compose(starts, increment + rng.normal(size=(n, 3)) * np.sqrt(np.diag(noise)))
    mean, covariance = pose.copy(), root @ root.T
    predict(mean, covariance, 3, increment, noise, pose)
    errors = moved - mean
    errors[:, 2] = wrap(errors[:, 2])
    sampled = np.cov(errors.T)
    scale = np.sqrt(np.outer(np.diag(sampled), np.diag(sampled)))
    np.testing.assert_allclose(symmetric(covariance, 3) / scale, sampled / scale, atol=0.012)
