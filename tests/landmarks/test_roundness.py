import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.landmarks.line_fit import fit_line
from contourslam.landmarks.roundness import is_round

Floats = NDArray[np.float64]


def judge(points: Floats, vertex: int, sigma: float = 0.01) -> bool:
    n = len(points)
    first = fit_line(points, 0, vertex - 1, 0, n, sigma)
    second = fit_line(points, vertex + 1, n - 1, 0, n, sigma)
    return is_round(points, 0, vertex, n - 1, 0, n, first, second)


def twin(points: Floats, vertex: int, sigma: float = 0.01) -> tuple[float, float]:
    """Sums of squared distances from Kasa's circle by least squares, and from the two lines."""
    n = len(points)
    sides = np.delete(points, vertex, axis=0)
    centre = sides.mean(axis=0)
    x, y = (sides - centre).T
    a, b, c = np.linalg.lstsq(np.stack([2.0 * x, 2.0 * y, np.ones(n - 1)], axis=1), x * x + y * y, rcond=None)[0]
    circle = np.sum((np.hypot(x - a, y - b) - math.sqrt(a * a + b * b + c)) ** 2)
    lines = 0.0
    for start, stop in ((0, vertex - 1), (vertex + 1, n - 1)):
        nx, ny, cx, cy, *_ = fit_line(points, start, stop, 0, n, sigma)
        lines += float(np.sum(((points[start : stop + 1] - [cx, cy]) @ [nx, ny]) ** 2))
    return float(circle), lines


@given(st.integers(0, 10_000), st.floats(0.0, 2.0))
def test_the_kernel_agrees_with_least_squares(seed: int, bend: float) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(9, 50))
    along = np.linspace(-0.5, 0.5, n)
    points = np.stack([along, 1.0 + bend * along**2], axis=1) + rng.normal(0.0, 0.01, (n, 2))
    vertex = n // 2
    circle, lines = twin(points, vertex)
    assume(abs(circle - lines) > 1e-9)
    assert judge(points, vertex) == (circle < lines)


@pytest.mark.parametrize("sigma", [0.002, 0.01])
@pytest.mark.parametrize("turned_deg", [90.0, 120.0, 150.0])
def test_an_arc_is_round_and_an_angle_is_not(corner_of: Callable[..., Floats], turned_deg: float, sigma: float) -> None:
    rng = np.random.default_rng(0)
    turned = math.radians(turned_deg)
    angle = np.linspace(-0.5 * turned, 0.5 * turned, 41)
    arc = np.stack([2.0 - 0.5 * np.cos(angle), -0.5 * np.sin(angle)], axis=1)
    corner = np.add(corner_of(turned, 20, 0.025), [0.0, 1.0])
    arcs, corners = ([judge(rng.normal(shape, sigma), 20, sigma) for _ in range(50)] for shape in (arc, corner))
    assert sum(arcs) >= 48
    assert sum(corners) == 0


def test_points_in_one_line_are_not_round() -> None:
    assert not judge(np.stack([np.arange(11.0), np.ones(11)], axis=1), 5)
