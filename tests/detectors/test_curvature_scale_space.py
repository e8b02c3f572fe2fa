import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.contour import Contours
from contourslam.detectors import CurvatureScaleSpace, suppress
from contourslam.detectors.curvature_scale_space import _gaussian_derivatives, curvature

Floats = NDArray[np.float64]
Maker = Callable[..., Contours]


def circle(radius: float, spacing: float = 1.0) -> Floats:
    n = round(2.0 * math.pi * radius / spacing)
    angle = 2.0 * math.pi / n * np.arange(n)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize("sigma", [1.0, 3.0, 5.0])
@pytest.mark.parametrize("radius", [40.0, 100.0])
def test_the_curvature_of_a_circle_is_one_over_its_radius_and_positive_to_the_left(radius: float, sigma: float) -> None:
    points = circle(radius)
    shrunk = radius * math.exp(-0.5 * (sigma / radius) ** 2)  # what smoothing leaves of it
    kappa, steps = curvature(points, 0, len(points), True, sigma)
    np.testing.assert_allclose(kappa, 1.0 / shrunk, rtol=5e-3)
    np.testing.assert_allclose(steps, 1.0, rtol=2e-2)
    backwards, _ = curvature(np.ascontiguousarray(points[::-1]), 0, len(points), True, sigma)
    np.testing.assert_allclose(backwards, -kappa[::-1], rtol=1e-9)


def test_the_curvature_is_in_1_per_metre_whatever_the_spacing() -> None:
    for spacing in (0.01, 0.05):
        points = circle(2.0, spacing)
        kappa, steps = curvature(points, 0, len(points), True, 3.0)
        np.testing.assert_allclose(kappa, 0.5, rtol=5e-3)
        np.testing.assert_allclose(steps, spacing, rtol=5e-3)


@pytest.mark.parametrize("sigma", [1.0, 1.7, 3.0, 6.0])
def test_the_derivatives_are_exact_on_lines_and_parabolas(sigma: float) -> None:
    first, second = _gaussian_derivatives(sigma)
    half = len(first) // 2
    s = np.arange(-half - 5, half + 6, dtype=float)
    np.testing.assert_allclose(np.convolve(3.0 * s - 7.0, first, "valid"), 3.0, atol=1e-9)
    np.testing.assert_allclose(np.convolve(3.0 * s - 7.0, second, "valid"), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.convolve(2.5 * s**2, second, "valid"), 5.0, atol=1e-9)


def test_to_derive_the_smoothed_is_to_convolve_with_the_derivative() -> None:
    sigma, s = 4.0, np.arange(400, dtype=float)
    signal = np.sin(0.05 * s) + 0.5 * np.cos(0.11 * s)
    window = np.arange(-12, 13)
    gauss = np.exp(-0.5 * (window / sigma) ** 2)
    smooth = np.convolve(signal, gauss / gauss.sum(), "valid")
    first, second = (np.convolve(signal, g, "valid") for g in _gaussian_derivatives(sigma))
    np.testing.assert_allclose(np.gradient(smooth)[1:-1], first[1:-1], atol=2e-3 * np.abs(first).max() + 2e-4)
    np.testing.assert_allclose(np.diff(smooth, 2), second[1:-1], atol=2e-2 * np.abs(second).max())


def twin(points: Floats, closed: bool, sigma: float) -> Floats:
    """Equation (21) with np.convolve on the contour wrapped, or reflected through its end points."""
    first, second = _gaussian_derivatives(sigma)
    half, n = len(first) // 2, len(points)
    index = np.arange(-half, n + half)
    if closed:
        laid = points[index % n]
    else:
        laid = np.where(
            (index < 0)[:, None],
            2.0 * points[0] - points[np.minimum(np.abs(index), n - 1)],
            points[np.clip(index, 0, n - 1)],
        )
        beyond = 2.0 * points[-1] - points[np.maximum(2 * (n - 1) - np.maximum(index, n - 1), 0)]
        laid = np.where((index >= n)[:, None], beyond, laid)
    dx, dy = (np.convolve(laid[:, k], first, "valid") for k in range(2))
    ddx, ddy = (np.convolve(laid[:, k], second, "valid") for k in range(2))
    return np.asarray((dx * ddy - ddx * dy) / (dx**2 + dy**2) ** 1.5)


@given(st.integers(0, 10_000), st.booleans(), st.sampled_from([1.0, 1.7, 3.0]))
def test_the_kernel_agrees_with_numpy(seed: int, closed: bool, sigma: float) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 60))
    points = np.stack([np.arange(n), rng.normal(0.0, 0.3, n)], axis=1)
    kappa, _ = curvature(points, 0, n, closed, sigma)
    np.testing.assert_allclose(kappa, twin(points, closed, sigma), rtol=1e-6, atol=1e-9)


def test_the_ends_of_an_open_contour_are_no_corners(contour_of: Maker) -> None:
    quarter = circle(2.0, 0.05)[:64]
    for points in (quarter, np.stack([np.arange(40) * 0.05, np.zeros(40)], axis=1)):
        for detector, spacing in ((CurvatureScaleSpace(), 0.05), (CurvatureScaleSpace(adapted=False), 0.0)):
            assert (detector.respond(contour_of(points, spacing=spacing)) == 0.0).all()


def test_the_end_itself_is_straight_by_its_reflection() -> None:
    points = circle(2.0, 0.05)[:64]
    kappa, _ = curvature(points, 0, 64, False, 2.0)
    np.testing.assert_allclose(kappa[[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(kappa[10:-10], 0.5, rtol=1e-2)


def test_a_round_contour_has_no_corner_and_a_square_has_four_wherever_its_ring_begins(contour_of: Maker) -> None:
    detector = CurvatureScaleSpace()
    assert (detector.respond(contour_of(circle(0.8, 0.05), closed=True, spacing=0.05)) == 0.0).all()
    right = np.stack([np.arange(40) * 0.05, np.zeros(40)], axis=1)
    up = right[:, ::-1]
    square = np.concatenate([right, np.add(up, [2.0, 0.0]), [2.0, 2.0] - right, [0.0, 2.0] - up])
    for shift in (0, 1, 2, 5, 17, 39, 40, 159):
        contour = contour_of(np.roll(square, -shift, axis=0), closed=True, spacing=0.05)
        found = suppress(detector.respond(contour), contour, detector.threshold, detector.reach(contour))
        assert sorted((found + shift) % 160) == [0, 40, 80, 120]


def test_the_response_is_a_turn_and_does_not_depend_on_the_spacing_or_the_scale(
    contour_of: Maker, corner_of: Callable[..., Floats]
) -> None:
    for scale in (0.1, 1.0, 10.0):
        detector = CurvatureScaleSpace(sigma=0.15 * scale, side=0.4 * scale)
        points = scale * corner_of(math.pi / 2, 20)
        raw = CurvatureScaleSpace(adapted=False).respond(contour_of(points))[20]
        assert raw == pytest.approx(0.8, abs=0.05)  # 1/sqrt(2 pi) times 2 in the limit of many samples
        assert detector.respond(contour_of(points, spacing=0.05 * scale))[20] == pytest.approx(raw)


@pytest.mark.parametrize(("opening_deg", "found"), [(90.0, True), (140.0, True), (158.0, False), (175.0, False)])
def test_a_corner_that_opens_too_far_is_dropped(
    contour_of: Maker, corner_of: Callable[..., Floats], opening_deg: float, found: bool
) -> None:
    points = corner_of(math.pi - math.radians(opening_deg), 20)
    assert (CurvatureScaleSpace().respond(contour_of(points, spacing=0.05)).max() > 0.0) == found


def test_as_its_source_has_it_the_limit_is_162_degrees(contour_of: Maker, corner_of: Callable[..., Floats]) -> None:
    detector = CurvatureScaleSpace(adapted=False)
    for opening_deg, found in ((160.0, True), (164.0, False)):
        points = corner_of(math.pi - math.radians(opening_deg), 30)
        assert (detector.respond(contour_of(points)).max() > 0.0) == found
