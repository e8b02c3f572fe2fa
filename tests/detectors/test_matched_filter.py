import cmath
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.contour import Contours
from contourslam.detectors import MatchedFilter

Floats = NDArray[np.float64]
Maker = Callable[..., Contours]
SIDE = 6


def bank(*turns_deg: float) -> MatchedFilter:
    return MatchedFilter(side=SIDE * 0.05, turns_deg=turns_deg)


def score(filtered: Floats, turn: float) -> Floats:
    """The printed score from the margin over what a straight wall scores."""
    wall = math.cos(0.5 * turn)
    return filtered * (1.0 - wall) + wall


@pytest.mark.parametrize("hand", [1.0, -1.0])
@pytest.mark.parametrize("interior_deg", [30.0, 60.0, 90.0, 120.0, 150.0])
def test_the_ideal_corner_scores_exactly_1_on_its_template(
    contour_of: Maker, corner_of: Callable[..., Floats], interior_deg: float, hand: float
) -> None:
    turn = math.pi - math.radians(interior_deg)
    contour = contour_of(corner_of(hand * turn, 12), spacing=0.05)
    response = bank(180.0 - interior_deg).respond(contour)
    assert response[12] == pytest.approx(1.0, abs=1e-12)
    assert np.argmax(response) == 12


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_the_printed_filter_scores_1_on_a_right_angle_and_0_71_on_a_wall(
    contour_of: Maker, corner_of: Callable[..., Floats], hand: float
) -> None:
    response = MatchedFilter(adapted=False, side=SIDE * 0.05).respond(
        contour_of(corner_of(hand * math.pi / 2, 20), spacing=0.05)
    )
    assert response[20] == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(response[SIDE : 20 - SIDE], math.sqrt(0.5))
    assert (response[:SIDE] == 0.0).all()
    assert (response[-SIDE:] == 0.0).all()


@given(st.floats(-3.1, 3.1))
def test_a_corner_that_turns_otherwise_scores_the_cosine_of_half_the_difference(
    contour_of: Maker, corner_of: Callable[..., Floats], turn: float
) -> None:
    contour = contour_of(corner_of(turn, 12), spacing=0.05)
    printed = MatchedFilter(adapted=False, side=SIDE * 0.05).respond(contour)[12]
    assert printed == pytest.approx(abs(math.cos(0.5 * (math.pi / 2 - abs(turn)))), abs=1e-9)
    for template in (45.0, 120.0):
        filtered = bank(template).respond(contour)[12]
        expected = abs(math.cos(0.5 * (math.radians(template) - abs(turn))))
        assert score(filtered, math.radians(template)) == pytest.approx(
            max(expected, math.cos(0.5 * math.radians(template))), abs=1e-9
        )


def test_the_margin_of_a_wall_is_nothing_on_every_template(contour_of: Maker) -> None:
    wall = np.stack([np.arange(60) * 0.03, np.arange(60) * 0.04], axis=1)
    np.testing.assert_allclose(MatchedFilter().respond(contour_of(wall, spacing=0.05)), 0.0, atol=1e-9)


def test_the_bank_takes_the_best_of_its_templates(contour_of: Maker) -> None:
    points = np.cumsum(np.random.default_rng(0).normal(0.04, 0.02, (80, 2)), axis=0)
    contour = contour_of(points, spacing=0.05)
    alone = [bank(turn).respond(contour) for turn in (45.0, 90.0, 120.0)]
    np.testing.assert_allclose(bank(45.0, 90.0, 120.0).respond(contour), np.max(alone, axis=0))


def twin(points: Floats, closed: bool, turns: list[float], margin: bool) -> list[float]:
    """Equations (12) and (13) on complex elementary vectors, for both ways to turn."""
    c = [complex(x, y) for x, y in points]
    n = len(c)
    out = [0.0] * n
    for i in range(n):
        if not closed and not SIDE <= i < n - SIDE:
            continue
        v = [c[(i + k + 1) % n] - c[(i + k) % n] for k in range(-SIDE, SIDE)]

        def p(q: int, z: int, v: list[complex]) -> complex:  # (12)
            return sum(v[z:q], 0j) / math.sqrt(sum(abs(x) ** 2 for x in v[z:q]))

        for turn in turns:
            for interior in (math.pi - turn, turn - math.pi):
                laid = [*v[:SIDE], *(-cmath.exp(-1j * interior) * x for x in v[SIDE:])]
                eta = abs(p(SIDE, 0, laid) + p(2 * SIDE, SIDE, laid)) / (2.0 * math.sqrt(SIDE))  # (13)
                wall = math.cos(0.5 * turn)
                out[i] = max(out[i], (eta - wall) / (1.0 - wall) if margin else eta)
    return out


@given(st.integers(0, 10_000), st.booleans(), st.booleans())
def test_the_kernel_agrees_with_the_printed_equations(
    contour_of: Maker, seed: int, closed: bool, adapted: bool
) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0.0, 0.05, (int(rng.integers(2 * SIDE + 1, 50)), 2)), axis=0)
    detector = MatchedFilter(adapted=adapted, side=SIDE * 0.05)
    turns = list(np.radians(detector.turns_deg)) if adapted else [math.pi / 2]
    expected = twin(points, closed, turns, adapted)
    np.testing.assert_allclose(detector.respond(contour_of(points, closed=closed, spacing=0.05)), expected, atol=1e-9)
