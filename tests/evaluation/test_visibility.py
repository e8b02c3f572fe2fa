from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.evaluation.ground_truth import GroundTruth
from contourslam.evaluation.visibility import VisibilityLimits, cast_beams, visible_corners
from contourslam.geometry.poses import compose, transform

TURN = np.linspace(-np.pi, np.pi, 720, endpoint=False)
NO_CIRCLES = np.empty((0, 3))


def _cast_in_numpy(pose, angles, segments, circles, max_range):
    """Plain twin of the kernel: every beam against every outline at once."""
    e = np.stack([np.cos(pose[2] + angles), np.sin(pose[2] + angles)], axis=-1)
    cross = lambda a, b: a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]  # noqa: E731 - reads like the formula
    a, d = segments[:, 0] - pose[:2], segments[:, 1] - segments[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = cross(a, d)[None] / cross(e[:, None], d[None])
        share = cross(a[None], e[:, None]) / cross(e[:, None], d[None])
        straight = np.where((along > 0) & (share >= 0) & (share <= 1), along, np.inf)
        c = circles[:, :2] - pose[:2]
        middle = e @ c.T
        root = middle - np.sqrt(circles[:, 2] ** 2 - (c**2).sum(axis=1) + middle**2)
        rounded = np.where(root > 0, root, np.inf)
    both = np.concatenate([straight, rounded], axis=1)
    hits, ranges = both.argmin(axis=1), both.min(axis=1)
    out = ~(ranges < max_range)
    return np.where(out, np.inf, ranges), np.where(out, -1, hits)


def test_ranges_agree_with_the_plain_twin():
    rng = np.random.default_rng(8)
    seen = set()
    for _ in range(10):
        segments, circles = rng.uniform(-5, 5, (8, 2, 2)), rng.uniform([-3, -3, 0.1], [3, 3, 0.3], (5, 3))
        pose, angles = rng.uniform([-1, -1, -4], [1, 1, 4]), rng.uniform(-4, 4, 300)
        ranges, hits = cast_beams(pose, angles, segments, circles, max_range=2.5)
        wanted, wanted_hits = _cast_in_numpy(pose, angles, segments, circles, 2.5)
        np.testing.assert_allclose(ranges, wanted, rtol=1e-9)
        np.testing.assert_array_equal(hits, wanted_hits)
        seen.update(hits.tolist())
    assert -1 in seen
    assert max(seen) >= 8


def test_ranges_in_a_known_room(square_room):
    ranges, hits = cast_beams(np.zeros(3), np.radians([0.1, 90, 180, -90]), square_room.segments, NO_CIRCLES)
    np.testing.assert_allclose(ranges, [3.0 / np.cos(np.radians(0.1)), 2.0, 3.0, 2.0])
    assert hits.tolist() == [1, 2, 3, 0]


def test_a_beam_meets_the_near_side_of_a_column():
    ranges, hits = cast_beams(np.zeros(3), np.array([0.0, np.pi]), np.empty((0, 2, 2)), np.array([[2.0, 0.0, 0.5]]))
    assert ranges.tolist() == [1.5, np.inf]
    assert hits.tolist() == [0, -1]


def test_in_an_empty_room_all_its_corners_are_visible(square_room):
    walls = replace(square_room, segments=square_room.segments[:4])
    assert visible_corners(walls, np.zeros(3), TURN).tolist() == [True] * 4 + [False] * 4


def test_a_box_hides_what_is_behind_it_and_shows_the_edge_between_its_two_near_sides(square_room):
    seen = visible_corners(square_room, np.array([0.0, -0.5, 0.3]), TURN)
    # The box stands straight ahead: one side faces the lidar, so none of its edges shows two sides. It covers
    # bearings of -27° to 27°, the room's right corners lie at -27° and 40°: the lower one is just covered.
    assert seen.tolist() == [True, False, True, True, False, False, False, False]
    diagonal = visible_corners(square_room, np.array([0.0, 1.0, 0.0]), TURN)
    assert diagonal[4:].tolist() == [False, False, False, True]


def test_the_field_of_view_limits_what_is_visible(square_room):
    walls = replace(square_room, segments=square_room.segments[:4])
    ahead = np.linspace(-np.pi / 2, np.pi / 2, 181)
    assert visible_corners(walls, np.zeros(3), ahead)[:4].tolist() == [False, True, True, False]
    assert visible_corners(walls, np.array([0.0, 0.0, np.pi]), ahead)[:4].tolist() == [True, False, False, True]


def test_range_incidence_and_beam_spacing_limit_what_is_visible(square_room):
    walls = replace(square_room, segments=square_room.segments[:4])
    near_corner = np.array([-2.0, -1.5, 0.0])

    def seen(pose, angles=TURN, **limits):
        return visible_corners(walls, pose, angles, VisibilityLimits(**limits))[:4].tolist()

    assert seen(near_corner, max_range=2.0) == [True, False, False, False]
    assert seen(np.array([-2.8, 0.0, 0.0]), min_incidence_deg=10.0) == [False, True, True, False]
    assert seen(np.array([-2.8, 0.0, 0.0]), min_incidence_deg=5.0, min_side=0.1) == [True] * 4
    assert seen(np.zeros(3), np.linspace(-np.pi, np.pi, 12, endpoint=False)) == [False] * 4
    assert seen(np.zeros(3), min_side=3.5) == [True] * 4
    assert seen(np.zeros(3), min_side=4.5) == [False] * 4  # two of the walls are 4 m long
    assert seen(np.zeros(3), np.array([0.3])) == [False] * 4


def test_something_thin_in_front_of_a_side_breaks_it(square_room):
    walls = replace(square_room, segments=square_room.segments[:4])
    leg = np.array([[-2.6, -1.8, 0.03]])  # in front of the lower wall, a little beside the corner
    assert visible_corners(walls, np.zeros(3), TURN)[0]
    assert not visible_corners(replace(walls, circles=leg), np.zeros(3), TURN)[0]


@given(
    theta=st.floats(-7, 7),
    x=st.floats(-50, 50),
    y=st.floats(-50, 50),
    place=st.tuples(st.floats(-2.7, 2.7), st.floats(0.3, 1.7)),
)
@settings(max_examples=40, deadline=None)
def test_visibility_does_not_depend_on_where_the_room_stands(square_room_value, theta, x, y, place):
    frame = np.array([x, y, theta])
    room = square_room_value
    moved = GroundTruth(
        transform(frame, room.segments),
        room.circles,
        transform(frame, room.positions),
        room.directions + theta,
        room.openings,
        room.convex,
    )
    pose = np.array([*place, 0.4])
    seen, again = visible_corners(room, pose, TURN), visible_corners(moved, compose(frame, pose), TURN)
    # A corner on the edge of a limit may tip by rounding: those stay out of the comparison.
    strict = visible_corners(room, pose, TURN, VisibilityLimits(31.0, 9.9, 4, 0.2))
    loose = visible_corners(room, pose, TURN, VisibilityLimits(29.0, 10.1, 6, 0.3))
    settled = strict == loose
    np.testing.assert_array_equal(seen[settled], again[settled])


@pytest.fixture(scope="module")
def square_room_value() -> GroundTruth:
    box = np.array([[1.0, -1.0], [2.0, -1.0], [2.0, 0.0], [1.0, 0.0]])
    room = box * [6.0, 4.0] - [9.0, -2.0]
    rings = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in (room, box)]
    inward = np.radians([45.0, 135.0, -135.0, -45.0] * 2)
    convex = np.array([False] * 4 + [True] * 4)
    return GroundTruth(
        np.concatenate(rings), NO_CIRCLES, np.concatenate([room, box]), inward, np.full(8, np.pi / 2), convex
    )


def test_sides_and_their_normals_follow_from_the_bisector(square_room):
    sides, normals = square_room.sides()
    np.testing.assert_allclose(np.sort(sides[0], axis=0), [[0, 0], [1, 1]], atol=1e-12)  # lower left corner of the room
    assert (normals[0] @ np.array([1.0, 1.0]) > 0).all()  # into the room
    assert (normals[4] @ np.array([1.0, 1.0]) < 0).all()  # out of the box
    np.testing.assert_allclose(np.einsum("csi,csi->cs", sides, normals), 0.0, atol=1e-12)


def test_a_misshapen_truth_is_refused(square_room):
    with pytest.raises(ValueError, match=r"directions has shape \(3,\), wanted \(8,\)"):
        replace(square_room, directions=np.zeros(3))
