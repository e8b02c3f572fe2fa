import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.poses import between_one, compose_one
from contourslam.matching.align import POINT_SIGMA, align
from contourslam.matching.cell_map import CellMap

Floats = NDArray[np.float64]
See = Callable[..., Floats]
FREE, TIGHT = np.zeros((3, 3)), np.diag([1e8, 1e8, 1e8])


def mapped(see: See, walls: Floats, seed: int = 0, *, sigma: float = 0.01) -> CellMap:
    """The map that nine scans from around the origin make."""
    chance, cells = np.random.default_rng(seed), CellMap(np.zeros(3), 40.0)
    for x in (-1.0, 0.0, 1.0):
        for y in (-0.5, 0.0, 0.5):
            cells.insert(see(walls, (x, y, 0.3 * x), chance, sigma=sigma), np.array([x, y, 0.3 * x]))
    return cells


@pytest.fixture(scope="module")
def cells(see: See, room: Floats) -> CellMap:
    return mapped(see, room)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 1000),
    pose=st.tuples(st.floats(-1.0, 1.0), st.floats(-0.6, 0.6), st.floats(-3.1, 3.1)),
    off=st.tuples(st.floats(-0.12, 0.12), st.floats(-0.12, 0.12), st.floats(-0.08, 0.08)),
)
def test_a_scan_finds_its_pose_from_some_way_off(
    see: See,
    room: Floats,
    cells: CellMap,
    seed: int,
    pose: tuple[float, float, float],
    off: tuple[float, float, float],
) -> None:
    scan = see(room, pose, np.random.default_rng(seed))
    found = align(scan, cells, compose_one(np.array(pose), np.array(off)), FREE)
    error = between_one(np.array(pose), found.pose)
    assert math.hypot(error[0], error[1]) < 0.012
    assert abs(error[2]) < math.radians(0.4)
    assert found.overlap > 0.9
    assert 0.003 < found.residual < 0.02
    assert found.pairs == round(found.overlap * len(scan))


def test_the_information_is_that_of_the_distances_derivatives(see: See, room: Floats, cells: CellMap) -> None:
    scan = see(room, (0.2, 0.1, 0.5), np.random.default_rng(1), sigma=0.0)
    found = align(scan, cells, np.array([0.2, 0.1, 0.5]), FREE)

    def residuals(pose: Floats, rows: NDArray[np.int64]) -> Floats:
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        points = scan[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
        return np.asarray(((points - cells.points[rows, :2]) * cells.points[rows, 2:4]).sum(axis=1))

    cos, sin = np.cos(found.pose[2]), np.sin(found.pose[2])
    points = scan[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + found.pose[:2]
    rows = np.array([np.hypot(*(cells.points[:, :2] - p).T).argmin() for p in points])
    step = 1e-6 * np.eye(3)
    slopes = [(residuals(found.pose + s, rows) - residuals(found.pose - s, rows)) / 2e-6 for s in step]
    weights = 1.0 / (1.0 + (residuals(found.pose, rows) / 0.05) ** 2) ** 2 / POINT_SIGMA**2
    expected = np.einsum("in,n,jn->ij", slopes, weights, slopes)
    # The table's nearest point is the cell's, now and then another than the point's own.
    np.testing.assert_allclose(found.information, expected, rtol=0.05, atol=0.03 * expected.max())


def test_along_a_bare_corridor_the_prior_decides(see: See, corridor: Floats) -> None:
    corridor_map = mapped(see, corridor)
    scan = see(corridor, (0.0, 0.1, 0.05), np.random.default_rng(3))
    guess, prior = np.array([0.3, 0.15, 0.0]), np.diag([1.0 / 0.02**2, 1.0, 1.0])
    found = align(scan, corridor_map, guess, prior)
    assert found.pose[0] == pytest.approx(0.3, abs=0.03)
    assert found.pose[1:] == pytest.approx([0.1, 0.05], abs=0.008)
    values = np.linalg.eigvalsh(found.information[:2, :2])
    assert values[0] < 0.05 * values[1]


def test_a_tight_prior_holds_and_its_mean_need_not_be_where_one_begins(see: See, room: Floats, cells: CellMap) -> None:
    scan = see(room, (0.0, 0.0, 0.0), np.random.default_rng(4))
    mean = np.array([0.05, -0.04, 0.02])
    found = align(scan, cells, np.zeros(3), TIGHT, mean=mean)
    np.testing.assert_allclose(found.pose, mean, atol=2e-3)


def test_headings_are_compared_the_short_way_round(see: See, room: Floats, cells: CellMap) -> None:
    scan = see(room, (0.0, 0.0, math.pi - 0.01), np.random.default_rng(5))
    found = align(scan, cells, np.array([0.0, 0.0, -math.pi + 0.01]), np.diag([1.0, 1.0, 1e4]))
    assert abs(between_one(np.array([0.0, 0.0, math.pi]), found.pose)[2]) < 0.02


def test_without_points_or_without_a_map_the_guess_stays(see: See, room: Floats, cells: CellMap) -> None:
    guess, prior = np.array([0.1, 0.2, 0.3]), np.diag([1.0, 1.0, 1.0])
    scan = see(room, (0.0, 0.0, 0.0), np.random.default_rng(6))
    for oriented, against in ((np.empty((0, 4)), cells), (scan, CellMap(np.zeros(3), 10.0)), (scan + 1e3, cells)):
        for information in (prior, FREE):
            found = align(oriented, against, guess, information)
            np.testing.assert_allclose(found.pose, guess)
            assert (found.pairs, found.overlap, found.residual) == (0, 0.0, 0.0)
            assert (found.information == 0.0).all()


def test_what_stands_in_front_of_a_wall_does_not_pull(see: See, room: Floats, cells: CellMap) -> None:
    person = np.array([[1.0, 0.3, 1.3, 0.3], [1.3, 0.3, 1.3, 0.6], [1.0, 0.6, 1.0, 0.3]])
    scan = see(np.vstack([room, person]), (0.0, 0.0, 0.0), np.random.default_rng(7))
    found = align(scan, cells, np.array([0.05, 0.05, 0.02]), FREE)
    assert np.abs(found.pose[:2]).max() < 0.01
    assert found.overlap < 0.97
