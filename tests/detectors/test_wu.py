import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.contour import Contours
from contourslam.detectors import Wu

Floats = NDArray[np.float64]
Maker = Callable[..., Contours]


def cosine(points: Floats, i: int, k: int) -> float:
    n = len(points)
    a, b = points[(i - k) % n] - points[i], points[(i + k) % n] - points[i]
    return float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))


def twin(points: Floats, closed: bool, least: int, most: int, first: int) -> list[float]:
    n = len(points)
    out = []
    for i in range(n):
        room = min(most, (n - 1) // 2 if closed else min(i, n - 1 - i))
        if room < least:
            out.append(0.0)
            continue
        k_i = max(range(least, room + 1), key=lambda k: cosine(points, i, k))
        out.append(0.5 * (1.0 + float(np.mean([cosine(points, i, j) for j in range(first, k_i + 1)]))))
    return out


@given(st.integers(0, 10_000), st.booleans())
def test_as_printed_the_curvature_is_the_mean_from_j_1_to_the_best_support_between_3_and_12(
    contour_of: Maker, seed: int, closed: bool
) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0.01, 0.05, (int(rng.integers(3, 50)), 2)), axis=0)
    response = Wu(adapted=False).respond(contour_of(points, closed=closed))
    np.testing.assert_allclose(response, twin(points, closed, 3, 12, 1), atol=1e-12)


@given(st.integers(0, 10_000), st.booleans())
def test_adapted_the_mean_begins_at_the_least_support_in_metres(contour_of: Maker, seed: int, closed: bool) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0.01, 0.05, (int(rng.integers(3, 50)), 2)), axis=0)
    response = Wu().respond(contour_of(points, closed=closed, spacing=0.05))
    np.testing.assert_allclose(response, twin(points, closed, 4, 10, 4), atol=1e-12)


def test_a_wall_gives_0_and_a_corner_the_squared_cosine_of_half_its_opening(
    contour_of: Maker, corner_of: Callable[..., Floats]
) -> None:
    for opening_deg in (20.0, 90.0, 135.0):
        for adapted in (True, False):
            points = corner_of(math.pi - math.radians(opening_deg), 30)
            response = Wu(adapted=adapted).respond(contour_of(points, spacing=0.05 if adapted else 0.0))
            assert response[30] == pytest.approx(math.cos(math.radians(0.5 * opening_deg)) ** 2)
            np.testing.assert_allclose(response[:18], 0.0, atol=1e-12)
            assert np.argmax(response) == 30


def test_the_support_is_the_global_maximum_where_a_first_one_is_noise(contour_of: Maker) -> None:
    # A right angle whose tip is cut off: the cosine grows from the short to the long chords.
    left = [[-x, x] for x in range(12, 0, -1)]
    points = np.array([*left, [0.0, 0.9], *([x, x] for x in range(1, 13))], dtype=float)
    values = [cosine(points, 12, k) for k in range(1, 13)]
    assert int(np.argmax(values[2:])) + 3 == 12
    assert Wu(adapted=False).respond(contour_of(points))[12] == pytest.approx(0.5 * (1.0 + np.mean(values)))
