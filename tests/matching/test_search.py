import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.errors import ContourslamError
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import transform
from contourslam.matching import search_grid as module
from contourslam.matching.search import Hypothesis, search
from contourslam.matching.search_grid import SearchGrid, build_search_grid

Floats = NDArray[np.float64]
WIDE = (3.0, 3.0, math.radians(20.0))


def turned(normals: Floats, angle: float) -> Floats:
    return transform(np.array([0.0, 0.0, angle]), normals)


def box(x: float, y: float, width: float, height: float, angle: float = 0.0) -> Floats:
    """Sides of a rectangle about (x, y), as rows of two ends."""
    corners = 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    corners = transform(np.array([x, y, angle]), corners)
    return np.hstack([corners, np.roll(corners, -1, axis=0)])


def cast(walls: Floats, pose: Floats, rng: np.random.Generator, beams: int = 180) -> tuple[Floats, Floats]:
    """Points and normals that a lidar sees all around, in its frame."""
    angles = pose[2] + np.linspace(-np.pi, np.pi, beams, endpoint=False)
    d = np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, None]
    e, q = walls[:, 2:] - walls[:, :2], walls[:, :2] - pose[:2]
    with np.errstate(divide="ignore", invalid="ignore"):
        across = d[..., 0] * e[:, 1] - d[..., 1] * e[:, 0]
        r = (q[:, 0] * e[:, 1] - q[:, 1] * e[:, 0]) / across
        along = (q[:, 0] * d[..., 1] - q[:, 1] * d[..., 0]) / across
        r[~((r > 0.0) & (along >= 0.0) & (along <= 1.0))] = np.inf
    seen = np.isfinite(r).any(axis=1)
    d, hit, r = d[seen, 0], r.argmin(axis=1)[seen], r.min(axis=1)[seen]
    normals = np.stack([-e[hit, 1], e[hit, 0]], axis=1) / np.hypot(*e[hit].T)[:, None]
    normals *= -np.sign((normals * d).sum(axis=1))[:, None]
    points = d * (r + rng.normal(0.0, 0.01, len(r)))[:, None]
    return turned(points, -pose[2]), turned(normals, -pose[2])


def mapped(walls: Floats, poses: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Points and normals of the map that scans from many poses make."""
    scans = [(pose, *cast(walls, pose, rng, 360)) for pose in poses]
    points = np.concatenate([transform(pose, points) for pose, points, _ in scans])
    normals = np.concatenate([turned(normals, pose[2]) for pose, _, normals in scans])
    return points, normals


def fits(map_normals: Floats, layer: int) -> NDArray[np.bool_]:
    """Map points felt in a layer: those within its sixth of a turn, or at most 20 degrees beside it."""
    middle = math.radians(60.0 * layer + 30.0)
    return np.abs(wrap(np.arctan2(map_normals[:, 1], map_normals[:, 0]) - middle)) < math.radians(50.0)


def layers_at(grid: SearchGrid, normals: Floats | None, heading: float, n: int) -> NDArray[np.int64]:
    if normals is None:
        return np.zeros(n, np.int64)
    return np.floor(((np.arctan2(normals[:, 1], normals[:, 0]) + heading) % (2 * np.pi)) / (np.pi / 3)).astype(int) % 6


def lattice(points: Floats, window: Floats, cell: float) -> tuple[int, int, int, float]:
    """How many steps the window reaches each way along x, y and heading, and the heading's step."""
    farthest = np.hypot(*points.T).max()
    kt = math.ceil(window[2] / min((1 - 1e-6) * cell / farthest, 0.02))
    return int(window[0] / cell + 1e-9), int(window[1] / cell + 1e-9), kt, window[2] / kt if kt else 0.02


def scores_of_all(
    grid: SearchGrid, points: Floats, normals: Floats | None, guess: Floats, window: Floats
) -> tuple[NDArray[np.int64], float]:
    """Sum of the likelihoods for each pose of the lattice, one by one: heading, y, x."""
    kx, ky, kt, step = lattice(points, window, grid.cell)
    field = grid.fields[0].astype(np.int64)
    out = np.zeros((2 * kt + 1, 2 * ky + 1, 2 * kx + 1), np.int64)
    for t in range(len(out)):
        theta = guess[2] + (t - kt) * step
        # Directions are looked up once for eight headings, at their middle.
        eight = np.arange(len(out))[t // 8 * 8 :][:8]
        layer = layers_at(grid, normals, guess[2] + (eight.mean() - kt) * step, len(points))
        base = (guess[:2] - grid.origin) / grid.cell - (kx, ky)
        moved = transform(np.array([*base, theta]), points / grid.cell)
        i, j = np.floor(moved).astype(int).T
        ys, xs = np.indices(out.shape[1:])[:, :, :, None]
        y, x = j + ys, i + xs
        inside = (x >= 0) & (y >= 0) & (x < field.shape[2]) & (y < field.shape[1])
        out[t] = np.where(inside, field[layer, y * inside, x * inside], 0).sum(axis=-1)
    return out, step


def best_of_all(scores: NDArray[np.int64], step: float, cell: float, least: float, rival: float, keep: int) -> list:
    """Greedy: the best pose, then the best one that is 0.3 m or 5 degrees from all before it, and so on."""
    found: list[tuple[int, int, int, int]] = []
    for flat in np.argsort(-scores, axis=None, kind="stable"):
        t, y, x = (int(k) for k in np.unravel_index(flat, scores.shape))
        score = int(scores[t, y, x])
        if score < least or (found and score < rival * found[0][3]) or len(found) == keep:
            break
        near = [
            (x - b) ** 2 + (y - a) ** 2 < (0.3 / cell) ** 2
            and abs(math.remainder((t - h) * step, math.tau)) < math.radians(5)
            for h, a, b, _ in found
        ]
        if not any(near):
            found.append((t, y, x, score))
    return found


@given(
    seed=st.integers(0, 10_000),
    directed=st.booleans(),
    n=st.sampled_from([1, 7, 40, 300]),
    spread=st.sampled_from([0.3, 1.0, 2.5]),
    window=st.sampled_from([(0.5, 0.5, 0.15), (0.9, 0.2, 0.4), (0.0, 0.0, 0.3), (0.4, 1.3, 0.0), (4.0, 0.1, 0.02)]),
)
@settings(max_examples=60, deadline=None)
def test_the_search_finds_what_scoring_each_pose_finds(
    seed: int, directed: bool, n: int, spread: float, window: tuple[float, float, float]
) -> None:
    rng = np.random.default_rng(seed)
    cell = 0.1
    guess = np.array([*rng.uniform(-0.5, 0.5, 2), rng.uniform(-4.0, 4.0)])
    points, scan = rng.uniform(-spread, spread, (60, 2)), rng.uniform(-spread, spread, (n, 2))
    # Part of the scan is truly in the map, seen from somewhere in the window.
    pose = guess + rng.uniform(-0.8, 0.8, 3) * window
    points[: n // 2] = transform(pose, scan[: n // 2])[: len(points)]
    normals, own = (rng.normal(size=(len(a), 2)) for a in (points, scan))
    normals[: n // 2] = turned(own[: n // 2], pose[2])[: len(points)]
    grid = build_search_grid(points, normals if directed else None, cell=cell, sigma=0.1)
    rival, keep = rng.uniform(0.3, 0.9), int(rng.integers(1, 5))

    found = search(
        grid, scan, guess, np.array(window), normals=own if directed else None, min_score=0.05, rival=rival, keep=keep
    )

    scores, step = scores_of_all(grid, scan, own if directed else None, guess, np.array(window))
    wanted = best_of_all(scores, step, cell, 0.05 * 255 * n, rival, keep)
    kx, ky, kt, _ = lattice(scan, np.array(window), cell)
    assert len(found) == len(wanted)
    for hypothesis, (t, y, x, score) in zip(found, wanted, strict=True):
        offset = hypothesis.pose - guess
        assert offset[:2] == pytest.approx([(x - kx) * cell, (y - ky) * cell], abs=1e-9)
        assert math.remainder(offset[2] - (t - kt) * step, math.tau) == pytest.approx(0.0, abs=1e-9)
        assert hypothesis.score == pytest.approx(score / (255 * n))


@pytest.mark.parametrize("directed", [True, False])
def test_a_cell_holds_the_likelihood_of_its_distance_to_the_nearest_point(directed: bool) -> None:
    rng = np.random.default_rng(1)
    points, normals = rng.uniform(-0.6, 0.6, (30, 2)), rng.normal(size=(30, 2))
    grid = build_search_grid(points, normals if directed else None, cell=0.04, sigma=0.06)
    field = grid.fields[0]
    assert field.shape[0] == (6 if directed else 1)
    y, x = np.indices(field.shape[1:])
    centres = grid.origin + (np.stack([x, y], axis=-1) + 0.5) * grid.cell
    distances = np.hypot(*np.moveaxis(centres[:, :, None] - points, -1, 0))
    for layer, own in enumerate(field):
        d = np.where(fits(normals, layer) if directed else True, distances, np.inf).min(axis=-1)
        likelihood = 255.0 * np.exp(-0.5 * (d / 0.06) ** 2)
        edge = np.abs(d - 2.5 * 0.06) < 0.002  # points are rounded to a sixteenth of a cell
        assert np.abs(own - np.where(d < 2.5 * 0.06, likelihood, 0.0))[~edge].max() < 5.0


def test_upper_tables_hold_the_maxima_of_their_windows() -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform(-1.0, 1.3, (80, 2))
    grid = build_search_grid(points, rng.normal(size=(80, 2)))
    layers, _, _, rows, columns = grid.top.shape
    top = grid.top.transpose(0, 3, 1, 4, 2).reshape(layers, rows * module.PHASES, columns * module.PHASES)
    for level, table in enumerate((*grid.fields, top)):
        window, stride = module.WINDOWS[level], module.STRIDES[level]
        padded = np.pad(grid.fields[0], ((0, 0), (0, window), (0, window)))
        views = np.lib.stride_tricks.sliding_window_view(padded, (window, window), axis=(1, 2))
        wanted = views[:, :-1:stride, :-1:stride].max(axis=(-2, -1))
        np.testing.assert_array_equal(table, wanted[:, : table.shape[1], : table.shape[2]])
        reach = (1 << level) + max(1 << level >> 1, 1) - 1
        assert window >= reach + stride - 1, "a node's cells may not be covered"


def furnished(rng: np.random.Generator) -> Floats:
    boxes = [box(0.0, 0.0, 9.0, 7.0), box(-3.9, 2.0, 1.2, 2.4)]
    boxes += [box(*rng.uniform(-3.0, 3.0, 2), *rng.uniform(0.3, 1.2, 2), rng.uniform(0.0, 3.0)) for _ in range(7)]
    return np.concatenate(boxes)


def clear_poses(walls: Floats, count: int, rng: np.random.Generator) -> Floats:
    poses = np.column_stack(
        [rng.uniform([-3.2, -3.0], [4.0, 3.0], (8 * count, 2)), rng.uniform(-np.pi, np.pi, 8 * count)]
    )
    return np.array([p for p in poses if np.hypot(*cast(walls, p, rng)[0].T).min() > 0.3][:count])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("window", [WIDE, (3.0, 3.0, np.pi)])
def test_a_pose_in_a_furnished_room_is_found_again(seed: int, window: tuple[float, float, float]) -> None:
    rng = np.random.default_rng(seed)
    walls = furnished(rng)
    grid = build_search_grid(*mapped(walls, clear_poses(walls, 40, rng), rng))
    pose = clear_poses(walls, 1, rng)[0]
    points, normals = cast(walls, pose, rng)
    guess = pose + rng.uniform(-0.9, 0.9, 3) * window
    best, *others = search(grid, points, guess, np.array(window), normals=normals)
    assert np.hypot(*(best.pose - pose)[:2]) < 0.06
    assert abs(math.remainder(best.pose[2] - pose[2], math.tau)) < math.radians(1.0)
    assert best.score > 0.7
    assert all(other.score < 0.9 * best.score for other in others)
    assert -np.pi < best.pose[2] <= np.pi


def test_a_bare_corridor_is_ambiguous_along_it_and_a_closed_end_is_not() -> None:
    rng = np.random.default_rng(3)
    sides = np.array([[-20.0, -1.0, 20.0, -1.0], [20.0, 1.0, -20.0, 1.0]])
    end = np.array([[6.0, -1.0, 6.0, 1.0]])
    pose = np.array([2.0, 0.1, 0.2])
    hypotheses: list[tuple[Hypothesis, ...]] = []
    for walls in (sides, np.vstack([sides, end])):
        along = np.column_stack([np.linspace(-12.0, 5.0, 60), np.zeros(60), np.zeros(60)])
        grid = build_search_grid(*mapped(walls, along, rng))
        points, normals = cast(walls, pose, rng)
        close = np.hypot(*points.T) < 6.0
        hypotheses.append(search(grid, points[close], pose, (3.0, 0.5, 0.3), normals=normals[close]))
    bare, closed = hypotheses
    assert len(bare) == 5
    assert bare[1].score > 0.97 * bare[0].score
    assert closed[0].pose == pytest.approx(pose, abs=0.06)
    assert len(closed) == 1 or closed[1].score < 0.92 * closed[0].score


def test_hypotheses_are_distinct_and_sorted() -> None:
    rng = np.random.default_rng(4)
    walls = box(0.0, 0.0, 4.0, 4.0)
    grid = build_search_grid(*mapped(walls, np.zeros((1, 3)), rng))
    points, normals = cast(walls, np.zeros(3), rng)
    found = search(grid, points, (0.3, 0.2, 0.1), (1.0, 1.0, np.pi), normals=normals, keep=9)
    assert sorted(round(h.pose[2] / (np.pi / 2)) % 4 for h in found) == [0, 1, 2, 3], "a square fits in four ways"
    assert [h.score for h in found] == sorted((h.score for h in found), reverse=True)


def test_a_wall_does_not_match_its_far_side_nor_one_that_crosses_it() -> None:
    line = np.column_stack([np.linspace(-1.0, 1.0, 50), np.zeros(50)])
    normals = np.tile([0.0, 1.0], (50, 1))
    grid = build_search_grid(line, normals)
    middle, window = np.zeros(3), (0.1, 0.1, 0.05)
    assert search(grid, line, middle, window, normals=normals)[0].score > 0.85
    assert search(grid, line, middle, window, normals=-normals, min_score=0.0) == ()
    assert search(grid, line, middle, window, normals=normals[:, ::-1], min_score=0.0) == ()


@pytest.mark.parametrize("tilt", [-20.0, 20.0])
@pytest.mark.parametrize("direction", np.arange(0.0, 360.0, 15.0))
def test_directions_that_differ_by_twenty_degrees_match(direction: float, tilt: float) -> None:
    place = np.array([[1.0, 2.0]])
    normals = [np.array([[math.cos(a), math.sin(a)]]) for a in np.radians([direction, direction + 0.99 * tilt])]
    grid = build_search_grid(place, normals[0])
    assert len(search(grid, place, np.zeros(3), np.zeros(3), normals=normals[1])) == 1


def test_no_window_tries_the_guess_alone() -> None:
    rng = np.random.default_rng(5)
    points = rng.uniform(-2.0, 2.0, (50, 2))
    guess = np.array([0.3, -0.2, 3.0])
    (only,) = search(build_search_grid(transform(guess, points), None), points, guess, np.zeros(3))
    np.testing.assert_allclose(only.pose, guess, atol=1e-12)
    assert only.score > 0.6


def test_points_outside_of_the_grid_count_as_no_match() -> None:
    rng = np.random.default_rng(6)
    points = rng.uniform(-2.0, 2.0, (50, 2))
    grid = build_search_grid(points, None)
    far = np.vstack([points, points + 500.0, points - 500.0, points + 60.0])
    window = np.array([0.2, 0.2, 0.0])
    half = search(grid, points, np.zeros(3), window)[0]
    assert search(grid, far, np.zeros(3), window, min_score=0.1)[0].score == pytest.approx(half.score / 4)
    assert search(grid, points, np.array([1e6, -1e6, 0.0]), window, min_score=0.0) == ()


def test_nothing_is_found_in_nothing() -> None:
    nothing, points = np.zeros((0, 2)), np.ones((5, 2))
    window = np.array([0.5, 0.5, 0.2])
    assert search(build_search_grid(nothing, None), points, np.zeros(3), window, min_score=0.0) == ()
    assert search(build_search_grid(nothing, nothing), points, np.zeros(3), window, normals=points) == ()
    assert search(build_search_grid(points, None), nothing, np.zeros(3), window) == ()
    assert search(build_search_grid(points, None), points * np.nan, np.zeros(3), window) == ()
    assert search(build_search_grid(points, None), points, np.zeros(3), window, keep=0) == ()


def test_values_that_are_not_finite_change_nothing() -> None:
    rng = np.random.default_rng(7)
    points, normals = rng.uniform(-2.0, 2.0, (40, 2)), rng.normal(size=(40, 2))
    bad = np.vstack([points, np.full((3, 2), np.nan), [[np.inf, 0.0]], [[0.0, 0.0]]])
    bad_normals = np.vstack([normals, np.ones((4, 2)), [[np.nan, 1.0]]])
    clean = build_search_grid(points, normals)
    np.testing.assert_array_equal(build_search_grid(bad, bad_normals).fields[0], clean.fields[0])
    window = np.array([0.3, 0.3, 0.1])
    one = search(clean, points, np.zeros(3), window, normals=normals)
    two = search(clean, bad, np.zeros(3), window, normals=bad_normals)
    assert [h.score for h in one] == [h.score for h in two] != []
    assert all(np.isfinite(h.pose).all() and 0.0 < h.score <= 1.0 for h in one)


def test_a_lone_point_at_the_origin_can_be_searched_for() -> None:
    grid = build_search_grid(np.array([[1.0, 1.0]]), None)
    best = search(grid, np.zeros((1, 2)), np.array([0.9, 1.1, 0.0]), (0.2, 0.2, np.pi), keep=1)[0]
    assert np.hypot(*(best.pose[:2] - 1.0)) < 0.06


def test_a_map_too_wide_for_the_tables_says_so() -> None:
    with pytest.raises(ContourslamError, match=r"spreads over 5000 x 3000 m.*crop"):
        build_search_grid(np.array([[0.0, 0.0], [5000.0, 3000.0]]), None)


def test_arrays_that_do_not_fit_are_refused() -> None:
    points, middle, window = np.ones((4, 2)), np.zeros(3), np.ones(3)
    plain, directed = build_search_grid(points, None), build_search_grid(points, points)
    with pytest.raises(ValueError, match="shape"):
        build_search_grid(np.ones((4, 3)), None)
    with pytest.raises(ValueError, match="must agree"):
        build_search_grid(points, np.ones((3, 2)))
    with pytest.raises(ValueError, match="positive"):
        build_search_grid(points, None, cell=0.0)
    with pytest.raises(ValueError, match="both the map and the scan"):
        search(plain, points, middle, window, normals=points)
    with pytest.raises(ValueError, match="both the map and the scan"):
        search(directed, points, middle, window)
    with pytest.raises(ValueError, match="three finite"):
        search(plain, points, np.array([0.0, np.nan, 0.0]), window)
    with pytest.raises(ValueError, match="three finite"):
        search(plain, points, middle, -window)
    with pytest.raises(ValueError, match="too many"):
        search(plain, points, middle, np.array([1e6, 1e6, 3.0]))
