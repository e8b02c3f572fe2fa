import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.errors import ConfigError
from contourslam.simulation.pieces import Box, Cylinder, Piece, partition, table
from contourslam.simulation.room import Room
from contourslam.simulation.rooms import ROOMS

SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
ROUTE = ((1.0, 1.0), (3.0, 1.0), (3.0, 3.0))


def room(*pieces: Piece) -> Room:
    return Room("square", "4 x 4 m", SQUARE, pieces, ROUTE)


def rows(points: np.ndarray) -> set[tuple[float, float]]:
    return {(round(x, 5) + 0.0, round(y, 5) + 0.0) for x, y in points.tolist()}


def test_an_empty_room_has_its_four_corners_and_free_space_fills_them() -> None:
    corners = room().corners(0.2)
    assert rows(corners.positions) == set(SQUARE)
    assert not corners.convex.any()
    np.testing.assert_allclose(corners.openings, math.pi / 2)
    np.testing.assert_allclose(corners.sides, 4.0)
    to_middle = np.array([2.0, 2.0]) - corners.positions
    np.testing.assert_allclose(corners.directions, np.arctan2(to_middle[:, 1], to_middle[:, 0]), atol=1e-9)


def test_a_cupboard_against_a_wall_has_two_edges_and_two_corners_with_the_wall() -> None:
    corners = room(Box(2.0, 3.75, 1.0, 0.5, 2.0)).corners(0.2)
    assert rows(corners.positions[corners.convex]) == {(1.5, 3.5), (2.5, 3.5)}
    assert rows(corners.positions[~corners.convex]) == {*SQUARE, (1.5, 4.0), (2.5, 4.0)}
    edge = np.flatnonzero(np.all(np.isclose(corners.positions, [1.5, 3.5]), axis=1))[0]
    assert corners.directions[edge] == pytest.approx(math.pi / 4)  # into the cupboard
    assert corners.sides[edge] == pytest.approx(0.5)


def test_a_cupboard_hides_the_wall_behind_it() -> None:
    segments = room(Box(2.0, 3.75, 1.0, 0.5, 2.0)).segments(0.2)
    top = segments[np.all(np.isclose(segments[:, :, 1], 4.0), axis=1)]
    spans = sorted(tuple(sorted(span)) for span in np.round(top[:, :, 0], 5).tolist())
    assert spans == [(0.0, 1.5), (2.5, 4.0)]


def test_two_pieces_in_line_leave_no_corner_at_their_seam() -> None:
    corners = room(Box(1.5, 2.0, 1.0, 0.5, 2.0), Box(2.5, 2.0, 1.0, 0.5, 2.0)).corners(0.2)
    assert rows(corners.positions[corners.convex]) == {(1.0, 1.75), (3.0, 1.75), (3.0, 2.25), (1.0, 2.25)}


def test_a_table_is_four_legs_below_and_one_top_above() -> None:
    described = room(*table(2.0, 2.0, 1.2, 0.8, 30.0))
    assert described.corners(0.2).convex.sum() == 16
    assert described.corners(0.72).convex.sum() == 4
    assert described.corners(0.72).sides[described.corners(0.72).convex] == pytest.approx([0.8] * 4)


def test_what_hangs_above_the_lidar_is_not_there() -> None:
    assert len(room(Box(2.0, 2.0, 1.0, 0.5, 2.0, bottom=0.5)).segments(0.2)) == 4


def test_an_office_without_a_way_in_has_no_corners_for_the_robot() -> None:
    closed = room(*partition((0.0, 3.5), (4.0, 3.5), 2.4))
    assert closed.corners(0.2).positions[:, 1].max() == pytest.approx(3.44)
    opened = room(*partition((0.0, 3.5), (4.0, 3.5), 2.4, (2.0, 0.9)))
    assert opened.corners(0.2).positions[:, 1].max() == pytest.approx(4.0)


def test_a_column_is_a_circle_and_no_corner() -> None:
    described = room(Cylinder(2.0, 2.0, 0.25, 2.4), Cylinder(2.0, 3.0, 0.1, 0.1))
    np.testing.assert_array_equal(described.circles(0.2), [[2.0, 2.0, 0.25]])
    assert len(described.corners(0.2).positions) == 4


@given(
    yaw_deg=st.floats(-360, 360), length=st.floats(0.1, 1.5), width=st.floats(0.1, 1.5), x=st.floats(1.8, 2.2)
)  # fmt: skip
def test_a_free_standing_box_has_its_four_edges_wherever_it_looks(
    yaw_deg: float, length: float, width: float, x: float
) -> None:
    box = Box(x, 2.4, length, width, 1.0, yaw_deg)
    described = Room("square", "6 x 6 m", ((0, 0), (6, 0), (6, 6), (0, 6)), (box,), ((5, 5), (5, 1), (1, 5)))
    corners = described.corners(0.2)
    assert corners.convex.sum() == 4
    gaps = np.linalg.norm(corners.positions[corners.convex][:, None] - box.footprint()[None], axis=2)
    assert gaps.min(axis=0).max() < 2e-6
    np.testing.assert_allclose(corners.openings, math.pi / 2, atol=1e-4)
    into = corners.positions + 0.01 * np.stack([np.cos(corners.directions), np.sin(corners.directions)], axis=1)
    middle = np.array([x, 2.4])
    nearer = np.linalg.norm(into - middle, axis=1) < np.linalg.norm(corners.positions - middle, axis=1)
    assert nearer[corners.convex].all()


@pytest.mark.parametrize("name", ROOMS)
def test_every_corner_is_where_two_outlines_meet(name: str) -> None:
    segments, corners = ROOMS[name].segments(0.2), ROOMS[name].corners(0.2)
    for position, opening, side in zip(corners.positions, corners.openings, corners.sides, strict=True):
        starting = segments[np.all(segments[:, 0] == position, axis=1)]
        ending = segments[np.all(segments[:, 1] == position, axis=1)]
        assert len(starting) == len(ending) == 1
        first, second = ending[0, 0] - position, starting[0, 1] - position
        lengths = np.linalg.norm(first), np.linalg.norm(second)
        assert side == pytest.approx(min(lengths))
        assert opening == pytest.approx(math.acos(first @ second / (lengths[0] * lengths[1])), abs=1e-6)


@pytest.mark.parametrize("name", ROOMS)
def test_free_space_lies_to_the_left_of_every_outline(name: str) -> None:
    from shapely import Point, Polygon, union_all

    described = ROOMS[name]
    standing = [p for p in described.pieces if p.bottom < 0.2 < p.top and isinstance(p, Box)]
    matter = union_all([Polygon(p.footprint()) for p in standing])
    for (x0, y0), (x1, y1) in described.segments(0.2):
        length = math.hypot(x1 - x0, y1 - y0)
        nx, ny = -(y1 - y0) / length * 1e-3, (x1 - x0) / length * 1e-3
        left = Point((x0 + x1) / 2 + nx, (y0 + y1) / 2 + ny)
        right = Point((x0 + x1) / 2 - nx, (y0 + y1) / 2 - ny)
        assert Polygon(described.outline).contains(left) and not matter.contains(left)
        assert matter.contains(right) or not Polygon(described.outline).contains(right)


def test_a_description_that_makes_no_sense_says_why() -> None:
    with pytest.raises(ConfigError, match="counter-clockwise"):
        Room("r", "", SQUARE[::-1], (), ROUTE)
    with pytest.raises(ConfigError, match="three waypoints"):
        Room("r", "", SQUARE, (), ROUTE[:2])
    with pytest.raises(ConfigError, match="start inside matter"):
        room(Box(1.0, 1.0, 1.0, 1.0, 1.0)).segments(0.2)
    with pytest.raises(ConfigError, match="must stand clear"):
        room(Cylinder(3.9, 2.0, 0.2, 1.0)).corners(0.2)
    with pytest.raises(ConfigError, match="positive length"):
        Box(0.0, 0.0, 1.0, 0.0, 1.0)
    with pytest.raises(ConfigError, match="positive radius"):
        Cylinder(0.0, 0.0, 0.1, 1.0, bottom=1.0)
