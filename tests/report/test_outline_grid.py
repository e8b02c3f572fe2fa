"""The grid of keyframes' contours."""

import numpy as np

from contourslam.report.occupancy import FREE, OCCUPIED, UNKNOWN
from contourslam.report.outline_grid import outline_grid

WALL = np.stack([np.full(21, 2.0), np.linspace(-1.0, 1.0, 21)], axis=1).astype(np.float32)


def cell(grid_cells: np.ndarray, origin: tuple[float, float], x: float, y: float) -> int:
    return int(grid_cells[int((y - origin[1]) / 0.05), int((x - origin[0]) / 0.05)])


def test_a_wall_is_occupied_what_lies_before_it_is_free_and_what_lies_behind_unknown() -> None:
    # The base stands at (3, 1) and looks along y; the lidar is half a metre ahead of it.
    grid = outline_grid(np.array([[3.0, 1.0, np.pi / 2.0]]), [WALL], lidar_mount=np.array([0.5, 0.0, 0.3]))
    cells, origin = grid.cells()
    assert cell(cells, origin, 3.02, 3.02) == OCCUPIED
    assert cell(cells, origin, 3.02, 2.0) == FREE
    assert origin[1] > 1.4  # nothing is seen from the base itself
    assert cell(cells, origin, 2.1, 1.6) == UNKNOWN


def test_a_keyframe_that_moves_takes_its_walls_along() -> None:
    before, after = (outline_grid(np.array([[x, 0.0, 0.0]]), [WALL], lidar_mount=np.zeros(3)) for x in (0.0, 1.0))
    np.testing.assert_array_equal(before.cells()[0], after.cells()[0])
    assert after.cells()[1][0] - before.cells()[1][0] == 1.0


def test_no_keyframes_give_a_grid_that_knows_nothing() -> None:
    grid = outline_grid(np.empty((0, 3)), [], lidar_mount=np.zeros(3))
    assert grid.cells()[0].tolist() == [[UNKNOWN]]
