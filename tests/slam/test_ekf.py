"""The sparse filter (eqs 25-27) against dense NumPy in Joseph's form, and its growing and shrinking state."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import MotionConfig
from contourslam.slam.ekf import (
    augment,
    cholesky,
    correct,
    covariance_block,
    covariance_columns,
    landmark_columns,
    remove,
    stack,
    symmetric,
)
from contourslam.slam.measurement import CORNER, WALL, innovation
from contourslam.slam.motion import motion_noise, predict

Floats = NDArray[np.float64]
Covariance = Callable[..., Floats]

seeds = st.integers(0, 2**32 - 1)


def lower_only(covariance: Floats, room: int = 4) -> Floats:
    """Lower triangle in a larger array, NaN everywhere a filter must not look."""
    n = len(covariance)
    out = np.full((n + room, n + room), np.nan)
    out[:n, :n] = np.where(np.tri(n) > 0, covariance, np.nan)
    return out


def joseph(mean: Floats, P: Floats, H: Floats, nu: Floats, Q: Floats) -> tuple[Floats, Floats, float]:
    """Correction as the books have it, with every matrix written out."""
    S = H @ P @ H.T + Q
    K = P @ H.T @ np.linalg.inv(S)
    left = np.eye(len(P)) - K @ H
    return mean + K @ nu, left @ P @ left.T + K @ Q @ K.T, float(nu @ np.linalg.solve(S, nu))


@given(seed=seeds, landmarks=st.integers(1, 12), seen=st.integers(1, 6))
def test_the_correction_equals_the_dense_joseph_form(
    random_covariance: Covariance, seed: int, landmarks: int, seen: int
) -> None:
    rng = np.random.default_rng(seed)
    size, seen = 3 + 2 * landmarks, min(seen, landmarks)
    P = random_covariance(size, rng)
    mean = rng.normal(size=size)
    chosen = rng.permutation(landmarks)[:seen]  # in any order
    columns = landmark_columns(chosen)
    jacobian = np.zeros((2 * seen, 3 + 2 * seen))
    jacobian[:, :3] = rng.normal(size=(2 * seen, 3))
    for k in range(seen):
        jacobian[2 * k : 2 * k + 2, 3 + 2 * k : 5 + 2 * k] = rng.normal(size=(2, 2))
    Q = random_covariance(2 * seen, rng, 0.02)
    nu = rng.normal(size=2 * seen) * 0.1
    H = np.zeros((2 * seen, size))
    H[:, columns] = jacobian
    expected_mean, expected_P, expected_nis = joseph(mean, P, H, nu, Q)
    state, covariance = np.concatenate([mean, np.full(4, np.nan)]), lower_only(P)
    nis = correct(state, covariance, size, columns, jacobian, nu, Q)
    expected_mean[2] = math.remainder(expected_mean[2], 2.0 * math.pi)
    np.testing.assert_allclose(state[:size], expected_mean, atol=1e-9)
    np.testing.assert_allclose(symmetric(covariance, size), expected_P, atol=1e-9)
    assert nis == pytest.approx(expected_nis, rel=1e-9)
    assert np.isnan(covariance[np.triu_indices(size + 4, 1)]).all()  # the upper triangle and the spare room stay alone


@pytest.mark.parametrize("heading", [3.14, -3.14])
def test_the_heading_stays_wrapped_after_a_correction(heading: float) -> None:
    mean, covariance = np.array([0.0, 0.0, heading]), np.eye(3)
    nu = np.array([math.copysign(0.1, heading)])
    correct(mean, covariance, 3, np.array([2]), np.eye(1), nu, np.eye(1) * 1e-6)
    assert mean[2] == pytest.approx(heading + nu[0] - math.copysign(2.0 * math.pi, heading), abs=1e-6)


@pytest.mark.parametrize("bad", [-1.0, math.nan])
def test_an_innovation_covariance_that_is_none_changes_nothing(random_covariance: Covariance, bad: float) -> None:
    P = random_covariance(5, np.random.default_rng(0))
    mean, covariance = np.arange(5.0), lower_only(P)
    noise = np.diag([1e-4, bad])
    nis = correct(mean, covariance, 5, np.arange(5), np.ones((2, 5)), np.ones(2), noise)
    assert nis == -1.0
    np.testing.assert_array_equal(mean, np.arange(5.0))
    np.testing.assert_array_equal(symmetric(covariance, 5), P)


def test_ten_thousand_random_steps_keep_the_covariance_positive_definite(random_covariance: Covariance) -> None:
    rng = np.random.default_rng(8)
    landmarks = 12
    size = 3 + 2 * landmarks
    mean, covariance = rng.normal(size=size), lower_only(np.diag(np.full(size, 1e-10)) + random_covariance(size, rng))
    config = MotionConfig()
    for step in range(10_000):
        increment = rng.normal(size=3) * [0.1, 0.0, 0.1] * (rng.random() < 0.8)
        predict(mean, covariance, size, increment, motion_noise(increment, config), mean[:3].copy())
        m = int(rng.integers(1, 6))
        columns = landmark_columns(rng.permutation(landmarks)[:m])
        jacobian = np.zeros((2 * m, 3 + 2 * m))
        jacobian[:, :3] = rng.normal(size=(2 * m, 3))
        jacobian[:, 3:] = np.eye(2 * m)
        sigma = 10.0 ** rng.uniform(-4.0, -1.0)
        nu = rng.normal(size=2 * m) * sigma
        assert correct(mean, covariance, size, columns, jacobian, nu, np.eye(2 * m) * sigma**2) >= 0.0
        if step % 250 == 249:
            eigenvalues = np.linalg.eigvalsh(symmetric(covariance, size))
            assert eigenvalues.min() > 0.0, f"step {step}: {eigenvalues.min()}"
    assert np.isfinite(mean).all()


def jacobians(rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    noise = rng.normal(size=(2, 2)) * 0.02
    return rng.normal(size=(2, 3)), rng.normal(size=(2, 2)), noise @ noise.T + np.eye(2) * 1e-5


@given(seed=seeds, landmarks=st.integers(0, 6))
def test_a_new_landmark_gets_its_full_cross_covariance(
    random_covariance: Covariance, seed: int, landmarks: int
) -> None:
    rng = np.random.default_rng(seed)
    size = 3 + 2 * landmarks
    P = random_covariance(size, rng)
    by_pose, by_measurement, Q = jacobians(rng)
    mean, covariance = np.arange(size + 4, dtype=float), lower_only(P)
    augment(mean, covariance, size, 7.0, 8.0, by_pose, by_measurement, Q)
    J = np.zeros((2, size))
    J[:, :3] = by_pose
    expected = np.block([[P, P @ J.T], [J @ P, J @ P @ J.T + by_measurement @ Q @ by_measurement.T]])
    np.testing.assert_allclose(symmetric(covariance, size + 2), expected, atol=1e-12)
    np.testing.assert_array_equal(mean[: size + 2], [*range(size), 7.0, 8.0])
    assert np.linalg.eigvalsh(expected).min() > 0.0


@given(seed=seeds, landmarks=st.integers(1, 7), data=st.data())
def test_removing_a_landmark_deletes_its_rows_and_columns(
    random_covariance: Covariance, seed: int, landmarks: int, data: st.DataObject
) -> None:
    size = 3 + 2 * landmarks
    P = random_covariance(size, np.random.default_rng(seed))
    at = 3 + 2 * data.draw(st.integers(0, landmarks - 1))
    mean, covariance = np.arange(float(size)), lower_only(P)
    remove(mean, covariance, size, at)
    np.testing.assert_array_equal(mean[: size - 2], np.delete(np.arange(float(size)), [at, at + 1]))
    left = np.delete(np.delete(P, [at, at + 1], 0), [at, at + 1], 1)
    np.testing.assert_array_equal(symmetric(covariance, size - 2), left)


@given(seed=seeds, count=st.integers(1, 9))
def test_columns_and_blocks_read_the_whole_covariance_from_its_lower_triangle(
    random_covariance: Covariance, seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    P = random_covariance(17, rng)
    covariance, chosen = lower_only(P), rng.integers(0, 17, count)
    np.testing.assert_array_equal(covariance_columns(covariance, 17, chosen), P[chosen])
    np.testing.assert_array_equal(covariance_block(covariance, chosen), P[np.ix_(chosen, chosen)])
    np.testing.assert_array_equal(symmetric(covariance, 17), P)


def test_the_pose_and_each_landmark_have_their_columns() -> None:
    np.testing.assert_array_equal(landmark_columns(np.array([2, 0])), [0, 1, 2, 7, 8, 3, 4])


@given(seed=seeds, n=st.integers(1, 12))
def test_the_cholesky_factor_is_that_of_numpy(random_covariance: Covariance, seed: int, n: int) -> None:
    matrix = random_covariance(n, np.random.default_rng(seed))
    np.testing.assert_allclose(cholesky(matrix), np.linalg.cholesky(matrix), rtol=1e-9, atol=1e-12)
    matrix[n // 2, n // 2] = -1.0
    assert cholesky(matrix)[n - 1, n - 1] == -1.0


def test_stacked_observations_keep_their_order_and_wrap_their_angles(random_covariance: Covariance) -> None:
    rng = np.random.default_rng(2)
    table = np.zeros((3, 10))
    table[:, 0] = [CORNER, WALL, CORNER]
    values, expected = rng.normal(size=(4, 2)) * 4.0, rng.normal(size=(3, 2)) * 4.0
    noises = np.stack([random_covariance(2, rng) for _ in range(4)])
    by_pose, by_landmark = rng.normal(size=(3, 2, 3)), rng.normal(size=(3, 2, 2))
    rows, landmarks = np.array([3, 1]), np.array([1, 2])
    jacobian, nu, noise = stack(rows, landmarks, values, noises, table, expected, by_pose, by_landmark)
    H = np.zeros((4, 9))
    H[:, landmark_columns(landmarks)] = jacobian
    for k, (i, j) in enumerate(zip(rows, landmarks, strict=True)):
        whole = np.zeros((2, 9))
        whole[:, :3], whole[:, 3 + 2 * j : 5 + 2 * j] = by_pose[j], by_landmark[j]
        np.testing.assert_array_equal(H[2 * k : 2 * k + 2], whole)
        np.testing.assert_array_equal(nu[2 * k : 2 * k + 2], innovation(table[j, 0], values[i], expected[j]))
        np.testing.assert_array_equal(noise[2 * k : 2 * k + 2, 2 * k : 2 * k + 2], noises[i])
    assert not noise[:2, 2:].any()
