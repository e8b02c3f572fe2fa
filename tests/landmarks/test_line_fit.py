import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.landmarks.line_fit import fit_line, grow_line

Floats = NDArray[np.float64]


def wall(seed: int, n: int, sigma: float, *, direction: float = 0.4, distance: float = 2.0) -> Floats:
    """Points of a wall with range noise along their beams, counter-clockwise."""
    rng = np.random.default_rng(seed)
    bearings = direction + np.linspace(-0.6, 0.5, n)
    ranges = distance / np.cos(bearings - direction) + sigma * rng.standard_normal(n)
    return np.stack([ranges * np.cos(bearings), ranges * np.sin(bearings)], axis=1)


def twin(points: Floats, sigma: float) -> tuple[float, ...]:
    """Weighted total least squares by the eigenvectors of the scatter matrix, once without and once with weights."""
    weights, normal = np.ones(len(points)), np.zeros(2)
    for weighted in (False, True):
        if weighted:
            weights = 1.0 / (sigma**2 * ((points @ normal) ** 2 / (points**2).sum(axis=1) + 0.1))
        centre = weights @ points / weights.sum()
        values, vectors = np.linalg.eigh((weights[:, None] * (points - centre)).T @ (points - centre))
        normal = vectors[:, 0]
    along = points[-1] - points[0]
    if along[1] * normal[0] - along[0] * normal[1] < 0.0:  # to the right of the contour's direction
        normal = -normal
    scatter = values[0] / (len(points) - 2)
    grown = max(scatter, 1.0)
    return (*normal, *centre, grown / weights.sum(), grown / values[1], math.sqrt(scatter))


@given(st.integers(0, 10_000), st.integers(3, 80), st.floats(0.001, 0.05))
def test_the_fit_agrees_with_numpys_eigenvectors(seed: int, n: int, sigma: float) -> None:
    points = wall(seed, n, sigma, direction=float(np.random.default_rng(seed).uniform(-3.0, 3.0)))
    np.testing.assert_allclose(fit_line(points, 0, n - 1, 0, n, sigma), twin(points, sigma), rtol=1e-6, atol=1e-12)


@given(st.integers(0, 1000), st.floats(-3.1, 3.1))
def test_the_normal_points_away_from_the_lidar(seed: int, direction: float) -> None:
    points = wall(seed, 40, 0.01, direction=direction)
    nx, ny, cx, cy, *_ = fit_line(points, 0, 39, 0, 40, 0.01)
    assert math.hypot(nx, ny) == pytest.approx(1.0)
    assert nx * cx + ny * cy == pytest.approx(2.0, abs=0.02)
    assert math.cos(math.atan2(ny, nx) - direction) > 0.99


def test_indices_wrap_on_a_ring() -> None:
    points = wall(0, 30, 0.01)
    rolled = np.concatenate([np.full((7, 2), 9.0), np.roll(points, 11, axis=0)])
    fit = fit_line(rolled, 7 + 11, 7 + 11 + 29, 7, 30, 0.01)
    np.testing.assert_allclose(fit, fit_line(points, 0, 29, 0, 30, 0.01))
    np.testing.assert_allclose(fit_line(rolled, 7 + 11 - 30, 7 + 11 - 1, 7, 30, 0.01), fit)


@pytest.mark.parametrize("sigma", [0.005, 0.03])
@pytest.mark.parametrize("incidence", [0.0, 0.9])
def test_the_variances_are_those_of_many_fits_and_not_too_small(sigma: float, incidence: float) -> None:
    fits = []
    for seed in range(400):
        rng = np.random.default_rng(seed)
        bearings = incidence + np.linspace(-0.3, 0.3, 50)
        ranges = 2.0 / np.cos(bearings) + sigma * rng.standard_normal(50)
        points = np.stack([ranges * np.cos(bearings), ranges * np.sin(bearings)], axis=1)
        fits.append(fit_line(points, 0, 49, 0, 50, sigma))
    nx, ny, cx, cy, var_offset, var_angle, scatter = np.array(fits).T
    angle = np.arctan2(ny, nx)
    # The true wall is x = 2; the distance of each fit's centroid from it, across.
    offset = nx * (cx - 2.0) - 0.0 * cy
    assert 0.5 < np.mean(angle**2 / var_angle) < 1.15
    assert 0.5 < np.mean(offset**2 / var_offset) < 1.15
    assert np.mean(scatter) < 1.0


def test_where_the_points_scatter_more_than_expected_the_variances_grow_with_them() -> None:
    points = wall(1, 60, 0.05)
    honest, hopeful = (fit_line(points, 0, 59, 0, 60, sigma) for sigma in (0.05, 0.01))
    assert honest[6] < 1.1
    assert hopeful[6] == pytest.approx(5.0 * honest[6])
    for variance in (4, 5):  # what the points show, whatever the expected noise
        assert hopeful[variance] == pytest.approx(honest[variance] * min(honest[6], 1.0) ** 2)


def straight(n: int, step: float = 0.05) -> Floats:
    return np.stack([np.arange(n) * step, np.full(n, 2.0)], axis=1)


def grow(points: Floats, start: int = 0, step: int = 1, *, least: float = 0.25, most: float = 99.0) -> int:
    limit = len(points) - 1 if step > 0 else 0
    return grow_line(points, start, step, limit, 0, len(points), least, most, 0.01)


def test_a_line_grows_to_the_end_of_a_wall_in_either_direction_and_no_farther_than_asked() -> None:
    points = straight(40)
    assert grow(points) == 39
    assert grow(points, 39, -1) == 0
    assert grow(points, 10, most=0.52) == 20
    assert grow(points, 30, -1, most=0.52) == 20


def test_one_stray_point_is_passed_over_and_two_end_the_line() -> None:
    points = straight(40)
    points[20, 1] += 0.2
    assert grow(points) == 39
    points[21, 1] += 0.2
    assert grow(points) == 19


def test_a_line_stops_where_the_wall_turns() -> None:
    bend = np.concatenate([straight(30), straight(30)[-1] + np.arange(1, 20)[:, None] * [0.0, -0.05]])
    assert grow(bend) == 29
    assert grow(bend, 48, -1) == 29


def test_no_line_begins_beyond_the_limit() -> None:
    assert grow_line(straight(5), 5, 1, 4, 0, 5, 0.25, 9.0, 0.01) == -1
    assert grow_line(straight(5), -1, -1, 0, 0, 5, 0.25, 9.0, 0.01) == -1
