import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.contour import Contours, equalize
from contourslam.errors import ConfigError

Floats = NDArray[np.float64]
Maker = Callable[..., Contours]


def wander(seed: int, n: int) -> Floats:
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0.0, 0.4, n))
    step = rng.exponential(0.05, n)
    return np.cumsum(np.stack([step * np.cos(heading), step * np.sin(heading)], axis=1), axis=0)


def lengths(points: Floats) -> Floats:
    return np.hypot(*np.diff(points, axis=0).T)


def as_the_paper_has_it(gamma: list[complex], p: int) -> list[complex]:
    """Equations (3) to (11), with the rest and the used part as vectors."""
    epsilon = sum(abs(v) for v in gamma) / p  # (3)
    pieces: list[complex] = []
    n, rest = 0, gamma[0]
    for _ in range(p):
        if abs(rest) >= epsilon:  # (4)
            piece = epsilon * rest / abs(rest)  # (5)
            rest -= piece  # (6)
        else:
            t, full = 1, 0j
            reached = abs(rest)
            while n + t < len(gamma) and reached + abs(gamma[n + t]) < epsilon:  # (7)
                reached += abs(gamma[n + t])
                full += gamma[n + t]
                t += 1
            if n + t == len(gamma):  # rounding ate the last bit of the last piece
                pieces.append(rest + full)
                break
            length = epsilon - reached  # (8)
            used = gamma[n + t] / abs(gamma[n + t]) * length  # (9), along the unit vector of gamma
            piece = rest + used + full  # (10)
            rest = gamma[n + t] - used  # (11)
            n += t
        pieces.append(piece)
    return pieces


@given(st.integers(0, 10_000), st.integers(2, 60), st.floats(0.01, 0.6))
def test_the_pieces_are_those_of_the_papers_equations(contour_of: Maker, seed: int, n: int, spacing: float) -> None:
    points = wander(seed, n)
    gamma = np.diff(points[:, 0] + 1j * points[:, 1])
    total = np.abs(gamma).sum()
    assume(abs(total / spacing % 1.0 - 0.5) > 1e-6)
    p = max(round(total / spacing), 1)
    even = equalize(contour_of(points), spacing)
    expected = as_the_paper_has_it(list(gamma), p)
    np.testing.assert_allclose(np.diff(even.points[:, 0] + 1j * even.points[:, 1]), expected, atol=1e-9)
    assert len(even.points) == p + 1


@given(st.integers(0, 10_000), st.integers(2, 60), st.floats(0.01, 0.6))
def test_a_piece_is_never_longer_than_its_arc_and_the_pieces_sum_to_the_whole(
    contour_of: Maker, seed: int, n: int, spacing: float
) -> None:
    points = wander(seed, n)
    even = equalize(contour_of(points), spacing)
    epsilon = lengths(points).sum() / (len(even.points) - 1)
    assert (lengths(even.points) <= epsilon * (1.0 + 1e-9)).all()
    np.testing.assert_array_equal(even.points[[0, -1]], points[[0, -1]])


def test_on_a_straight_contour_every_piece_has_the_arcs_length(contour_of: Maker) -> None:
    along = np.cumsum(np.random.default_rng(0).uniform(0.001, 0.2, 40))
    even = equalize(contour_of(np.stack([along * 0.6, along * 0.8], axis=1)), 0.06)
    np.testing.assert_allclose(lengths(even.points), (along[-1] - along[0]) / (len(even.points) - 1))
    assert even.spacing == 0.06


def test_a_ring_keeps_its_length_and_its_pieces_sum_to_nothing(contour_of: Maker) -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 101)[:-1]
    ring = np.stack([2.0 * np.cos(angle), 2.0 * np.sin(angle)], axis=1)
    even = equalize(contour_of(ring, closed=True), 0.1)
    assert even.closed[0]
    assert len(even.points) == round(np.hypot(*(ring - np.roll(ring, 1, axis=0)).T).sum() / 0.1)
    steps = np.roll(even.points, -1, axis=0) - even.points
    np.testing.assert_allclose(np.hypot(*steps.T), 0.1, rtol=5e-3)
    assert np.linalg.norm(even.points - np.roll(even.points, 1, axis=0), axis=1).min() > 0.09
    assert even.source.max() < 100.0


@given(st.integers(0, 1000), st.floats(-4.0, 4.0), st.floats(0.1, 10.0))
def test_equalization_commutes_with_translation_rotation_and_scale(
    contour_of: Maker, seed: int, turn: float, scale: float
) -> None:
    points = wander(seed, 30)
    total = lengths(points).sum()
    spacing = total / 17.2
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])

    def moved(rows: Floats) -> Floats:
        return scale * rows @ rotation.T + [3.0, -8.0]

    even, other = equalize(contour_of(points), spacing), equalize(contour_of(moved(points)), scale * spacing)
    np.testing.assert_allclose(other.points, moved(even.points), atol=1e-8)
    np.testing.assert_allclose(other.source, even.source, atol=1e-6)


@given(st.integers(0, 1000), st.floats(0.01, 0.5))
def test_the_source_says_where_on_the_raw_contour_a_point_lies(contour_of: Maker, seed: int, spacing: float) -> None:
    points = wander(seed, 30)
    even = equalize(contour_of(points), spacing)
    index = np.minimum(even.source.astype(int), 28)
    part = (even.source - index)[:, None]
    np.testing.assert_allclose(even.points, points[index] * (1.0 - part) + points[index + 1] * part, atol=1e-9)
    assert (np.diff(even.source) >= 0.0).all()


def several(parts: list[Floats]) -> Contours:
    starts = np.cumsum([0, *map(len, parts)])
    flat = np.concatenate(parts)
    return Contours(flat, starts, np.zeros(len(parts), np.bool_), 0.0, np.arange(len(flat), dtype=float))


@pytest.mark.parametrize("average_below", [0.0, 0.08])
def test_each_contour_is_equalized_by_itself_and_its_source_stays_within_it(
    contour_of: Maker, average_below: float
) -> None:
    parts = [wander(seed, n) for seed, n in enumerate([5, 60, 2, 33])]
    raw = several(parts)
    even = equalize(raw, 0.07, average_below=average_below)
    for i, part in enumerate(parts):
        alone = equalize(contour_of(part), 0.07, average_below=average_below)
        np.testing.assert_array_equal(even[i], alone.points)
        np.testing.assert_allclose(even.source[even.starts[i] : even.starts[i + 1]], alone.source + raw.starts[i])


def test_a_contour_without_length_has_no_points_and_its_neighbours_keep_theirs() -> None:
    parts = [np.zeros((1, 2)), wander(1, 20), np.ones((4, 2)), wander(2, 20)]
    even = equalize(several(parts), 0.05)
    sizes = np.diff(even.starts)
    assert sizes[0] == sizes[2] == 0
    assert min(sizes[1], sizes[3]) > 3
    assert len(equalize(several([np.empty((0, 2))]), 0.05).points) == 0


def test_far_more_pieces_than_raw_points_are_no_trouble(contour_of: Maker) -> None:
    even = equalize(contour_of([[0.0, 0.0], [10.0, 0.0]]), 0.001)
    np.testing.assert_allclose(even.points[:, 0], np.linspace(0.0, 10.0, 10_001), atol=1e-9)


def test_repeated_points_change_nothing(contour_of: Maker) -> None:
    points = wander(4, 25)
    twice = equalize(contour_of(np.repeat(points, 3, axis=0)), 0.05)
    np.testing.assert_allclose(twice.points, equalize(contour_of(points), 0.05).points, atol=1e-12)


def test_averaging_gives_a_noisy_wall_its_true_length_and_keeps_its_ends(contour_of: Maker) -> None:
    rng = np.random.default_rng(0)
    wall = np.stack([np.linspace(0.0, 3.0, 600), 0.01 * rng.standard_normal(600)], axis=1)
    raw, averaged = (equalize(contour_of(wall), 0.06, average_below=below) for below in (0.0, 0.06))
    assert len(raw.points) > 2 * 51  # the points are nearer to each other than the noise is large
    assert 50 <= len(averaged.points) <= 53
    np.testing.assert_array_equal(averaged.points[[0, -1]], wall[[0, -1]])
    assert averaged.points[1:-1, 1].std() < 0.004
    np.testing.assert_allclose(averaged.source, averaged.points[:, 0] / 3.0 * 599, atol=8.0)


@pytest.mark.parametrize("spacing", [0.0, -0.1, math.nan])
def test_a_spacing_that_is_not_positive_is_an_error(contour_of: Maker, spacing: float) -> None:
    with pytest.raises(ConfigError, match="spacing of an equalized contour must be positive"):
        equalize(contour_of(wander(0, 10)), spacing)
