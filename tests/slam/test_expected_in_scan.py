"""A failure counts only where the landmark should have been seen: in view, in range, facing the lidar, not hidden."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import LandmarkConfig
from contourslam.landmarks import Corners, Walls
from contourslam.scan import LaserScan
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.visibility import expected_in_scan

Floats = NDArray[np.float64]
MapOf = Callable[..., LandmarkFilter]
MakeCorners = Callable[..., Corners]
MakeWalls = Callable[..., Walls]
Rooms = Callable[..., Floats]
Scans = Callable[..., LaserScan]

LIMITS = LandmarkConfig()
ROOM = [[-3.0, -2.0], [3.0, -2.0], [3.0, 2.0], [-3.0, 2.0]]
BOX = [[1.0, -0.5], [1.0, 0.5], [2.0, 0.5], [2.0, -0.5]]


def expected(
    filter_: LandmarkFilter, scan: LaserScan, lidar: tuple[float, ...] = (0.0, 0.0, 0.0), max_range: float = 30.0
) -> list[int]:
    """Indices of the landmarks that the scan should show."""
    marks = expected_in_scan(
        filter_.mean, filter_.table, filter_.count, np.array(lidar), scan.angles, scan.ranges, max_range,
        LIMITS.min_side, LIMITS.min_side_points, LIMITS.min_wall, LIMITS.min_wall_points,
    )  # fmt: skip
    return np.flatnonzero(marks).tolist()


@pytest.fixture
def room_map(map_of: MapOf, corners_at: MakeCorners, walls_at: MakeWalls) -> LandmarkFilter:
    """The four corners of the room and its four walls, seen from the middle."""
    corners = np.array(ROOM)
    inwards = np.arctan2(-np.sign(corners[:, 1]), -np.sign(corners[:, 0]))
    walls = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    return map_of(corners_at(corners, directions=inwards, convex=False, sides=(2.0, 2.0)), walls_at(walls))


@pytest.fixture
def box_map(map_of: MapOf, corners_at: MakeCorners, walls_at: MakeWalls) -> LandmarkFilter:
    """The edges of a box ahead, all four though only two can be seen from one place, and its four faces."""
    corners = np.array(BOX)
    inwards = np.arctan2(-np.sign(corners[:, 1]), np.where(corners[:, 0] < 1.5, 1.0, -1.0))
    faces = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    return map_of(corners_at(corners, directions=inwards, convex=True, sides=(1.0, 1.0)), walls_at(faces))


def test_all_of_an_empty_room_is_expected(room_map: LandmarkFilter, room: Rooms, scan_of: Scans) -> None:
    assert expected(room_map, scan_of(room(ROOM))) == list(range(8))


@given(heading=st.floats(-math.pi, math.pi), start=st.floats(-math.pi, math.pi))
def test_a_full_turn_has_no_seam_wherever_it_starts(
    map_of: MapOf, corners_at: MakeCorners, room: Rooms, scan_of: Scans, heading: float, start: float
) -> None:
    corners = np.array(ROOM)
    inwards = np.arctan2(-np.sign(corners[:, 1]), -np.sign(corners[:, 0]))
    filter_ = map_of(corners_at(corners, directions=inwards, convex=False, sides=(2.0, 2.0)))
    scan = scan_of(room(ROOM), (0.0, 0.0, heading), start=start)
    assert expected(filter_, scan, (0.0, 0.0, heading)) == [0, 1, 2, 3]


@pytest.mark.parametrize(("heading", "ahead"), [(0.0, [1, 2]), (math.pi / 2, [2, 3]), (math.pi, [0, 3])])
def test_corners_outside_the_field_of_view_are_not_expected(
    room_map: LandmarkFilter, room: Rooms, scan_of: Scans, heading: float, ahead: list[int]
) -> None:
    scan = scan_of(room(ROOM), (0.0, 0.0, heading), beams=181, start=-math.pi / 2, field_of_view=math.pi * 181 / 180)
    assert [i for i in expected(room_map, scan, (0.0, 0.0, heading)) if i < 4] == ahead


@pytest.mark.parametrize("beyond", [0.3, 0.9, 5.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_corner_just_outside_the_field_of_view_is_not_expected(
    map_of: MapOf, corners_at: MakeCorners, scan_of: Scans, beyond: float, side: float
) -> None:
    # No wall at all, so every beam reaches everywhere; the first beams look to the right, the last to the left.
    bearing = side * math.radians(90.0 + beyond)
    scan = LaserScan(0.0, np.radians(np.arange(-90.0, 90.5)), np.full(181, math.inf), np.zeros(181), 0.05, 30.0)
    corner = corners_at([2.0 * math.cos(bearing), 2.0 * math.sin(bearing)], directions=bearing, sides=(1.0, 1.0))
    assert expected(map_of(corner), scan) == []
    inside = side * math.radians(60.0)
    corner = corners_at([2.0 * math.cos(inside), 2.0 * math.sin(inside)], directions=inside, sides=(1.0, 1.0))
    assert expected(map_of(corner), scan) == [0]


@pytest.mark.parametrize("bearing_deg", [86.0, -86.0])
def test_a_corner_in_view_whose_side_is_not_is_not_expected(
    map_of: MapOf, corners_at: MakeCorners, bearing_deg: float
) -> None:
    # A corner needs both its sides: 4 degrees at 2 m show 14 cm of the one beyond it, less than the least side.
    bearing = math.radians(bearing_deg)
    scan = LaserScan(0.0, np.radians(np.arange(-90.0, 90.5)), np.full(181, math.inf), np.zeros(181), 0.05, 30.0)
    corner = corners_at([2.0 * math.cos(bearing), 2.0 * math.sin(bearing)], directions=bearing, sides=(1.0, 1.0))
    assert expected(map_of(corner), scan) == []


def test_a_corner_whose_side_is_hidden_is_not_expected(room_map: LandmarkFilter, room: Rooms, scan_of: Scans) -> None:
    # A box stands before the wall, from half a metre beside the corner on; the corner itself is in the open.
    box = [[2.6, -0.9], [2.6, -1.7], [2.7, -1.7], [2.7, -0.9]]
    assert 1 in expected(room_map, scan_of(room(ROOM)))
    assert 1 not in expected(room_map, scan_of(room(ROOM, box)))


def test_what_is_beyond_the_range_is_not_expected(room_map: LandmarkFilter, room: Rooms, scan_of: Scans) -> None:
    scan = scan_of(room(ROOM))
    diagonal = math.hypot(3.0, 2.0)
    assert expected(room_map, scan, max_range=diagonal + 0.01)[:4] == [0, 1, 2, 3]
    assert [i for i in expected(room_map, scan, max_range=diagonal - 0.01) if i < 4] == []
    assert [i for i in expected(room_map, scan, max_range=2.5) if i >= 4] == [4, 6]  # the walls 2 m away
    assert expected(room_map, scan, max_range=1.9) == []


def test_what_a_box_hides_is_not_expected(room_map: LandmarkFilter, room: Rooms, scan_of: Scans) -> None:
    screen = [[2.0, 1.0], [1.5, 1.9], [1.6, 1.95], [2.1, 1.05]]
    seen = expected(room_map, scan_of(room(ROOM, screen)))
    assert 2 not in seen
    assert {0, 1, 3} <= set(seen)
    # A screen before one whole wall hides the wall and its corners.
    screen = [[1.0, -1.95], [1.0, 1.95], [1.1, 1.95], [1.1, -1.95]]
    seen = expected(room_map, scan_of(room(ROOM, screen)))
    assert {0, 3, 7} <= set(seen)
    assert not {1, 2, 5} & set(seen)


def test_a_wall_seen_only_in_pieces_too_short_for_one_is_not_expected(
    map_of: MapOf, walls_at: MakeWalls, room: Rooms, scan_of: Scans
) -> None:
    wall = [[2.0, -1.8], [2.0, 1.8], [2.1, 1.8], [2.1, -1.8]]
    posts = [
        [[1.0, y - 0.1], [1.0, y + 0.1], [1.05, y + 0.1], [1.05, y - 0.1]] for y in (-0.8, -0.4, 0.0, 0.4, 0.8)
    ]  # between them 40 cm of the wall each, and half a metre makes a wall
    filter_ = map_of(walls=walls_at([wall[:2]]))
    assert expected(filter_, scan_of(room(wall))) == [0]
    assert expected(filter_, scan_of(room(wall, *posts[:2]))) == [0]
    assert expected(filter_, scan_of(room(wall, *posts))) == []


def test_faces_and_edges_that_look_away_are_not_expected(box_map: LandmarkFilter, room: Rooms, scan_of: Scans) -> None:
    box = room(BOX)
    for lidar, edges, faces in (
        ((-1.0, 2.5, 0.0), {1}, {0, 1}),  # to the left before it: the near left edge, the front and the left face
        ((-1.0, -2.5, 1.0), {0}, {0, 3}),
        ((4.0, 2.5, -3.0), {2}, {1, 2}),
    ):
        seen = set(expected(box_map, scan_of(box, lidar), lidar))
        # The edges beside it are in sight too, but show one face each.
        assert {i for i in seen if i < 4} == edges
        assert {i - 4 for i in seen if i >= 4} == faces


def test_small_landmarks_and_far_ones_are_not_expected(map_of: MapOf, corners_at: MakeCorners, walls_at: MakeWalls,
                                                       scan_of: Scans) -> None:  # fmt: skip
    nothing = np.full(181, math.inf)
    scan = LaserScan(0.0, np.radians(np.arange(-90.0, 90.5)), nothing, np.zeros(181), 0.05, 30.0)
    at = corners_at([2.0, 0.0], sides=(1.0, 1.0))
    assert expected(map_of(at), scan) == [0]
    assert expected(map_of(corners_at([2.0, 0.0], sides=(1.0, 0.2))), scan) == []  # a side shorter than asked for
    assert expected(map_of(corners_at([12.0, 0.0], sides=(1.0, 1.0))), scan) == []  # four beams a side
    assert expected(map_of(walls=walls_at([[[2.0, -1.0], [2.0, 1.0]]])), scan) == [0]
    assert expected(map_of(walls=walls_at([[[2.0, -0.2], [2.0, 0.3]]])), scan) == []
    assert expected(map_of(walls=walls_at([[[20.0, -1.0], [20.0, 1.0]]])), scan) == []  # six beams


def test_surfaces_seen_at_a_grazing_angle_are_not_expected(map_of: MapOf, corners_at: MakeCorners) -> None:
    scan = LaserScan(0.0, np.radians(np.arange(-90.0, 90.5, 0.25)), np.full(722, math.inf), np.zeros(722), 0.05, 30.0)
    # Directions of a right angle's bisector: at 45 degrees one side lies along the beam.
    for turn, seen in ((0.0, [0]), (25.0, [0]), (35.0, []), (45.0, []), (90.0, [])):
        corner = corners_at([2.0, 0.0], directions=math.radians(turn), sides=(1.0, 1.0))
        assert expected(map_of(corner), scan) == seen, turn


@pytest.mark.parametrize("nothing", [math.nan, 0.0, -1.0])
def test_beams_that_tell_nothing_are_no_evidence(room_map: LandmarkFilter, nothing: float, scan_of: Scans,
                                                 room: Rooms) -> None:  # fmt: skip
    scan = scan_of(room(ROOM))
    ranges = np.where(np.abs(scan.angles) < math.pi / 2, nothing, scan.ranges)
    blind = LaserScan(0.0, scan.angles, ranges, scan.offsets, 0.05, 30.0)
    assert expected(room_map, blind)[:2] == [0, 3]
    assert not {1, 2, 5} & set(expected(room_map, blind))


@pytest.mark.parametrize("far", [math.inf, 30.0, 81.83])
def test_beams_that_met_nothing_prove_that_nothing_was_there(room_map: LandmarkFilter, far: float) -> None:
    angles = np.linspace(-math.pi, math.pi, 500, endpoint=False)
    scan = LaserScan(0.0, angles, np.full(500, far), np.zeros(500), 0.05, 30.0)
    assert expected(room_map, scan) == list(range(8))


@pytest.mark.parametrize("beams", [0, 1])
def test_a_scan_of_hardly_a_beam_expects_nothing(room_map: LandmarkFilter, beams: int) -> None:
    scan = LaserScan(0.0, np.zeros(beams), np.full(beams, 9.0), np.zeros(beams), 0.05, 30.0)
    assert expected(room_map, scan) == []
