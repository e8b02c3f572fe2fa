import math

import numpy as np
import pytest

from contourslam.errors import ContourslamError, ScanError
from contourslam.scan import LaserScan, Odometry, evenly_spaced


def scan(**changed: object) -> LaserScan:
    values: dict[str, object] = {
        "stamp": 1.0,
        "angles": np.zeros(3),
        "ranges": np.ones(3),
        "offsets": np.zeros(3),
        "range_min": 0.1,
        "range_max": 10.0,
    }
    return LaserScan(**(values | changed))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["angles", "ranges", "offsets"])
@pytest.mark.parametrize("shape", [(2,), (4,), (3, 1), (0,)])
def test_arrays_that_disagree_are_an_error_that_gives_stamp_and_shapes(name: str, shape: tuple[int, ...]) -> None:
    with pytest.raises(ScanError, match=r"scan at stamp 1.0: angles .* ranges .* offsets .* one length"):
        scan(**{name: np.zeros(shape)})


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["angles", "offsets", "stamp"])
def test_a_stamp_angle_or_offset_that_is_not_finite_is_an_error(name: str, bad: float) -> None:
    value: object = bad if name == "stamp" else np.array([0.0, bad, 0.0])
    with pytest.raises(ScanError, match="not finite"):
        scan(**{name: value})


@pytest.mark.parametrize(
    "limits", [(math.nan, 10.0), (0.1, math.nan), (-0.1, 10.0), (5.0, 5.0), (6.0, 5.0), (math.inf, math.inf)]
)
def test_range_limits_that_are_no_range_are_an_error(limits: tuple[float, float]) -> None:
    with pytest.raises(ScanError, match="are not a range"):
        scan(range_min=limits[0], range_max=limits[1])


def test_a_driver_that_knows_no_upper_limit_may_say_infinity() -> None:
    assert scan(range_max=math.inf).range_max == math.inf


def test_a_known_failure_has_the_packages_root() -> None:
    assert issubclass(ScanError, ContourslamError)


def test_ranges_may_be_anything_since_nothing_is_filtered_yet() -> None:
    ranges = np.array([math.nan, math.inf, -1.0])
    np.testing.assert_array_equal(scan(ranges=ranges).ranges, ranges)


def test_the_arrays_are_copies_of_the_callers_and_read_only() -> None:
    ranges = np.ones(3)
    value = scan(ranges=ranges)
    ranges[0] = 7.0
    assert value.ranges[0] == 1.0
    for name in ("angles", "ranges", "offsets"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(value, name)[0] = 2.0


def test_lists_and_integers_become_floats() -> None:
    value = scan(angles=[0, 1, 2], ranges=[1, 2, 3], offsets=[0, 0, 0])
    assert value.angles.dtype == value.ranges.dtype == value.offsets.dtype == np.float64


def test_evenly_spaced_beams_start_at_the_first_angle_and_time() -> None:
    value = evenly_spaced(
        2.0, [1, 2, 3], angle_min=-0.5, angle_increment=0.25, range_min=0.0, range_max=9.0, time_increment=0.01
    )
    np.testing.assert_allclose(value.angles, [-0.5, -0.25, 0.0])
    np.testing.assert_allclose(value.offsets, [0.0, 0.01, 0.02])


@pytest.mark.parametrize("beams", [0, 1, 499, 500])
def test_a_scan_may_have_any_number_of_beams(beams: int) -> None:
    value = evenly_spaced(0.0, np.ones(beams), angle_min=0.0, angle_increment=0.01, range_min=0.1, range_max=9.0)
    assert value.ranges.shape == value.angles.shape == value.offsets.shape == (beams,)


@pytest.mark.parametrize("pose", [[0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, math.nan, 0.0], [math.inf, 0.0, 0.0], 3.0])
def test_odometry_of_a_wrong_shape_or_value_is_an_error_that_shows_it(pose: object) -> None:
    with pytest.raises(ScanError, match=r"odometry at stamp 1.5: pose must be three finite numbers, got"):
        Odometry(1.5, np.asarray(pose))


def test_odometry_needs_a_finite_stamp_and_keeps_a_read_only_copy() -> None:
    with pytest.raises(ScanError, match="odometry at stamp nan"):
        Odometry(math.nan, np.zeros(3))
    pose = np.zeros(3)
    reading = Odometry(0.0, pose)
    pose[0] = 1.0
    assert reading.pose[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        reading.pose[0] = 1.0
