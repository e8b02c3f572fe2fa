import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.poses import compose_one
from contourslam.matching.small import invert, moved, solve, turned

SEEDS = st.integers(0, 10_000)


def definite(seed: int, spread: float = 3.0) -> NDArray[np.float64]:
    """A random symmetric positive definite matrix whose rows may differ in size by many orders."""
    chance = np.random.default_rng(seed)
    root, scale = chance.standard_normal((3, 3)) + 2.0 * np.eye(3), np.diag(10.0 ** chance.uniform(-spread, spread, 3))
    return scale @ (root @ root.T + 0.1 * np.eye(3)) @ scale


def rotation(angle: float) -> NDArray[np.float64]:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@given(SEEDS)
def test_the_inverse_and_the_solution_are_numpys(seed: int) -> None:
    matrix, vector = definite(seed), np.random.default_rng(seed).standard_normal(3)
    size = np.sqrt(np.diag(matrix))
    unit = np.outer(size, size)
    np.testing.assert_allclose(invert(matrix) * unit, np.linalg.inv(matrix / unit), rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(solve(matrix, vector) * size, np.linalg.solve(matrix / unit, vector / size), rtol=1e-6)


@given(SEEDS, st.floats(-7.0, 7.0))
def test_turning_the_axes_is_a_product_with_rotations(seed: int, angle: float) -> None:
    matrix = definite(seed, 0.0)
    np.testing.assert_allclose(turned(matrix, angle), rotation(angle) @ matrix @ rotation(angle).T, atol=1e-9)
    np.testing.assert_allclose(turned(turned(matrix, angle), -angle), matrix, atol=1e-9)


def test_the_covariance_after_a_step_is_that_of_many_steps_drawn_at_random() -> None:
    chance, pose, step = np.random.default_rng(1), np.array([1.0, -2.0, 0.7]), np.array([0.5, 0.1, 0.3])
    before, noise = 1e-4 * definite(1, 0.0), 1e-4 * definite(2, 0.0)
    end, covariance = moved(pose, before, step, noise)
    np.testing.assert_allclose(end, compose_one(pose, step))
    starts = pose + chance.multivariate_normal(np.zeros(3), before, 20_000)
    steps = step + chance.multivariate_normal(np.zeros(3), noise, 20_000)
    ends = np.array([compose_one(a, b) for a, b in zip(starts, steps, strict=True)])
    spread = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert (np.abs(np.cov((ends - end).T) - covariance) < 0.05 * spread).all()
