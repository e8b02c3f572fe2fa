import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.contour import Contours
from contourslam.detectors import TehChin
from contourslam.detectors.teh_chin import k_cosine, support_length

Floats = NDArray[np.float64]
Maker = Callable[..., Contours]
MIRROR = np.array([1.0, -1.0])


def mirrored_twins(right: list[tuple[float, float]]) -> Floats:
    """A polyline symmetric about the y axis, with its middle point at the origin."""
    half = np.array(right, dtype=float)
    return np.concatenate([half[::-1] * [-1.0, 1.0], [[0.0, 0.0]], half])


# The perpendicular d and the chord l of eq. (14) as k grows, and the k at which the stopping rule holds.
GROWING = mirrored_twins([(1, 1), (2, 4), (3, 9), (4, 16)])  # d/l = 1/2, 1, 3/2, 2: up to the end of the contour
TIP = mirrored_twins([(1, 0), (2, 1), (3, 3), (4, 3)])  # d/l = 0, 1/4, 1/2, 3/8: stops at k = 3
BUMP = mirrored_twins([(1, 1), (2, 1), (3, 4), (4, 9)])  # d/l = 1/2, 1/4: stops at once, though it grows later on
HAIRPIN = mirrored_twins([(1, 1), (1.5, 3), (1, 5), (1.2, 9)])  # l = 2, 3, 2: the chord shrinks after k = 2


@pytest.mark.parametrize("side", [[1.0, 1.0], [1.0, -1.0]])
@pytest.mark.parametrize(("points", "k"), [(GROWING, 4), (TIP, 3), (BUMP, 1), (HAIRPIN, 2)])
def test_the_support_ends_by_the_stopping_rule_on_either_side_of_the_chord(
    points: Floats, k: int, side: list[float]
) -> None:
    assert support_length(points * side, 0, 9, False, 4, 1, 1000) == k


def test_the_support_stays_within_its_limits_and_the_contour() -> None:
    assert support_length(GROWING, 0, 9, False, 4, 1, 2) == 2
    assert support_length(GROWING, 0, 9, False, 1, 1, 1000) == 1
    assert support_length(GROWING, 0, 9, False, 0, 1, 1000) == 0
    assert support_length(GROWING, 0, 9, False, 1, 2, 1000) == 0
    assert support_length(BUMP, 0, 9, False, 4, 3, 1000) == 4


def test_the_cosine_is_minus_1_on_a_wall_0_at_a_right_angle_and_plus_1_on_a_spike() -> None:
    wall = np.array([[-3.0, -6.0], [-1.0, -2.0], [0.0, 0.0], [1.0, 2.0], [4.0, 8.0]])
    spike = np.array([[0.0, 3.0], [0.0, 1.0], [0.0, 0.0], [0.0, 2.0], [0.0, 5.0]])
    right = np.array([[-5.0, 0.0], [-1.0, 0.0], [0.0, 0.0], [0.0, 2.0], [0.0, 3.0]])
    for k in (1, 2):
        assert k_cosine(wall, 0, 5, False, 2, k) == pytest.approx(-1.0)
        assert k_cosine(spike, 0, 5, False, 2, k) == pytest.approx(1.0)
        assert k_cosine(right, 0, 5, False, 2, k) == pytest.approx(0.0)


def test_points_on_top_of_each_other_count_as_straight() -> None:
    assert k_cosine(np.zeros((5, 2)), 0, 5, False, 2, 1) == -1.0


def test_the_response_is_the_squared_cosine_of_half_the_opening(
    contour_of: Maker, corner_of: Callable[..., Floats]
) -> None:
    for opening_deg in (20.0, 90.0, 135.0):
        for adapted in (True, False):
            spacing = 0.05 if adapted else 0.0
            points = corner_of(math.pi - math.radians(opening_deg), 15)
            response = TehChin(adapted=adapted).respond(contour_of(points, spacing=spacing))
            assert response[15] == pytest.approx(math.cos(math.radians(0.5 * opening_deg)) ** 2)
            assert np.argmax(response) == 15


def twin(points: Floats, closed: bool, least: int, most: int) -> list[float]:
    n = len(points)

    def chord(i: int, k: int) -> tuple[float, float]:
        (ax, ay), (px, py), (bx, by) = points[(i - k) % n], points[i], points[(i + k) % n]
        length = math.hypot(bx - ax, by - ay)
        return length, ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / length if length else 0.0

    out = []
    for i in range(n):
        room = min(most, (n - 1) // 2 if closed else min(i, n - 1 - i))
        if room < least:
            out.append(0.0)
            continue
        k = least
        while k < room:
            (l0, d0), (l1, d1) = chord(i, k), chord(i, k + 1)
            if l0 >= l1 or (d0 > 0 and d0 / l0 >= d1 / l1) or (d0 < 0 and d0 / l0 <= d1 / l1):
                break
            k += 1
        a, b = points[(i - k) % n] - points[i], points[(i + k) % n] - points[i]
        out.append(0.5 * (1.0 + a @ b / (np.linalg.norm(a) * np.linalg.norm(b))))
    return out


@given(st.integers(0, 10_000), st.booleans(), st.booleans())
def test_the_kernel_agrees_with_plain_python(contour_of: Maker, seed: int, closed: bool, adapted: bool) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0.01, 0.05, (int(rng.integers(3, 50)), 2)), axis=0)
    spacing = 0.05 if adapted else 0.0
    response = TehChin(adapted=adapted).respond(contour_of(points, closed=closed, spacing=spacing))
    expected = twin(points, closed, 4 if adapted else 1, 12 if adapted else 1000)
    np.testing.assert_allclose(response, expected, atol=1e-12)
