"""Surfaces that two maps share and walls that one saw through: counted as plain NumPy counts them."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.geometry.poses import transform
from contourslam.joining.chart import Chart
from contourslam.joining.overlay import LOOK_ALIKE, SQUARE, TOUCHES, Overlay, Surfaces
from contourslam.localization.free_space import CELL
from contourslam.maps.saved_map import SavedMap
from contourslam.matching.cell_map import nearest
from contourslam.matching.squares import squares_of

Floats = NDArray[np.float64]

ROOM = ((0, 0), (7, 0), (7, 4), (3, 4), (3, 5), (0, 5))
WAY = ((1.0, 1.0), (5.5, 1.0), (5.5, 3.0), (1.5, 3.5))
WALLED = ((4.4, 0.0), (4.4, 4.0), (4.5, 4.0), (4.5, 0.0))  # across the room


@pytest.fixture(scope="module")
def plain(room: Callable[..., Floats], walked: Callable[..., SavedMap]) -> Surfaces:
    return Chart(walked(room(ROOM), WAY, seed=1)).surfaces


@pytest.fixture(scope="module")
def walled(room: Callable[..., Floats], walked: Callable[..., SavedMap]) -> Surfaces:
    return Chart(walked(room(ROOM, WALLED), ((1.0, 1.0), (3.4, 1.2), (3.4, 3.0), (1.5, 3.5)), seed=2)).surfaces


def counted(against: Surfaces, points: Floats, pose: Floats) -> tuple[int, int]:
    """The twin of the kernel."""
    cells, clear = against.cells, against.clear
    turned = transform(np.array([0.0, 0.0, pose[2]]), points[:, 2:])
    touching = amid = 0
    for spot, normal in zip(transform(pose, points[:, :2]), turned, strict=True):
        near = nearest(cells.index, cells.tiles, spot[0] - cells.x0, spot[1] - cells.y0)
        if near >= 0:
            row = cells.rows[near]
            touching += bool(normal @ row[2:4] > LOOK_ALIKE and abs(row[2:4] @ (spot - row[:2])) < TOUCHES)
            continue
        i, j = np.floor((spot - (clear.x0, clear.y0)) / CELL).astype(int)
        inside = 0 <= i < clear.free.shape[1] and 0 <= j < clear.free.shape[0]
        amid += bool(inside and clear.free[j, i])
    return touching, amid


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.6, -0.3, 0.4), (-2.0, 1.0, 3.0)])
def test_surfaces_are_counted_as_numpy_counts_them(plain: Surfaces, walled: Surfaces, pose: tuple[float, ...]) -> None:
    overlay, at = Overlay(plain, walled), np.array(pose)
    back = np.array([*transform(np.array([0.0, 0.0, -at[2]]), -at[:2]), -at[2]])
    agreeing, amid = counted(plain, walled.points, at)
    found, through = counted(walled, plain.points, back)
    tally = overlay.tally(at)
    assert tally.agreeing == pytest.approx(SQUARE * agreeing)
    assert tally.found == pytest.approx(SQUARE * found)
    assert tally.through == pytest.approx(SQUARE * (amid + through))


def test_a_map_agrees_with_itself_and_contradicts_nothing(plain: Surfaces) -> None:
    tally = Overlay(plain, plain).tally(np.zeros(3))
    assert tally.through == 0.0
    assert tally.agreeing == pytest.approx(SQUARE * len(plain.points), rel=0.02)
    assert tally.worth == pytest.approx(tally.agreeing)


def test_a_wall_across_a_room_is_seen_through(plain: Surfaces, walled: Surfaces) -> None:
    tally = Overlay(plain, walled).tally(np.zeros(3))
    assert tally.through > 2.0  # of four metres; not where it meets the walls
    assert tally.contradicted > 0.05


def test_a_shift_turns_a_map_about_its_middle(plain: Surfaces) -> None:
    overlay = Overlay(plain, plain)
    shift = np.array([0.5, -0.2, 2.0])
    pose = overlay.shifted(shift)
    assert transform(pose, overlay.centre) == pytest.approx(overlay.centre + shift[:2])
    assert overlay.shift(pose) == pytest.approx(shift)


def test_many_poses_are_worth_what_each_is_worth(plain: Surfaces, walled: Surfaces) -> None:
    overlay = Overlay(plain, walled)
    poses = overlay.shifted(np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.0, 1.0, math.pi]]))
    each = [overlay.tally(pose) for pose in poses]
    assert overlay.worths(poses, 10**6) == pytest.approx([tally.worth for tally in each])


def test_squares_tell_apart_where_points_lie_and_the_way_they_look() -> None:
    chance = np.random.default_rng(3)
    points = chance.uniform(-40.0, 40.0, (500, 2))
    angles = chance.uniform(-math.pi, math.pi, 500)
    rows = np.column_stack([points, np.cos(angles), np.sin(angles)])
    plain = np.column_stack([np.floor(points / 5.0), np.floor(angles * 4.0 / math.pi + 0.5) % 8])
    _, kind = np.unique(plain, axis=0, return_inverse=True)
    _, found = np.unique(squares_of(rows, 5.0), return_inverse=True)
    assert len(set(zip(kind.tolist(), found.tolist(), strict=True))) == kind.max() + 1 == found.max() + 1
