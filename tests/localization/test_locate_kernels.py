"""The kernels of the localisation do what their plain twins say, and the global search what trying all poses gives."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from contourslam.localization import global_search
from contourslam.localization.evidence import BEFORE, FACING, LOOK_ALIKE, NEAR_WALL, SIGMA, STRIDE, weigh
from contourslam.localization.free_space import BODY, CELL, SHORT, FreeSpace, see_free
from contourslam.localization.global_search import search_everywhere, standing_on
from contourslam.localization.known_map import KnownMap
from contourslam.localization.view import SQUARE, View, view_of
from contourslam.maps.saved_map import SavedMap
from contourslam.matching.cell_map import CellMap
from contourslam.matching.search_grid import LAYERS, TOP, SearchGrid, directions_of
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
ROOM = ((0, 0), (3, 0), (3, 2), (1.4, 2), (1.4, 2.6), (0, 2.6))
WAY = np.array([(0.7, 0.8, 0.0), (2.3, 1.2, 2.0)])


@pytest.fixture(scope="module")
def saved(room: Callable[..., Floats], saved_at: Callable[..., SavedMap]) -> SavedMap:
    return saved_at(room(ROOM), WAY)


@pytest.fixture(scope="module")
def known(saved: SavedMap) -> KnownMap:
    return KnownMap(saved)


@pytest.fixture(scope="module")
def view(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan], points_of: Callable[[LaserScan], Floats]
) -> View:
    return view_of(points_of(scan_of(room(ROOM), (1.1, 1.3, 0.6), sigma=0.01, beams=180)))


def plain_free(saved: SavedMap, out: FreeSpace) -> NDArray[np.bool_]:
    """The twin of the kernel, cell by cell and step by step."""
    frames = saved.keyframes
    assert frames is not None
    free = np.zeros_like(out.free)
    rows, columns = np.indices(free.shape)
    middles = np.stack([out.x0 + (columns + 0.5) * CELL, out.y0 + (rows + 0.5) * CELL], axis=-1)
    for k, pose in enumerate(frames.poses):
        free |= np.hypot(*(middles - pose[:2]).transpose(2, 0, 1)) < BODY
        for x, y in frames.contour(k)[:, :2].astype(np.float64):
            turned = np.array([np.cos(pose[2]) * x - np.sin(pose[2]) * y, np.sin(pose[2]) * x + np.cos(pose[2]) * y])
            length = np.hypot(*turned) / CELL
            parts = np.arange(math.ceil(1.5 * (length - SHORT / CELL))) / (1.5 * length)
            spots = pose[:2] + parts[:, None] * turned
            at = np.floor((spots - (out.x0, out.y0)) / CELL).astype(int)
            free[at[:, 1], at[:, 0]] = True
    return free


def test_cells_along_the_rays_are_free_and_no_others(saved: SavedMap) -> None:
    frames = saved.keyframes
    assert frames is not None
    out = see_free(frames.poses, frames.starts, frames.points, np.array([-0.52, -0.51]), np.array([3.5, 3.2]))
    wanted = plain_free(saved, out)
    # Rounding may put a spot on the border of a cell to either side.
    assert (out.free != wanted).mean() < 0.002
    assert 0.2 < out.free.mean() < 0.6
    assert not out.free[:4].any()  # beyond the walls
    assert not out.free[:, :4].any()


def plain_weigh(view: View, cells: CellMap, free: FreeSpace, pose: Floats) -> Floats:
    """The twin of the kernel in plain Python."""
    rows, out = cells.points, np.zeros(4)

    def near(x: float, y: float) -> Floats | None:
        i, j = math.floor((x - cells.x0) / 0.05), math.floor((y - cells.y0) / 0.05)
        if not (0 <= i < 32 * cells.index.shape[0] and 0 <= j < 32 * cells.index.shape[1]):
            return None
        tile = cells.index[i // 32, j // 32]
        row = -1 if tile < 0 else cells.tiles[tile, i % 32, j % 32]
        return None if row < 0 else rows[row]

    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    turn = np.array([[cos, -sin], [sin, cos]])
    for point, origin, weight in zip(view.points, view.origins, view.weights, strict=True):
        end, normal, start = pose[:2] + turn @ point[:2], turn @ point[2:], pose[:2] + turn @ origin
        row = near(*end)
        out[0] += weight
        if row is not None and normal @ row[2:4] > LOOK_ALIKE:
            across = row[2:4] @ (end - row[:2])
            along = max(np.hypot(*(end - row[:2])) - abs(across) - 0.1, 0.0)
            out[1] += weight * math.exp(-0.5 * (across**2 + along**2) / SIGMA**2)
        j, i = (np.floor((end - (free.x0, free.y0)) / CELL)[::-1]).astype(int)
        inside = 0 <= j < free.free.shape[0] and 0 <= i < free.free.shape[1]
        out[2] += weight * (row is None and inside and free.free[j, i])
        length = np.hypot(*(end - start))
        step, s = (end - start) / max(length, 1e-9), 0.1
        while length >= BEFORE and s < length - BEFORE:
            wall = near(*(start + s * step))
            away = math.inf if wall is None else np.hypot(*(start + s * step - wall[:2]))
            if wall is not None and away < NEAR_WALL and wall[2:4] @ step < -FACING:
                out[3] += weight
                break
            s += STRIDE if wall is None else max(away - 0.5 * NEAR_WALL, 0.05)
    return out


@given(dx=st.floats(-1.5, 1.5), dy=st.floats(-1.5, 1.5), heading=st.floats(-math.pi, math.pi), ox=st.floats(-0.3, 0.3))
def test_evidence_is_what_its_plain_twin_says(
    known: KnownMap, view: View, dx: float, dy: float, heading: float, ox: float
) -> None:
    pose = np.array([1.1 + dx, 1.3 + dy, heading])
    some = slice(None, None, 5)
    origins = np.ascontiguousarray(view.origins[some] + (ox, 0.0))
    part = View(np.ascontiguousarray(view.points[some]), origins, view.weights[some].copy(), np.arange(1))
    assert known.free is not None
    cells = known.around(pose)
    found = weigh(part, cells, known.free, pose)
    wanted = plain_weigh(part, cells, known.free, pose)
    np.testing.assert_allclose((found.total, found.found, found.new, found.through), wanted, atol=1e-9)


def test_evidence_tells_the_true_place_from_one_whose_beams_pass_through_walls(known: KnownMap, view: View) -> None:
    true, wrong = np.array([1.1, 1.3, 0.6]), np.array([2.6, 1.0, 0.6])
    here, there = (weigh(view, known.around(pose), known.free, pose) for pose in (true, wrong))
    assert here.total == there.total == pytest.approx(view.weights.sum())
    assert here.found > 0.9 * here.total
    assert here.through + here.new < 0.02 * here.total
    assert there.found < 0.5 * there.total
    assert there.through > 0.2 * there.total


@given(positions=hnp.arrays(np.bool_, st.tuples(st.integers(1, 23), st.integers(1, 23))))
def test_a_level_of_the_standing_places_says_whether_its_window_holds_one(positions: NDArray[np.bool_]) -> None:
    standing = standing_on(positions, np.zeros(2))
    assert len(standing.levels) == TOP + 1
    for k, level in enumerate(standing.levels):
        size = 1 << k
        for y in range(positions.shape[0]):
            for x in range(positions.shape[1]):
                assert level[y, x] == positions[y : y + size, x : x + size].any()


def scores_of_all(grid: SearchGrid, known: KnownMap, view: View, headings: int) -> Floats:
    """Score of every position, at `headings` headings: shape (headings, rows, columns), 0 where nobody can stand."""
    points = view.points[view.chosen]
    directions, field = directions_of(points[:, 2:]), grid.fields[0]
    rows, columns = known.standing.levels[0].shape
    y, x = np.mgrid[:rows, :columns]
    out = np.zeros((headings, rows, columns))
    for h in range(headings):
        theta = -math.pi + h * 2.0 * math.pi / headings
        turned = points[:, :2] @ np.array([[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]])
        layers = np.floor((directions + theta * LAYERS / (2.0 * math.pi)) % LAYERS).astype(int) % LAYERS
        for (px, py), layer in zip(turned / grid.cell, layers, strict=True):
            i = np.floor(known.standing.start[0] + px).astype(int) + x
            j = np.floor(known.standing.start[1] + py).astype(int) + y
            inside = (i >= 0) & (j >= 0) & (i < field.shape[2]) & (j < field.shape[1])
            out[h][inside] += field[layer, j[inside], i[inside]]
    return np.where(known.standing.levels[0], out, 0.0) / (255.0 * len(points))


def test_the_global_search_finds_the_best_of_all_poses(
    known: KnownMap, view: View, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(global_search, "HOPE", 1.0)  # nothing is left out by hope alone
    found, rest = search_everywhere(known.grid, known.standing, view, keep=3)
    reach = np.hypot(*view.points[view.chosen, :2].T).max()
    headings = math.ceil(2.0 * math.pi / min((1.0 - 1e-6) * known.grid.cell / reach, 0.02))
    every = scores_of_all(known.grid, known, view, headings)
    # The layer of a point's direction is that of a wider node's heading, so scores differ a little.
    assert found[0].score == pytest.approx(every.max(), abs=0.03)
    _, y, x = np.unravel_index(every.argmax(), every.shape)
    spot = known.grid.origin + (known.standing.start + np.array([x, y])) * known.grid.cell
    assert np.hypot(*(found[0].pose[:2] - spot)) < 0.25
    assert [f.score for f in found] == sorted((f.score for f in found), reverse=True)
    assert rest <= found[0].score


def test_nobody_is_found_where_nobody_can_stand(known: KnownMap, view: View) -> None:
    nowhere = standing_on(np.zeros_like(known.standing.levels[0]), known.standing.start)
    assert search_everywhere(known.grid, nowhere, view, keep=3) == ((), 0.0)


def test_a_search_cut_short_says_what_it_may_have_missed(
    known: KnownMap, view: View, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(global_search, "BUDGET", 3)
    found, rest = search_everywhere(known.grid, known.standing, view, keep=3)
    assert found == ()
    assert rest > 0.5


@given(
    points=hnp.arrays(
        np.float64,
        st.tuples(st.integers(0, 40), st.just(4)),
        elements=st.floats(-20.0, 20.0) | st.sampled_from([math.nan, math.inf]),
    )
)
def test_points_of_one_square_count_one_together(points: Floats) -> None:
    view = view_of(points)
    good = points[np.isfinite(points).all(axis=1)]
    np.testing.assert_array_equal(view.points, good)
    assert view.weights.sum() == pytest.approx(len({tuple(s) for s in np.floor(good[:, :2] / SQUARE)}))
    assert len(set(view.chosen.tolist())) == len(view.chosen)


def test_points_of_a_wrong_shape_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(5, 2\), wanted \(n, 4\)"):
        view_of(np.zeros((5, 2)))
