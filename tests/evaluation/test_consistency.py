import numpy as np
import pytest
from scipy.stats import chi2

from contourslam.evaluation.consistency import average_nees, average_nis, chi_square_bounds, inside_sigmas, nees

FACTOR = np.array([[0.02, 0.0, 0.0], [0.01, 0.03, 0.0], [0.001, -0.004, 0.005]])


def _errors(runs: int, steps: int, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    errors = scale * np.random.default_rng(3).standard_normal((runs, steps, 3)) @ FACTOR.T
    return errors, np.tile(FACTOR @ FACTOR.T, (steps, 1, 1))


def _average(runs: int, steps: int, scale: float = 1.0):
    errors, covariances = _errors(runs, steps, scale)
    return average_nees(np.array([nees(run, covariances) for run in errors]))


def test_nees_of_consistent_errors_stays_within_its_bounds():
    found = _average(20, 1000)
    assert found.mean == pytest.approx(3.0, abs=0.1)
    assert found.inside == pytest.approx(0.95, abs=0.03)
    assert (found.runs, found.dof) == (20, 3)


def test_nees_of_doubled_errors_leaves_its_bounds():
    found = _average(20, 1000, scale=2.0)
    assert found.mean == pytest.approx(12.0, abs=0.4)
    assert found.inside < 0.01


def test_nees_of_halved_errors_leaves_its_bounds_below():
    found = _average(20, 1000, scale=0.5)
    assert (found.average < found.lower).mean() > 0.99


def test_nees_is_the_quadratic_form():
    errors, covariances = _errors(1, 50)
    expected = [e @ np.linalg.inv(p) @ e for e, p in zip(errors[0], covariances, strict=True)]
    np.testing.assert_allclose(nees(errors[0], covariances), expected, rtol=1e-9)


@pytest.mark.parametrize(("runs", "low", "high"), [(20, 2.02, 4.16), (50, 2.36, 3.72)])
def test_bounds_are_the_published_ones(runs, low, high):
    lower, upper = chi_square_bounds(3, runs)
    assert (float(lower), float(upper)) == pytest.approx((low, high), abs=0.01)


def test_the_first_pose_known_exactly_is_left_out():
    errors, covariances = _errors(1, 10)
    errors, covariances = errors[0], covariances.copy()
    errors[0], covariances[0] = 0.0, 0.0
    covariances[3] = np.nan
    values = nees(errors, covariances)
    assert np.flatnonzero(np.isnan(values)).tolist() == [0, 3]
    assert np.isfinite(average_nees(values).mean)
    assert np.isfinite(inside_sigmas(errors, covariances)).all()


def test_one_run_with_a_gap_does_not_shift_the_average_of_the_others():
    values = np.full((2, 4), 3.0)
    values[1, 2] = np.nan
    found = average_nees(values)
    np.testing.assert_array_equal(found.average, 3.0)
    assert found.inside == 1.0


def test_the_share_inside_two_sigma_is_the_normal_one():
    errors, covariances = _errors(1, 20_000)
    np.testing.assert_allclose(inside_sigmas(errors[0], covariances), 0.9545, atol=0.005)
    np.testing.assert_allclose(inside_sigmas(errors[0], covariances, sigmas=1.0), 0.6827, atol=0.012)
    np.testing.assert_allclose(inside_sigmas(2 * errors[0], covariances), 0.6827, atol=0.012)


def test_nis_of_mixed_dimensions_averages_to_one():
    rng = np.random.default_rng(4)
    dof = rng.integers(0, 6, 4000) * 2
    values = np.where(dof > 0, rng.chisquare(np.maximum(dof, 1)), 0.0)
    found = average_nis(values, dof)
    assert found.lower < found.mean < found.upper
    assert found.upper - found.lower < 0.1
    assert found.inside == pytest.approx(0.95, abs=0.015)
    assert found.corrections == int((dof > 0).sum())
    doubled = average_nis(2 * values, dof)
    assert doubled.mean > doubled.upper
    assert doubled.inside < 0.85


def test_nis_bounds_of_one_correction_are_its_own():
    found = average_nis(np.array([4.0]), np.array([2]))
    assert found.mean == 2.0
    assert (2 * found.lower, 2 * found.upper) == pytest.approx((chi2.ppf(0.025, 2), chi2.ppf(0.975, 2)))


def test_nothing_matched_gives_no_number():
    found = average_nis(np.zeros(5), np.zeros(5, dtype=np.int64))
    assert np.isnan(found.mean)
    assert found.corrections == 0
    assert np.isnan(average_nees(np.full((2, 3), np.nan)).mean)
    assert np.isnan(inside_sigmas(np.zeros((2, 3)), np.zeros((2, 3, 3)))).all()
