import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from contourslam.contour import difference_code, polar_code


@given(st.lists(st.tuples(st.floats(0.0, 40.0), st.floats(-7.0, 7.0)), min_size=1, max_size=20))
def test_the_polar_code_is_equation_1(beams: list[tuple[float, float]]) -> None:
    ranges, angles = np.array(beams).T
    expected = [complex(r * math.cos(a), r * math.sin(a)) for r, a in beams]
    np.testing.assert_allclose(polar_code(ranges, angles), expected, atol=1e-12)


def test_the_difference_code_is_the_vector_from_each_point_to_the_next() -> None:
    points = np.array([1.0 + 0.0j, 2.0 + 1.0j, 2.0 - 3.0j])
    np.testing.assert_array_equal(difference_code(points), [1.0 + 1.0j, -4.0j])
    assert difference_code(points[:1]).size == 0


@given(st.integers(0, 100), st.floats(-4.0, 4.0))
def test_the_difference_code_forgets_translation_and_turns_with_the_contour(seed: int, turn: float) -> None:
    points = np.random.default_rng(seed).normal(size=10) + 1j * np.random.default_rng(seed + 1).normal(size=10)
    moved = points * np.exp(1j * turn) + (3.0 - 7.0j)
    np.testing.assert_allclose(difference_code(moved), difference_code(points) * np.exp(1j * turn), atol=1e-12)
