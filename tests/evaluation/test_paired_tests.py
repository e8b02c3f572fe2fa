from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.evaluation.paired_tests import by_seed, holm, judged, mean_interval, signed_rank

stats = pytest.importorskip("scipy.stats")
Floats = NDArray[np.float64]


def table(costs: Floats) -> list[str]:
    """Verdicts over all pairs of detectors, shape (detectors, drives)."""
    tests = [signed_rank(first - second) for first, second in combinations(costs, 2)]
    return [test.verdict for test in judged(tests)]


def drives(rng: np.random.Generator, detectors: int = 5, count: int = 20) -> Floats:
    """Errors of equally good detectors, as skewed as errors are, with what a drive does to all of them."""
    return np.asarray(np.exp(rng.normal(size=count) + 0.3 * rng.normal(size=(detectors, count))))


def test_equal_detectors_are_rarely_told_apart_over_a_whole_table() -> None:
    rng = np.random.default_rng(1)
    wrong = [any("better" in verdict for verdict in table(drives(rng))) for _ in range(500)]
    assert np.mean(wrong) <= 0.05 + 2.33 * np.sqrt(0.05 * 0.95 / len(wrong))


def test_a_single_test_is_wrong_as_often_as_it_says() -> None:
    rng = np.random.default_rng(2)
    p = np.array([signed_rank(np.subtract(*drives(rng, 2))).p for _ in range(2000)])
    for level in (0.01, 0.05, 0.2):
        assert np.mean(p <= level) == pytest.approx(level, abs=3.0 * np.sqrt(level * (1.0 - level) / len(p)))


def test_a_known_effect_is_found_in_twenty_drives() -> None:
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(200):
        costs = drives(rng)
        costs[0] *= 0.7  # against a spread of the ratio of 0.42
        found += table(costs).count("first better") == 4 or table(costs)[0] == "first better"
    assert found / 200 >= 0.5
    alone = [signed_rank(rng.normal(size=20) - 1.0).p <= 0.05 for _ in range(300)]
    assert np.mean(alone) >= 0.97


def test_cells_of_a_drive_are_pooled_for_taken_as_independent_they_mislead() -> None:
    rng = np.random.default_rng(4)
    names = np.repeat(np.arange(20), 9).tolist()
    pooled, apart = [], []
    for _ in range(200):
        first, second = (np.repeat(rng.normal(size=20), 9) + 0.1 * rng.normal(size=180) for _ in range(2))
        pooled.append(signed_rank(by_seed(names, first, second)).p <= 0.05)
        apart.append(signed_rank(first - second).p <= 0.05)
    assert np.mean(pooled) <= 0.05 + 2.33 * np.sqrt(0.05 * 0.95 / len(pooled))
    assert np.mean(apart) > 0.3


@pytest.mark.parametrize(("skew", "least"), [(0.0, 0.90), (0.5, 0.89), (1.0, 0.84)])
def test_an_interval_over_twenty_drives_holds_the_true_mean_about_as_often_as_it_says(skew: float, least: float):
    rng = np.random.default_rng(5)
    held = 0
    for _ in range(400):
        values = rng.normal(size=20) if skew == 0.0 else np.exp(skew * rng.normal(size=20) - 0.5 * skew**2)
        interval = mean_interval(values, draws=999)
        held += interval.low <= (0.0 if skew == 0.0 else 1.0) <= interval.high
    assert least <= held / 400 <= 0.98


def test_the_same_values_give_the_same_interval_around_their_mean() -> None:
    values = np.random.default_rng(6).gamma(2.0, size=20)
    one, other = (mean_interval(values) for _ in range(2))
    assert one == other
    assert one.low < one.mean < one.high and one.mean == pytest.approx(values.mean())
    assert mean_interval(np.append(values, np.nan)) == one


def test_few_or_equal_values_get_no_interval_that_they_cannot_bear() -> None:
    assert np.isnan(mean_interval(np.empty(0)).mean)
    few = mean_interval(np.arange(4.0))
    assert few.mean == 1.5 and np.isnan([few.low, few.high]).all()
    equal = mean_interval(np.full(20, 0.1))
    assert (equal.low, equal.mean, equal.high) == pytest.approx((0.1, 0.1, 0.1))


def test_the_test_is_exact_with_ties_and_without() -> None:
    rng = np.random.default_rng(7)
    for n in (1, 2, 7, 20, 45):
        differences = rng.normal(size=n) + 0.3
        assert signed_rank(differences).p == pytest.approx(stats.wilcoxon(differences, method="exact").pvalue)
    tied = np.array([1.0, -1.0, 2.0, 2.0, -3.0, 1.0, 4.0, 2.0])
    every = stats.PermutationMethod(n_resamples=1 << 20)
    assert signed_rank(tied).p == pytest.approx(stats.wilcoxon(tied, method=every).pvalue)
    many = rng.normal(size=300) + 0.1
    assert signed_rank(many).p == pytest.approx(stats.wilcoxon(many, method="asymptotic").pvalue, rel=0.01)


def test_swapping_the_two_swaps_the_verdict_and_nothing_else() -> None:
    differences = np.random.default_rng(8).normal(size=20) - 1.5
    (one,), (other,) = judged([signed_rank(differences)]), judged([signed_rank(-differences)])
    assert (one.verdict, other.verdict) == ("first better", "second better")
    assert one.p == other.p and one.median == -other.median and one.share == 1.0 - other.share


def test_a_failed_run_loses_and_one_that_both_failed_says_nothing() -> None:
    rng = np.random.default_rng(9)
    first, second = rng.normal(size=(2, 20))
    second[:15], first[15:17], second[15:17] = np.inf, np.inf, np.inf
    first[17] = np.nan
    differences = by_seed(list(range(20)), first, second)
    assert len(differences) == 17
    (test,) = judged([signed_rank(differences)])
    assert test.verdict == "first better" and test.median == -np.inf


def test_a_drive_lost_by_each_somewhere_is_left_out() -> None:
    inf = np.inf
    kept = by_seed(["a", "a", "b", "b"], np.array([inf, 0.0, inf, 1.0]), np.array([0.0, inf, 0.0, 0.0]))
    assert kept.tolist() == [inf]
    assert len(by_seed([], np.empty(0), np.empty(0))) == 0


def test_a_test_that_passed_is_not_called_one_of_too_few_seeds() -> None:
    agreeing = -np.arange(1.0, 21.0)
    verdicts = [test.verdict for test in judged([signed_rank(agreeing)] * 9 + [signed_rank(agreeing[:6])])]
    assert verdicts == ["first better"] * 10


def test_too_few_seeds_are_said_to_be_too_few() -> None:
    agreeing = -np.arange(1.0, 30.0)
    for pairs, least in ((1, 6), (10, 9), (30, 11)):
        for n, expected in ((least - 1, "too few seeds"), (least, "first better")):
            assert {test.verdict for test in judged([signed_rank(agreeing[:n])] * pairs)} == {expected}
    (nothing,) = judged([signed_rank(np.empty(0))])
    assert nothing.verdict == "too few seeds" and np.isnan(nothing.p)


def test_equal_drives_show_no_difference() -> None:
    (test,) = judged([signed_rank(np.zeros(20))])
    assert (test.p, test.share, test.verdict) == (1.0, 0.5, "no difference shown")


def test_holm_never_lowers_and_keeps_the_order() -> None:
    p = [0.01, 0.04, 0.03, 0.005, np.nan]
    assert holm(p) == pytest.approx([0.03, 0.06, 0.06, 0.02, np.nan], nan_ok=True)
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []
