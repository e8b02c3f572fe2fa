import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.geometry.angles import wrap, wrap_angle

NEAR = [sign * math.pi + k * math.ulp(math.pi) for sign in (-3, -1, 1, 3) for k in range(-4, 5)]


@given(st.one_of(st.floats(-1e4, 1e4), st.sampled_from(NEAR)))
def test_a_wrapped_angle_lies_above_minus_pi_and_up_to_pi_and_points_the_same_way(angle: float) -> None:
    for wrapped in (wrap_angle(angle), float(wrap(np.array(angle)))):
        assert -math.pi < wrapped <= math.pi
        assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-10)
        assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-10)


@given(st.floats(-1e4, 1e4))
def test_wrapping_twice_is_wrapping_once(angle: float) -> None:
    once = wrap(np.array(angle))
    assert wrap(once) == pytest.approx(once, abs=1e-15)


def test_half_a_turn_either_way_is_pi() -> None:
    np.testing.assert_array_equal(wrap(np.array([math.pi, -math.pi])), [math.pi, math.pi])
    assert wrap_angle(-math.pi) == wrap_angle(math.pi) == math.pi


def test_the_smallest_step_beyond_pi_does_not_become_minus_pi() -> None:
    beyond = math.nextafter(math.pi, 4.0)
    assert wrap_angle(beyond) > -math.pi
    assert wrap(np.array([beyond]))[0] > -math.pi


def test_the_kernel_and_the_array_function_agree_and_keep_the_shape() -> None:
    angles = np.random.default_rng(0).uniform(-20.0, 20.0, (7, 11))
    twin = np.array([math.atan2(math.sin(a), math.cos(a)) for a in angles.ravel()]).reshape(7, 11)
    np.testing.assert_allclose(wrap(angles), twin, atol=1e-12)
    np.testing.assert_array_equal(np.vectorize(wrap_angle)(angles), wrap(angles))


def test_a_missing_angle_stays_missing() -> None:
    assert np.isnan(wrap(np.array([math.nan]))).all()
    assert math.isnan(wrap_angle(math.nan))
