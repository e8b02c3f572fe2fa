import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.errors import ResultError
from contourslam.report.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, trace_rays
from contourslam.report.run_grid import run_grid

POINT = st.tuples(st.floats(0.01, 19.99), st.floats(0.01, 19.99))


def cells_by_crossings(origin: np.ndarray, end: np.ndarray) -> set[tuple[int, int]]:
    """All (row, column) a segment visits: cut it at every grid line and ask where the pieces lie."""
    cuts = [0.0, 1.0]
    for a, b in zip(origin, end, strict=True):
        lines = np.arange(np.ceil(min(a, b)), np.floor(max(a, b)) + 1)
        cuts += list(((lines - a) / (b - a))[(lines > min(a, b)) & (lines < max(a, b))]) if a != b else []
    cuts = np.unique(cuts)
    middles = (cuts[:-1] + cuts[1:]) / 2
    points = origin + middles[:, None] * (end - origin)
    # A piece shorter than this is a corner grazed: either way round is right.
    points = points[np.diff(cuts) * np.hypot(*(end - origin)) > 1e-9]
    return {(int(row), int(column)) for column, row in np.floor(points)}


@given(POINT, POINT)
@settings(max_examples=300)
def test_a_beam_crosses_exactly_the_cells_that_its_line_does(start, stop):
    origin, end = np.array(start), np.array(stop)
    hits, passes = np.zeros((2, 20, 20), dtype=np.uint16)
    trace_rays(hits, passes, origin[None], end[None])
    last = (int(end[1]), int(end[0]))
    visited = {tuple(map(int, cell)) for cell in np.argwhere(passes)} | {last}
    expected = cells_by_crossings(origin, end)
    assert expected <= visited
    # It also makes one step a cell, so it may touch a grazed corner's cell but nothing else.
    assert len(visited) == abs(int(end[0]) - int(origin[0])) + abs(int(end[1]) - int(origin[1])) + 1
    assert hits.sum() == 1
    assert hits[last] == 1


def test_the_compiled_kernel_equals_its_python_twin():
    rng = np.random.default_rng(1)
    origins, ends = rng.uniform(0.0, 30.0, (2, 200, 2))
    counts = np.zeros((2, 2, 30, 30), dtype=np.uint16)
    trace_rays(*counts[0], origins, ends)
    trace_rays.py_func(*counts[1], origins, ends)
    np.testing.assert_array_equal(counts[0], counts[1])


def test_counts_stop_at_their_limit_and_do_not_wrap():
    hits = np.full((1, 3), 65535, dtype=np.uint16)
    passes = np.full((1, 3), 65535, dtype=np.uint16)
    trace_rays(hits, passes, np.array([[0.5, 0.5]]), np.array([[2.5, 0.5]]))
    assert hits.min() == passes.min() == 65535


def test_walls_are_occupied_the_inside_is_free_and_the_outside_unknown(make_run, room_scan):
    run = make_run()
    scans = [room_scan(pose, stamp) for pose, stamp in zip(run.truth, run.stamps, strict=True)]
    grid = run_grid(scans, run, lidar_mount=np.zeros(3))
    cells, (x, y) = grid.cells()

    def at(px: float, py: float) -> int:
        return int(cells[int((py - y) / grid.resolution), int((px - x) / grid.resolution)])

    assert at(3.0, 2.0) == FREE
    assert cells.shape[1] * grid.resolution == pytest.approx(6.0, abs=0.3)
    assert cells.shape[0] * grid.resolution == pytest.approx(4.0, abs=0.3)
    near_walls = [max(at(3.0 + dx, dy) for dy in (-0.06, -0.02, 0.02, 0.06)) for dx in np.linspace(-2.0, 2.0, 20)]
    assert near_walls.count(OCCUPIED) >= 19
    inner = cells[4:-4, 4:-4]
    assert (inner != OCCUPIED).all()


def test_the_lidar_offset_and_heading_are_used(make_run, room_scan):
    run = make_run(scans=40)
    mount = np.array([0.3, 0.1, 0.5])
    from contourslam.geometry.poses import compose

    lidars = compose(run.truth, mount)
    scans = [room_scan(pose, stamp) for pose, stamp in zip(lidars, run.stamps, strict=True)]
    right, wrong = run_grid(scans, run, lidar_mount=mount), run_grid(scans, run, lidar_mount=np.zeros(3))
    assert right.cells()[0].size < 0.85 * wrong.cells()[0].size


def test_scans_are_used_once_the_robot_has_moved(make_run, room_scan):
    run = make_run(scans=50)
    run.poses[:] = run.poses[0]
    scans = [room_scan(run.truth[0], stamp) for stamp in run.stamps]
    assert run_grid(scans, run, lidar_mount=np.zeros(3)).hits.sum() == 360


def test_beams_without_a_return_and_scans_without_a_pose_leave_no_trace(make_run, room_scan):
    run = make_run(scans=3)
    scan = room_scan(run.truth[0], stamp=12345.0)
    ranges = np.full(360, np.inf)
    ranges[:90], ranges[90:180], ranges[180:270] = np.nan, 0.0, 25.0
    blind = type(scan)(float(run.stamps[0]), scan.angles, ranges, scan.offsets, 0.05, 20.0)
    cells, _ = run_grid(["something else", scan, blind], run, lidar_mount=np.zeros(3)).cells()
    assert (cells == UNKNOWN).all()


def test_a_grid_that_grows_step_by_step_equals_one_filled_at_once():
    rng = np.random.default_rng(2)
    origins = np.cumsum(rng.normal(0.0, 1.0, (300, 2)), axis=0)
    ends = origins + rng.normal(0.0, 3.0, (300, 2))
    steps, once = OccupancyGrid(), OccupancyGrid()
    for origin, end in zip(origins, ends, strict=True):
        steps.add(origin[None], end[None])
    once.add(origins, ends)
    assert steps.cells()[1] == pytest.approx(once.cells()[1])
    np.testing.assert_array_equal(steps.cells()[0], once.cells()[0])


def test_an_area_too_large_for_its_memory_gets_coarser_cells_and_loses_no_hit():
    grid = OccupancyGrid(0.05, max_cells=40_000)
    for i in range(40):
        grid.add(np.array([[0.0, 0.0]]), np.array([[0.5 * i, 0.4 * i]]))
    assert grid.hits.size <= 40_000
    assert grid.resolution == pytest.approx(0.1)
    assert grid.hits.sum() == 40
    _, (x, y) = grid.cells()
    assert (x, y) == pytest.approx((0.0, 0.0), abs=0.2)


def test_a_broken_trajectory_is_named_and_costs_no_memory():
    grid = OccupancyGrid(max_cells=1_000_000)
    grid.add(np.zeros((1, 2)), np.ones((1, 2)))
    with pytest.raises(ResultError, match="check the trajectory"):
        grid.add(np.zeros((1, 2)), np.array([[1e9, 1e9]]))
    with pytest.raises(ResultError, match="not finite"):
        grid.add(np.zeros((1, 2)), np.array([[np.nan, 1.0]]))
    assert grid.hits.sum() == 1


@pytest.mark.parametrize("resolution", [0.0, -1.0, np.nan, np.inf])
def test_a_cell_has_a_size(resolution):
    with pytest.raises(ResultError, match="positive"):
        OccupancyGrid(resolution)
