from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from contourslam.contour import Contours
from contourslam.detectors import suppress

Maker = Callable[..., Contours]
VALUES = st.lists(st.sampled_from([0.0, 0.2, 0.5, 0.7, 0.7, 1.0, float("nan")]), max_size=25)


def kept(make: Maker, values: list[float], reach: int, threshold: float = 0.5, closed: bool = False) -> list[int]:
    contour = make(np.zeros((len(values), 2)), closed=closed)
    return list(suppress(np.array(values, dtype=float), contour, threshold, reach))


def test_only_the_largest_within_reach_stays(contour_of: Maker) -> None:
    values = [0.0, 0.6, 0.9, 0.7, 0.0, 0.8, 0.0]
    assert kept(contour_of, values, 1) == [2, 5]
    assert kept(contour_of, values, 3) == [2]


def test_a_response_below_the_threshold_is_no_candidate_and_one_at_it_is(contour_of: Maker) -> None:
    assert kept(contour_of, [0.0, 0.49, 0.0, 0.5, 0.0], 1) == [3]


def test_a_plateau_gives_one_candidate(contour_of: Maker) -> None:
    for reach in (1, 2, 9):
        assert kept(contour_of, [0.0, 0.8, 0.8, 0.8, 0.8, 0.0], reach) == [1]
    for reach in (1, 2):
        assert kept(contour_of, [0.8, 0.0, 0.0, 0.8, 0.8], reach, closed=True) == [3]


def test_a_ring_goes_on_over_its_ends_and_an_open_contour_does_not(contour_of: Maker) -> None:
    values = [0.9, 0.0, 0.0, 0.0, 0.0, 0.8]
    assert kept(contour_of, values, 2) == [0, 5]
    assert kept(contour_of, values, 2, closed=True) == [0]


def test_the_neighbouring_contour_suppresses_nothing() -> None:
    contours = Contours(np.zeros((6, 2)), np.array([0, 3, 3, 6]), np.zeros(3, np.bool_), 0.0, np.arange(6.0))
    assert list(suppress(np.array([0.0, 0.0, 0.7, 0.9, 0.0, 0.0]), contours, 0.5, 2)) == [2, 3]


def test_nothing_comes_of_nothing(contour_of: Maker) -> None:
    assert kept(contour_of, [], 3) == []
    assert kept(contour_of, [0.9], 3, closed=True) == [0]
    assert kept(contour_of, [float("nan")], 3) == []


@given(VALUES, st.integers(0, 6), st.booleans())
def test_the_kernel_agrees_with_plain_python(contour_of: Maker, values: list[float], reach: int, closed: bool) -> None:
    n = len(values)
    expected = []
    for i, value in enumerate(values):
        before = [i - k for k in range(1, reach + 1) if closed or i - k >= 0]
        after = [i + k for k in range(1, reach + 1) if closed or i + k < n]
        first = not any(values[j % n] >= value for j in before if j % n != i)
        if value >= 0.5 and first and not any(values[j % n] > value for j in after):
            expected.append(i)
    assert kept(contour_of, values, reach, closed=closed) == expected
