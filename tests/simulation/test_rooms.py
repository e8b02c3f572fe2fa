from collections.abc import Callable

import numpy as np
import pytest

from contourslam.geometry.angles import wrap
from contourslam.robot.route import sample_route
from contourslam.simulation.rooms import ROOMS

BODY_HEIGHTS = (0.02, 0.1, 0.2, 0.25)


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_goes_by_its_name_and_a_line_of_description(name: str) -> None:
    assert ROOMS[name].name == name
    assert ROOMS[name].description and "\n" not in ROOMS[name].description


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_offers_plenty_of_corners(name: str) -> None:
    corners = ROOMS[name].corners(0.2)
    long = corners.sides >= 0.3
    assert long.sum() >= 20
    assert (long & corners.convex).sum() >= 5
    assert (long & ~corners.convex).sum() >= 5
    assert len(ROOMS[name].circles(0.2)) >= 1


@pytest.mark.parametrize("name", ROOMS)
def test_the_route_keeps_clear_of_matter(name: str, clearance: Callable[..., np.ndarray]) -> None:
    room = ROOMS[name]
    route = sample_route(room.route)
    for height in BODY_HEIGHTS:
        assert clearance(route, room.segments(height), room.circles(height)).min() >= 0.35


@pytest.mark.parametrize("name", ROOMS)
def test_corners_are_in_view_all_along_the_route(name: str, cast_ray: Callable[..., np.ndarray]) -> None:
    room = ROOMS[name]
    corners, segments, circles = room.corners(0.2), room.segments(0.2), room.circles(0.2)
    seen_ever = np.zeros(len(corners.sides), dtype=bool)
    for place in sample_route(room.route)[::50]:
        ray = corners.positions - place
        distance, angle = np.hypot(*ray.T), np.arctan2(ray[:, 1], ray[:, 0])
        reached = cast_ray(np.repeat(place[None], len(ray), axis=0), angle, segments, circles) > distance - 1e-6
        # Both faces of an edge show only to a place in front of both.
        both_faces = ~corners.convex | (np.abs(wrap(angle - corners.directions)) < corners.openings / 2)
        seen = reached & both_faces & (corners.sides >= 0.3) & (distance < 10.0)
        assert seen.sum() >= 4, place
        seen_ever |= seen
    assert seen_ever.sum() >= 20
