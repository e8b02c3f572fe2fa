import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.poses import between_one, compose_one
from contourslam.matching.align import align
from contourslam.matching.cell_map import CellMap, nearest
from contourslam.matching.certainty import Hold, exposure, hold, match_covariance, pull
from contourslam.matching.oriented import move

Floats = NDArray[np.float64]
See = Callable[..., Floats]
SHARP = Hold(1e12 * np.eye(3), 1e-4)


def gradient(cells: CellMap, scan: Floats, pose: Floats) -> tuple[Floats, Floats]:
    """The pull on a whole scan, and its parts."""
    pulls, parts = np.empty((4, 3)), np.empty((4, 3, 3))
    pull(cells.index, cells.tiles, cells.rows, cells.x0, cells.y0, scan, pose, 0.0, pulls, parts)
    return pulls.sum(axis=0), parts.sum(axis=0)


def test_the_pull_is_the_gradient_of_the_robust_sum(see: See, room: Floats) -> None:
    chance, cells = np.random.default_rng(0), CellMap(np.zeros(3), 20.0)
    cells.insert(see(room, (0.0, 0.0, 0.0), chance), np.zeros(3))
    scan = see(room, (0.3, 0.1, 0.2), chance)
    pose = np.array([0.31, 0.11, 0.19])
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    points = scan[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
    found = np.array([nearest(cells.index, cells.tiles, x - cells.x0, y - cells.y0) for x, y in points])
    rows = cells.points[found]
    normals = move(scan, pose)[:, 2:]
    paired = (found >= 0) & ((normals * rows[:, 2:4]).sum(axis=1) >= 0.7)

    def cost(at: Floats) -> float:
        c, s = np.cos(at[2]), np.sin(at[2])
        d = (((scan[:, :2] @ np.array([[c, s], [-s, c]]) + at[:2]) - rows[:, :2]) * rows[:, 2:4]).sum(axis=1)[paired]
        # Geman and McClure's kernel: its derivative is weight times distance.
        return float((0.5 * d**2 / (1.0 + (d / 0.05) ** 2)).sum())

    steps = 1e-6 * np.eye(3)
    expected = [(cost(pose + s) - cost(pose - s)) / 2e-6 for s in steps]
    np.testing.assert_allclose(gradient(cells, scan, pose)[0], expected, atol=2e-4 * np.abs(expected).max() + 1e-6)


@pytest.mark.parametrize("sigma", [0.005, 0.01, 0.02])
def test_the_stated_covariance_is_that_of_many_matches(see: See, room: Floats, sigma: float) -> None:
    chance, errors, values = np.random.default_rng(2), [], []
    for _ in range(12):
        cells, anchor = CellMap(np.zeros(3), 20.0), np.array([-0.5, 0.2, 0.3])
        first = see(room, anchor, chance, sigma=sigma)
        poses = [anchor, *(np.array([0.3 * k - 0.5, 0.1 * k, 0.2 * k]) for k in range(1, 5))]
        cells.insert(first, anchor)
        for pose in poses[1:]:  # each aligned to those before, as contour odometry does
            scan = see(room, pose, chance, sigma=sigma)
            cells.insert(scan, align(scan, cells, pose, np.zeros((3, 3))).pose)
        for pose in (np.array([0.6, 0.1, -0.4]), np.array([1.0, -0.5, 2.0]), np.array([-1.0, 1.0, 0.1])):
            scan = see(room, pose, chance, sigma=sigma)
            found = align(scan, cells, pose, np.zeros((3, 3))).pose
            error = between_one(between_one(anchor, pose), between_one(anchor, found))
            covariance = match_covariance(
                hold(scan, cells, found), found, hold(first, cells, anchor, inside=True), anchor
            )
            errors.append(error)
            values.append(error @ np.linalg.solve(covariance, error))
    assert 0.3 < np.mean(values) < 4.0  # on the safe side where nothing but the noise errs
    assert np.abs(np.mean(errors, axis=0)).max() < 0.003


def test_noise_makes_the_hold_weaker(see: See, room: Floats) -> None:
    spreads = []
    for sigma in (0.005, 0.02):
        chance, cells = np.random.default_rng(3), CellMap(np.zeros(3), 20.0)
        for x in (-0.5, 0.0, 0.5):
            cells.insert(see(room, (x, 0.0, 0.0), chance, sigma=sigma), np.array([x, 0.0, 0.0]))
        found = hold(see(room, (0.2, 0.0, 0.0), chance, sigma=sigma), cells, np.array([0.2, 0.0, 0.0]))
        spreads.append(np.sqrt(np.diag(found.covariance(found.variance, 0.0))))
    assert (spreads[1] > 1.5 * spreads[0]).all()


def test_a_bare_corridor_leaves_the_way_along_it_open(see: See, corridor: Floats) -> None:
    along, across = [], []
    for seed in range(10):
        chance, cells = np.random.default_rng(seed), CellMap(np.zeros(3), 40.0)
        for x in np.arange(0.0, 3.0, 0.4):
            cells.insert(see(corridor, (x, 0.0, 0.0), chance), np.array([x, 0.0, 0.0]))
        pose = np.array([2.0, 0.1, 0.5])
        found = hold(see(corridor, pose, chance), cells, pose)
        values, vectors = np.linalg.eigh(found.covariance(found.variance, 0.0)[:2, :2])
        along.append(math.sqrt(values[1]))
        across.append(math.sqrt(values[0]))
        assert abs(vectors[:, 1] @ [math.cos(0.5), -math.sin(0.5)]) > math.cos(math.radians(3.0))
    assert np.median(along) > 0.5
    assert np.max(across) < 0.01


def test_what_only_the_first_scan_leaves_open_is_open() -> None:
    blind = Hold(np.diag([0.0, 1e8, 1e8]), 1e-4)
    turned_by = np.array([0.0, 0.0, math.pi / 2])
    covariance = match_covariance(SHARP, turned_by, blind, np.zeros(3))
    assert covariance[1, 1] > 50.0  # its x axis is the other's -y axis
    assert covariance[0, 0] < 1e-4


@given(x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0), turn=st.floats(-3.0, 3.0))
def test_the_first_scans_error_of_heading_swings_the_second_about(x: float, y: float, turn: float) -> None:
    anchor, pose, blur = np.array([1.0, -2.0, 0.7]), np.array([x, y, turn]), 1e-4
    covariance = match_covariance(SHARP, pose, SHARP, anchor, blur)
    step = 1e-6
    wrong = between_one(compose_one(anchor, np.array([0.0, 0.0, step])), pose)
    swing = between_one(between_one(anchor, pose), wrong) / step
    expected = blur * (np.outer(swing, swing) + np.diag([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(covariance, expected, atol=5e-6 + 1e-5 * np.hypot(*(pose - anchor)[:2]))


def test_the_covariance_does_not_depend_on_where_the_map_lies(see: See, room: Floats) -> None:
    chance, pose = np.random.default_rng(5), np.array([0.4, 0.2, 0.3])
    first, second = see(room, (0.0, 0.0, 0.0), chance), see(room, pose, chance)
    found = []
    for shift in (np.zeros(3), np.array([7.0, -3.0, 1.2])):
        cells = CellMap(shift, 20.0)
        for _ in range(2):
            cells.insert(first, shift)
        there = compose_one(shift, pose)
        found.append(match_covariance(hold(second, cells, there), there, hold(first, cells, shift), shift))
    spread = np.sqrt(np.outer(np.diag(found[0]), np.diag(found[0])))
    assert (np.abs(found[0] - found[1]) < 0.7 * spread).all()  # the cells lie otherwise, and so do the averages


def test_nothing_to_hold_on_to_leaves_all_open_and_nothing_undefined() -> None:
    cells = CellMap(np.zeros(3), 10.0)
    for scan in (np.empty((0, 4)), np.array([[1.0, 0.0, -1.0, 0.0]])):
        found = hold(scan, cells, np.zeros(3))
        np.testing.assert_allclose(np.diag(found.covariance(found.variance, 0.0)), [100.0, 100.0, 1.0], rtol=1e-3)


def test_exposure_is_the_variance_of_an_averaged_walk() -> None:
    chance = np.random.default_rng(0)
    walks = np.cumsum(chance.normal(0.0, 1.0, (20_000, 100)), axis=1) / 10.0  # of variance 1 after 100 steps
    for first, last in ((0, 100), (25, 75)):
        offsets = np.linspace(first, last, 20) / 100
        assert exposure(offsets, 1.0) == pytest.approx(walks[:, first:last].mean(axis=1).var(), rel=0.05)
    assert exposure(np.zeros(10), 0.2) == exposure(np.empty(0), 0.2) == exposure(np.ones(3), math.inf) == 0.0
    assert exposure(-np.linspace(0.0, 0.2, 5), 0.2) == pytest.approx(1.0 / 3.0)
