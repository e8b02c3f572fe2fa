import math

import pytest

from contourslam.scan import evenly_spaced
from contourslam.scan.validity import valid_beams


def valid(
    ranges: list[float], *, range_min: float = 0.1, range_max: float = 10.0, max_range: float = 30.0
) -> list[bool]:
    scan = evenly_spaced(0.0, ranges, angle_min=0.0, angle_increment=0.1, range_min=range_min, range_max=range_max)
    return list(valid_beams(scan, max_range))


@pytest.mark.parametrize("no_return", [math.nan, math.inf, -math.inf, 0.0, -2.0, 0.05, 10.5, 1e300])
def test_a_range_that_is_no_measurement_is_no_return(no_return: float) -> None:
    assert valid([2.0, no_return, 3.0]) == [True, False, True]


def test_zero_is_no_return_even_where_the_lower_limit_is_zero() -> None:
    assert valid([0.0, -0.0, 1e-3], range_min=0.0) == [False, False, True]


def test_a_range_clamped_to_the_upper_limit_is_no_return_and_one_at_the_lower_limit_is_one() -> None:
    assert valid([10.0, math.nextafter(10.0, 0.0), 0.1]) == [False, True, True]


def test_the_nearer_of_the_two_upper_limits_counts() -> None:
    assert valid([4.0, 6.0, 12.0], max_range=5.0) == [True, False, False]
    assert valid([4.0, 6.0, 12.0], max_range=50.0) == [True, True, False]
    assert valid([4.0, 6.0, 1e9], range_max=math.inf, max_range=5.0) == [True, False, False]


def test_a_scan_without_beams_has_none_valid() -> None:
    assert valid([]) == []
    assert valid([1.0]) == [True]
