"""Walls and contours of a map become surfaces: whole, joined, and no more of them than there are."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from painted_room import BOX, BOX_CORNERS, CORNERS, DEEP, HIGH, WIDE

from contourslam.errors import MapError
from contourslam.maps.saved_map import SavedMap
from contourslam.scene.atlas import BORDER, LARGEST
from contourslam.scene.behind import walls_behind
from contourslam.scene.bodies import bodies, lids
from contourslam.scene.facets import find_facets
from contourslam.scene.floor import rectangles, seen_floor
from contourslam.scene.occlusion import occluders, visible
from contourslam.scene.raising import SceneOptions, raise_surfaces
from contourslam.scene.surface import SIDE, TexelGrid, upright
from contourslam.scene.walls import clean_walls, join_ends, square_up
from contourslam.slam.landmark_map import CornerMap, WallMap

NO_POINTS = np.zeros((0, 4))


def wall_map(*segments, ids=None):
    """Walls of a map; each segment as seen from free space from the left to the right."""
    ends = np.array(segments, dtype=float).reshape(-1, 2, 2)[:, ::-1]
    n = len(ends)
    d = ends[:, 0] - ends[:, 1]
    normals = np.arctan2(d[:, 0], -d[:, 1])
    zero, ones = np.zeros((n, 2, 2)), np.ones(n, np.int64)
    return WallMap(
        np.arange(n) if ids is None else np.array(ids), ends, np.zeros((n, 2, 2, 2)), normals, zero, ones, ones
    )


def no_corners():
    zero = np.zeros(0)
    ints = np.zeros(0, np.int64)
    return CornerMap(ints, np.zeros((0, 2)), np.zeros((0, 2, 2)), zero, zero, np.zeros(0, bool), ints, ints)


def points_on(segment, normal=None, spacing=0.05, noise=0.0, seed=0):
    """Contour points on a segment that is seen from the left to the right."""
    segment = np.array(segment, dtype=float)
    length = math.dist(*segment)
    along = (segment[1] - segment[0]) / length
    out = np.array([along[1], -along[0]])
    s = np.arange(0.0, length, spacing)
    rng = np.random.default_rng(seed)
    places = segment[0] + s[:, None] * along + rng.normal(0, noise, (len(s), 1)) * out
    return np.hstack([places, np.tile(out, (len(s), 1))])


def test_two_walls_that_are_one_become_one():
    found = clean_walls(wall_map([(0, 0), (2, 0)], [(1.9, 0.02), (4, 0.02)], ids=[7, 3]), NO_POINTS)
    assert len(found) == 1
    name, segment = found[0]
    assert name == "wall-3"  # the longer one's
    np.testing.assert_allclose(segment, [(0, 0.01), (4, 0.01)], atol=0.02)


def test_small_gaps_close_and_doors_stay_open():
    found = clean_walls(wall_map([(0, 0), (2, 0)], [(2.1, 0), (4, 0)], [(4.8, 0), (6, 0)]), NO_POINTS)
    assert sorted(math.dist(*segment) for _, segment in found) == pytest.approx([1.2, 4.0])


def test_the_two_sides_of_a_wall_stay_two():
    assert len(clean_walls(wall_map([(0, 0), (2, 0)], [(2, 0.05), (0, 0.05)]), NO_POINTS)) == 2


def test_a_wall_is_drawn_out_as_far_as_contours_lie_on_it():
    points = np.concatenate([points_on([(2, 0), (3, 0)]), points_on([(3.8, 0), (4.5, 0)])])
    ((_, segment),) = clean_walls(wall_map([(0, 0), (2, 0)]), points)
    assert segment[1, 0] == pytest.approx(3.0, abs=0.06)


@given(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(1.0, 2.2))
def test_ends_that_nearly_meet_are_joined_where_the_lines_cross(a, b, turn):
    direction = np.array([math.cos(turn), math.sin(turn)])
    first, second = np.array([[0.0, 0.0], [2.0 + a, 0.0]]), np.array([2.0, 0.0]) + np.outer([b, 1.5], direction)
    (_, first), (_, second) = join_ends([("a", first), ("b", second)])
    np.testing.assert_allclose(first[1], [2.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(second[0], [2.0, 0.0], atol=1e-9)


def test_what_nearly_stands_at_a_right_angle_does():
    ((_, turned),) = square_up(
        [("c", np.array([[1.0, 0.0], [1.04, 0.5]]))], [("w", np.array([[-2.0, 0.0], [1.0, 0.0]]))]
    )
    np.testing.assert_allclose(turned[0, 0], turned[1, 0], atol=1e-9)
    assert math.dist(*turned) == pytest.approx(math.hypot(0.04, 0.5))


def test_a_box_that_every_keyframe_sees_gets_four_sides():
    sides = [(BOX_CORNERS[n], BOX_CORNERS[(n + 1) % 4]) for n in range(4)]
    each = [
        np.concatenate([points_on(side, noise=0.005, seed=10 * k + n) for n, side in enumerate(sides)])
        for k in range(5)
    ]
    facets, columns = find_facets(np.concatenate(each), np.repeat(np.arange(5), [len(p) for p in each]), [])
    assert len(facets) == 4 and not columns
    for _, facet in facets:
        true = min(sides, key=lambda side: np.abs(np.array(side) - facet).max())
        np.testing.assert_allclose(facet, true, atol=0.08)


def test_what_only_two_keyframes_saw_has_moved():
    seen = points_on([(1, 1), (2, 1)])
    points = np.concatenate([seen] * 3)
    assert find_facets(points[: 2 * len(seen)], np.repeat([0, 1], len(seen)), []) == ([], [])
    assert len(find_facets(points, np.repeat([0, 1, 2], len(seen)), [])[0]) == 1


def test_contours_on_a_wall_are_no_furniture():
    seen = points_on([(0, 0.02), (2, 0.02)])
    facets, _ = find_facets(
        np.concatenate([seen] * 4), np.repeat(np.arange(4), len(seen)), [("wall-0", np.array([[0, 0], [2.0, 0]]))]
    )
    assert facets == []


def test_a_round_column_becomes_a_prism_about_its_middle():
    rng = np.random.default_rng(3)
    angles = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    out = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    each = [np.hstack([[3, 2] + (0.25 + rng.normal(0, 0.006, (40, 1))) * out, out]) for _ in range(4)]
    facets, columns = find_facets(np.concatenate(each), np.repeat(np.arange(4), 40), [])
    assert facets == [] and len(columns) == 14
    ends = np.concatenate([side for _, side in columns])
    np.testing.assert_allclose(np.hypot(*(ends - [3, 2]).T), 0.25, atol=0.015)
    surfaces = tuple(upright(name, "contour", *side, 0.5) for name, side in columns)
    assert all((surface.normal[:2] @ (surface.segment.mean(axis=0) - [3, 2])) > 0 for surface in surfaces)
    assert [len(group) for group in bodies(surfaces)] == [14]
    assert lids(surfaces, 2.0)[0].area == pytest.approx(np.pi * 0.25**2, rel=0.1)


def room_surfaces(*more):
    walls = [upright(f"wall-{n}", "wall", CORNERS[(n + 1) % 4], CORNERS[n], HIGH) for n in range(4)]
    return (*walls, *more)


def box_surfaces():
    return tuple(upright(f"contour-{n}", "contour", BOX_CORNERS[n], BOX_CORNERS[(n + 1) % 4], BOX) for n in range(4))


def test_the_floor_covers_the_room_and_goes_on_under_a_box_and_not_behind_a_door():
    walls = [wall for wall in room_surfaces(*box_surfaces()) if wall.name != "wall-1"]
    walls.append(upright("wall-1", "wall", np.array([WIDE, DEEP]), np.array([WIDE, 1.0]), HIGH))  # open below
    way = np.array([[1.0, 1.0, 0.0], [3.0, 2.5, 0.0], [1.0, 2.5, 0.0], [3.0, 0.5, 0.0]])
    (floor,) = seen_floor(way, occluders(tuple(walls)), 8.0, 0.02, 10.0)
    assert floor.area == pytest.approx(WIDE * DEEP, rel=0.03)


def test_the_cells_of_a_huge_floor_are_larger(monkeypatch):
    monkeypatch.setattr("contourslam.scene.floor._MOST_CELLS", 2000)
    way, blocks = np.array([[1.0, 1.0, 0.0], [3.0, 2.5, 0.0]]), occluders(room_surfaces())
    (whole,) = seen_floor(way, blocks, 8.0, 0.02, 10.0)
    assert np.diff(whole.parts.reshape(-1, 2, 2), axis=1).min() > 0.95 * math.sqrt(WIDE * DEEP / 2000)
    assert whole.area == pytest.approx(WIDE * DEEP, rel=0.1)


@given(st.lists(st.lists(st.booleans(), min_size=1, max_size=7), min_size=1, max_size=7))
def test_rectangles_cover_each_cell_once(rows):
    cells = np.zeros((len(rows), max(map(len, rows))), bool)
    for n, row in enumerate(rows):
        cells[n, : len(row)] = row
    count = np.zeros(cells.shape, int)
    for left, lower, right, upper in rectangles(cells).astype(int):
        count[lower:upper, left:right] += 1
    np.testing.assert_array_equal(count, cells)


def test_a_wall_goes_on_behind_furniture_and_not_across_a_door():
    # Along y = 0 a wall, a cupboard before its middle, and the wall again; at x = 4 a door between two walls.
    cupboard = upright("wall-9", "wall", np.array([2.2, 0.4]), np.array([1.2, 0.4]), 0.9)
    sides = [upright("contour-0", "contour", np.array([1.2, 0.4]), np.array([1.2, 0.0]), 0.9)]
    sides += [upright("contour-1", "contour", np.array([2.2, 0.0]), np.array([2.2, 0.4]), 0.9)]
    walls = [
        upright("wall-0", "wall", np.array([1.2, 0.0]), np.array([0.0, 0.0]), HIGH),
        upright("wall-1", "wall", np.array([4.0, 0.0]), np.array([2.2, 0.0]), HIGH),
        upright("wall-2", "wall", np.array([4.0, 1.0]), np.array([4.0, 0.0]), HIGH),
        upright("wall-3", "wall", np.array([4.0, 3.0]), np.array([4.0, 1.9]), HIGH),
    ]
    surfaces = (*walls, cupboard, *sides)
    heights = [None, None, None, None, 0.9, None, None]
    way = np.array([[x, 1.5, 0.0] for x in np.linspace(0.5, 3.5, 20)])
    (closed,) = walls_behind(surfaces, heights, way)
    np.testing.assert_allclose(closed.segment, [[2.2, 0.0], [1.2, 0.0]], atol=1e-9)
    assert closed.height == HIGH


def hidden_plainly(eye, place, blocks):
    """The kernel's twin without margins: does the line of sight cross a rectangle below its upper edge?"""
    for ax, ay, bx, by, top in blocks:
        d, s = place - eye, np.array([bx - ax, by - ay])
        matrix = np.array([[d[0], -s[0]], [d[1], -s[1]]])
        if abs(np.linalg.det(matrix)) < 1e-12:
            continue
        part, along = np.linalg.solve(matrix, np.array([ax, ay]) - eye[:2])
        if 0 < part < 1 and 0 <= along <= 1 and eye[2] + part * d[2] <= top:
            return True
    return False


def test_sight_is_blocked_as_plain_geometry_says():
    rng = np.random.default_rng(6)
    blocks = np.column_stack([rng.uniform(-3, 3, (12, 4)), rng.uniform(0.2, 1.5, 12)])
    eye, places = np.array([0.1, 0.2, 0.5]), np.column_stack([rng.uniform(-4, 4, (300, 2)), rng.uniform(0, 2, 300)])
    expected = [not hidden_plainly(eye, place, blocks) for place in places]
    np.testing.assert_array_equal(visible(eye, places, blocks, 0.0, 0.0), expected)
    assert 50 < sum(expected) < 250


@given(st.floats(0.3, 3.0), st.floats(0.3, 2.0), st.floats(0.01, 0.2))
def test_texels_are_where_the_image_shows_them(width, height, texel):
    surface = upright("wall-0", "wall", np.array([1.0, 2.0]), np.array([1.0 + width, 2.0]), height)
    grid = TexelGrid.over((surface, surface), texel)
    offsets = np.stack([np.repeat(np.arange(8) + 0.5, 8), np.tile(np.arange(8) + 0.5, 8)], axis=1) / 8
    cells = np.arange(grid.starts[1], grid.starts[2])
    places = np.zeros((grid.cells, 64, 3))
    places[cells] = grid.places(cells, offsets)
    image = grid.image(1, places)
    rows, columns = image.shape[:2]
    np.testing.assert_allclose(image[:, 0, 2], height * (1 - (np.arange(rows) + 0.5) / rows))
    np.testing.assert_allclose(image[0, :, 0], 1.0 + width * (np.arange(columns) + 0.5) / columns)
    back = np.zeros_like(places)
    grid.put(1, back, image)
    np.testing.assert_array_equal(back[cells], places[cells])


def test_a_map_without_walls_is_an_error_that_says_so():
    with pytest.raises(MapError, match="no walls"):
        raise_surfaces(SavedMap(no_corners(), wall_map()), np.zeros((3, 3)), SceneOptions())


def test_a_map_of_walls_alone_is_raised_with_its_floor():
    walls = wall_map(*[(CORNERS[(n + 1) % 4], CORNERS[n]) for n in range(4)])
    surfaces = raise_surfaces(SavedMap(no_corners(), walls), np.array([[1.0, 1.0, 0.0]]), SceneOptions(height=2.2))
    assert [s.name for s in surfaces] == ["wall-0", "wall-1", "wall-2", "wall-3", "floor-0"]
    assert {s.height for s in surfaces[:4]} == {2.2}
    for surface in surfaces[:4]:  # each is seen from inside
        assert surface.normal @ (np.array([2.0, 1.5, 1.0]) - surface.origin) > 0


def test_no_piece_is_larger_than_a_sheet_has_room_for():
    walls = wall_map(*[(CORNERS[(n + 1) % 4], CORNERS[n]) for n in range(4)])
    fine = SceneOptions(height=1.0, texel=0.0003)
    surfaces = raise_surfaces(SavedMap(no_corners(), walls), np.array([[1.0, 1.0, 0.0]]), fine)
    texels = SIDE * TexelGrid.over(surfaces, fine.texel).shapes
    assert texels.max() <= LARGEST - 2 * BORDER
    assert sum(s.area for s in surfaces if s.kind == "floor") == pytest.approx(WIDE * DEEP, rel=0.1)
