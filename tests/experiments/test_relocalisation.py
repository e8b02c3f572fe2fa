"""Scans to be found: where the robot can stand, the same for the same seed, and judged by a tenth of a metre and 2°."""

import math

import numpy as np
import pytest
from numpy.typing import ArrayLike

pytest.importorskip("shapely", reason="needs the extra 'simulation'")

import shapely

from contourslam.experiments.relocalisation import BODY, HEIGHT, is_near, refurnished, scans_at_random
from contourslam.simulation.room import free_space
from contourslam.simulation.rooms import FURNISHED_ROOM


def test_scans_are_taken_where_the_robot_can_stand_in_the_room_as_it_is_and_as_it_was() -> None:
    changed = refurnished(FURNISHED_ROOM, 3)
    free = [free_space(room, HEIGHT) for room in (FURNISHED_ROOM, changed)]
    for query in scans_at_random(changed, 20, 1, mapped=FURNISHED_ROOM, field_of_view_deg=180.0, beams=90):
        assert query.pose is not None
        spot = shapely.Point(query.pose[:2])
        assert all(part.contains(spot) and part.exterior.distance(spot) > 0.99 * BODY for part in free)
        assert query.scan.angles.shape == (45,)
        assert np.abs(query.scan.angles).max() <= math.pi / 2
        assert np.isfinite(query.scan.ranges).all()


def test_a_seed_gives_the_same_scans_and_furniture_again_and_another_gives_others() -> None:
    once, again, other = (scans_at_random(FURNISHED_ROOM, 2, seed, beams=30)[1].scan.ranges for seed in (1, 1, 2))
    np.testing.assert_array_equal(once, again)
    assert np.abs(once - other).max() > 0.1
    assert refurnished(FURNISHED_ROOM, 1) == refurnished(FURNISHED_ROOM, 1)
    assert refurnished(FURNISHED_ROOM, 1).pieces != refurnished(FURNISHED_ROOM, 2).pieces
    assert refurnished(FURNISHED_ROOM, 1).outline == FURNISHED_ROOM.outline


@pytest.mark.parametrize(
    ("pose", "near"),
    [
        ((1.09, 2.0, 3.13), True),
        ((1.0, 2.0, -3.13), True),
        ((1.11, 2.0, 3.13), False),
        ((1.0, 2.0, 3.08), False),
        ((math.nan, 2.0, 3.13), False),
    ],
)
def test_found_is_within_a_tenth_of_a_metre_and_two_degrees(pose: ArrayLike, near: bool) -> None:
    assert is_near(np.array(pose), np.array([1.0, 2.0, 3.13])) is near
