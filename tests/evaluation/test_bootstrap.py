import numpy as np
import pytest

from contourslam.evaluation.bootstrap import paired_difference


def drive(rng: np.random.Generator, n: int, memory: float, mean: float) -> np.ndarray:
    """Differences of which each resembles the one before it, of unit variance."""
    values = np.empty(n)
    values[0] = rng.standard_normal()
    noise = np.sqrt(1.0 - memory**2) * rng.standard_normal(n)
    for i in range(1, n):
        values[i] = memory * values[i - 1] + noise[i]
    return mean + values


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_the_interval_holds_the_true_difference_nineteen_times_out_of_twenty(memory: float) -> None:
    rng = np.random.default_rng(3)
    found = [
        paired_difference(drive(rng, 900, memory, 0.3), np.zeros(900), draws=300, seed=seed) for seed in range(200)
    ]
    inside = np.mean([one.low <= 0.3 <= one.high for one in found])
    assert 0.87 <= inside <= 0.99  # blocks end somewhere, so a little fewer than 0.95 are to be expected


def test_single_draws_would_be_too_sure_where_neighbours_are_alike() -> None:
    alike = drive(np.random.default_rng(1), 2500, 0.9, 0.0)
    mixed = np.random.default_rng(2).permutation(alike)
    wide, narrow = (paired_difference(values, np.zeros(2500)) for values in (alike, mixed))
    assert wide.high - wide.low > 2.0 * (narrow.high - narrow.low)


def test_the_same_seed_gives_the_same_interval_and_turning_round_the_opposite_one() -> None:
    rng = np.random.default_rng(4)
    a, b = rng.exponential(0.02, (2, 400))
    once, again, turned = paired_difference(a, b), paired_difference(a, b), paired_difference(b, a)
    assert once == again
    assert turned.mean == pytest.approx(-once.mean)
    assert turned.low == pytest.approx(-once.high)
    assert turned.share == pytest.approx(1.0 - once.share)


def test_a_run_does_not_differ_from_itself() -> None:
    errors = np.random.default_rng(5).exponential(0.02, 100)
    same = paired_difference(errors, errors)
    assert (same.mean, same.low, same.high, same.share) == (0.0, 0.0, 0.0, 0.5)


@pytest.mark.parametrize("pairs", [1, 4, 99])
def test_too_few_pairs_give_no_interval(pairs: int) -> None:
    found = paired_difference(np.zeros(pairs), np.ones(pairs))
    assert (found.count, found.mean, found.share) == (pairs, -1.0, 1.0)
    assert np.isnan([found.low, found.high]).all()
    assert np.isfinite(paired_difference(np.zeros(100), np.ones(100)).low)


def test_what_is_not_known_is_left_out_and_nothing_gives_nothing() -> None:
    errors = np.array([np.nan, 1.0, 2.0])
    found = paired_difference(errors, np.array([1.0, np.nan, 1.0]))
    assert (found.count, found.mean, found.share) == (1, 1.0, 0.0)
    assert np.isnan(paired_difference(np.zeros(0), np.zeros(0)).mean)
    with pytest.raises(ValueError, match="pairs"):
        paired_difference(np.zeros(2), np.zeros(3))
