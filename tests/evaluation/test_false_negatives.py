import numpy as np
import pytest

from contourslam.evaluation.false_negatives import false_negatives


def test_the_rate_is_failures_over_chances(corner_map):
    found = false_negatives(corner_map([8, 5, 10], [2, 5, 0]))
    np.testing.assert_allclose(found.rates, [0.2, 0.5, 0.0])
    assert found.median == pytest.approx(0.2)
    assert found.mean == pytest.approx(7 / 30)
    assert found.count == 3


def test_a_landmark_without_a_chance_has_no_rate(wall_map):
    found = false_negatives(wall_map([0, 9], [0, 1]))
    assert np.isnan(found.rates[0])
    assert found.median == pytest.approx(0.1)
    assert found.mean == pytest.approx(0.1)


def test_an_empty_map_has_no_rate(corner_map):
    found = false_negatives(corner_map([], []))
    assert found.count == 0
    assert np.isnan(found.mean)
    assert np.isnan(found.median)
