import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.poses import compose_one
from contourslam.matching.cell_map import CELL, MOST_POINTS, REACH, TILE, CellMap, nearest
from contourslam.matching.oriented import move

Floats = NDArray[np.float64]
ORIGIN = np.zeros(3)


def scattered(seed: int, n: int, size: float) -> Floats:
    """Points all over a square, too far apart to be averaged, each with a normal of its own."""
    chance, step = np.random.default_rng(seed), 3.0 * CELL
    axis = np.arange(-size, size, step)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    points = chance.permutation(grid + chance.uniform(-0.3 * step, 0.3 * step, grid.shape))[:n]
    angles = chance.uniform(-math.pi, math.pi, len(points))
    return np.column_stack([points, np.cos(angles), np.sin(angles)])


def ask(cells: CellMap, x: float, y: float) -> int:
    return nearest(cells.index, cells.tiles, x - cells.x0, y - cells.y0)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 1000), n=st.integers(1, 200), size=st.sampled_from([0.3, 1.0, 4.0]))
def test_the_table_gives_the_point_nearest_to_the_middle_of_each_cell(seed: int, n: int, size: float) -> None:
    cells = CellMap(ORIGIN, 6.0)
    cells.insert(scattered(seed, n, size), ORIGIN)
    points = cells.points[:, :2]
    for x, y in np.random.default_rng(seed).uniform(-size - 0.5, size + 0.5, (60, 2)):
        corner = np.array([cells.x0, cells.y0])
        middle = (np.floor((np.array([x, y]) - corner) / CELL) + 0.5) * CELL + corner
        distances = np.hypot(*(points - middle).T)
        found = ask(cells, x, y)
        if distances.min() < (REACH - 1) * CELL:
            assert found >= 0
        if found >= 0:
            assert distances[found] <= REACH * CELL + 1e-9
            assert distances[found] == pytest.approx(distances.min(), abs=1e-9)


def test_a_surface_seen_again_is_averaged_and_does_not_grow_the_map() -> None:
    chance, x = np.random.default_rng(0), np.arange(-2.0, 2.0, 0.05) + 0.017
    cells = CellMap(ORIGIN, 5.0)
    for _ in range(20):
        y = 1.0 + 0.01 * chance.standard_normal(len(x))
        cells.insert(np.column_stack([x, y, np.zeros(len(x)), -np.ones(len(x))]), ORIGIN)
    seen = cells.points[cells.points[:, 4] > 15.0]
    assert len(cells.points) < 1.3 * len(x)
    assert seen[:, 1].std() < 0.005
    assert seen[:, 1].mean() == pytest.approx(1.0, abs=0.003)
    np.testing.assert_allclose(np.hypot(seen[:, 2], seen[:, 3]), 1.0)


def test_the_two_sides_of_a_thin_wall_stay_apart() -> None:
    x = np.arange(-1.0, 1.0, 0.05)
    cells = CellMap(ORIGIN, 5.0)
    for side in (-1.0, 1.0):
        y = np.full(len(x), 0.01 * side)
        cells.insert(np.column_stack([x, y, np.zeros(len(x)), np.full(len(x), side)]), ORIGIN)
    np.testing.assert_allclose(np.abs(cells.points[:, 3]), 1.0)
    assert {-1.0, 1.0} == set(np.round(cells.points[:, 3]))


def test_points_beyond_the_table_are_left_out() -> None:
    far = np.array([[100.0, 0.0, -1.0, 0.0], [0.0, -100.0, 0.0, 1.0], [1.0, 1.0, -1.0, 0.0], [np.nan, 0.0, 1.0, 0.0]])
    cells = CellMap(ORIGIN, 4.0)
    cells.insert(far, ORIGIN)
    assert cells.points[:, :2].tolist() == [[1.0, 1.0]]
    assert ask(cells, 100.0, 0.0) == ask(cells, -1e6, 1e6) == -1


def test_growing_tables_keep_what_they_knew() -> None:
    cells = CellMap(ORIGIN, 40.0)
    first = scattered(5, 300, 2.0)
    cells.insert(first, ORIGIN)
    held, tiles, capacity = cells.points.copy(), len(cells.tiles), len(cells.rows)
    answers = [ask(cells, x, y) for x, y in first[:, :2]]
    for k in range(8):
        cells.insert(scattered(k, 500, 2.0), np.array([20.0 * math.cos(k), 20.0 * math.sin(k), 0.0]))
    assert len(cells.tiles) > tiles
    assert len(cells.rows) > capacity
    np.testing.assert_array_equal(cells.points[: len(held)], held)
    assert [ask(cells, x, y) for x, y in first[:, :2]] == answers


@given(x=st.floats(-1.0, 1.0), y=st.floats(-1.0, 1.0), turn=st.floats(-3.0, 3.0))
def test_where_a_scan_is_taken_in_from_does_not_matter(x: float, y: float, turn: float) -> None:
    grid = np.stack(np.meshgrid(np.arange(-1.0, 1.0, 0.2), np.arange(-1.0, 1.0, 0.2)), axis=-1).reshape(-1, 2)
    world = np.column_stack([grid, np.ones(len(grid)), np.zeros(len(grid))])
    pose = np.array([x, y, turn])
    back = compose_one(np.array([0.0, 0.0, -turn]), np.array([-x, -y, 0.0]))
    cells = CellMap(ORIGIN, 3.0)
    cells.insert(move(world, back), pose)
    np.testing.assert_allclose(cells.points[:, :4], world, atol=1e-9)
    assert cells.index.shape[0] * TILE * CELL >= 6.0


def test_a_large_map_holds_what_the_small_one_has_no_numbers_for() -> None:
    points = scattered(0, MOST_POINTS + 2000, 15.0)
    small, large = CellMap(ORIGIN, 16.0), CellMap(ORIGIN, 16.0, large=True)
    small.insert(points, ORIGIN)
    large.insert(points, ORIGIN)
    assert small.count == MOST_POINTS
    assert large.count == len(points)
    assert ask(large, *points[-1, :2]) == len(points) - 1
