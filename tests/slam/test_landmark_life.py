"""Landmarks are born after several sightings, given up or dropped where they are not seen, and twins become one."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import SlamConfig
from contourslam.landmarks import Corners, Walls
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.landmark_life import FORGET_AFTER, SAME_PLACE, Nursery, bear, drop_unseen, merge_twins
from contourslam.slam.motion import predict
from contourslam.slam.observation import Observations, to_world

Floats = NDArray[np.float64]
MapOf = Callable[..., LandmarkFilter]
See = Callable[..., Observations]
MakeCorners = Callable[..., Corners]
MakeWalls = Callable[..., Walls]

HERE = np.zeros(3)


class Life:
    """A filter that stands still, and its nursery."""

    def __init__(self, filter_: LandmarkFilter, sightings: int = 3) -> None:
        self.filter, self.nursery, self.config = filter_, Nursery(), SlamConfig(sightings_to_birth=sightings)

    def see(self, seen: Observations, matched: list[int] | None = None) -> tuple[int, ...]:
        """One scan; returns the ids of the newborn."""
        chosen = np.full(len(seen), -1) if matched is None else np.array(matched)
        world = to_world(HERE, HERE, seen.looks)
        return bear(self.filter, self.nursery, seen, world, chosen, HERE, self.config)


@pytest.mark.parametrize("sightings", [1, 2, 3, 5])
@pytest.mark.parametrize("what", ["corner", "wall"])
def test_a_landmark_is_born_after_the_configured_number_of_sightings(
    map_of: MapOf, see: See, corners_at: MakeCorners, walls_at: MakeWalls, sightings: int, what: str
) -> None:
    life = Life(map_of(), sightings)
    seen = see(corners_at([2.0, 1.0])) if what == "corner" else see(walls=walls_at([[[2.0, -1.0], [2.0, 1.0]]]))
    births = [life.see(seen) for _ in range(sightings)]
    assert births == [()] * (sightings - 1) + [(0,)]
    landmarks = life.filter.corner_map() if what == "corner" else life.filter.wall_map()
    assert landmarks.ids.tolist() == [0]


def test_sightings_need_not_follow_each_other(map_of: MapOf, see: See, corners_at: MakeCorners) -> None:
    life, seen = Life(map_of()), see(corners_at([2.0, 1.0]))
    life.see(seen)
    for _ in range(FORGET_AFTER - 1):
        assert life.see(see()) == ()
    assert life.see(seen) == ()
    assert life.see(seen) == (0,)


@pytest.mark.parametrize("sightings", [1, 2])
def test_a_landmark_in_the_making_is_given_up_after_silence(
    map_of: MapOf, see: See, corners_at: MakeCorners, sightings: int
) -> None:
    life, seen = Life(map_of()), see(corners_at([2.0, 1.0]))
    for _ in range(sightings):
        assert life.see(seen) == ()
    for _ in range(FORGET_AFTER):
        life.see(see())
    assert life.see(seen) == life.see(seen) == ()  # counted from one again
    assert life.see(seen) == (0,)


def test_two_observations_in_one_scan_are_one_sighting(map_of: MapOf, see: See, corners_at: MakeCorners) -> None:
    life = Life(map_of(), 3)
    life.see(see(corners_at([2.0, 1.0])))
    assert life.see(see(corners_at([[2.0, 1.05], [2.0, 0.95]]))) == ()
    assert len(life.see(see(corners_at([2.0, 1.0])))) == 1


def test_only_what_matched_no_landmark_is_raised(map_of: MapOf, see: See, corners_at: MakeCorners) -> None:
    life = Life(map_of(corners_at([2.0, 1.0])), 1)
    assert life.see(see(corners_at([[2.0, 1.0], [-1.0, 2.0]])), [0, -1]) == (1,)
    np.testing.assert_allclose(life.filter.corner_map().positions, [[2.0, 1.0], [-1.0, 2.0]])


def test_a_landmark_seen_badly_does_not_beget_another_beside_it(
    map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    life = Life(map_of(corners_at([2.0, 1.0])), 1)
    assert life.see(see(corners_at([2.0, 1.0 + 0.9 * SAME_PLACE]))) == ()
    assert life.see(see(corners_at([2.0, 1.0 + 1.1 * SAME_PLACE]))) == (1,)


@pytest.mark.parametrize("sightings", [1, 3])
def test_unlike_corners_in_one_place_are_raised_apart(
    map_of: MapOf, see: See, corners_at: MakeCorners, sightings: int
) -> None:
    # The two edges of a thin partition's end.
    life = Life(map_of(), sightings)
    seen = see(corners_at([[2.0, 1.0], [2.0, 1.1]], directions=[0.0, math.pi / 2]))
    assert [life.see(seen) for _ in range(sightings)][-1] == (0, 1)


def test_a_landmark_once_dropped_is_born_again_under_another_id(
    map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    life, seen = Life(map_of(), 1), see(corners_at([2.0, 1.0]))
    assert life.see(seen) == (0,)
    life.filter.drop(0)
    assert life.see(seen) == (1,)


def test_landmarks_are_dropped_by_their_false_negative_rate_and_not_before_their_chances(
    map_of: MapOf, corners_at: MakeCorners
) -> None:
    config = SlamConfig(max_false_negative_rate=0.7, min_chances=20)
    filter_ = map_of(corners_at([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0], [5.0, 0.0]]))
    filter_.observed[:5] = [6, 5, 0, 0, 300]
    filter_.failed[:5] = [14, 15, 19, 20, 699]  # rates 0.7, 0.75, too few chances, 1.0, 0.6997
    assert set(drop_unseen(filter_, config)) == {1, 3}
    left = filter_.corner_map()
    np.testing.assert_array_equal(left.ids, [0, 2, 4])
    np.testing.assert_allclose(left.positions[:, 0], [1.0, 3.0, 5.0])


def blurred(filter_: LandmarkFilter, full: Callable[..., Floats]) -> Floats:
    """Give the map's landmarks some doubt that they share, as after a drive."""
    noise = np.diag([0.02, 0.02, 0.005]) ** 2
    predict(filter_.mean, filter_.covariance, filter_.size, HERE, noise, HERE)
    return full(filter_)


@pytest.mark.parametrize("younger_seen", [True, False])
def test_twin_corners_become_one_under_the_older_id(
    map_of: MapOf, corners_at: MakeCorners, full: Callable[..., Floats], younger_seen: bool
) -> None:
    filter_ = map_of(corners_at([[2.0, 1.0], [-1.0, 1.0], [2.02, 1.01]], sides=[[1.0, 0.4], [1, 1], [0.3, 0.9]]))
    filter_.observed[:3], filter_.failed[:3] = [10, 20, 5], [1, 2, 3]
    before = blurred(filter_, full)
    assert merge_twins(filter_, np.array([2 if younger_seen else 0])) == (2,)
    left, P = filter_.corner_map(), full(filter_)
    np.testing.assert_array_equal(left.ids, [0, 1])
    np.testing.assert_array_equal(left.observed, [15, 20])
    np.testing.assert_array_equal(left.failed, [4, 2])
    # Both were known to 1 cm and are tied to 1 cm: the older one moves by a third of the way.
    np.testing.assert_allclose(left.positions[0], [2.0 + 0.02 / 3, 1.0 + 0.01 / 3], atol=1e-9)
    np.testing.assert_array_equal(filter_.table[0, 8:10], [1.0, 0.9])  # the longest seen of each side
    assert np.linalg.eigvalsh(P).min() > 0.0
    assert np.trace(P[3:5, 3:5]) < np.trace(before[3:5, 3:5])  # what the younger one knew was not lost


@pytest.mark.parametrize("heading", [0.0, 1.0, math.pi / 2, math.pi, -2.0])
def test_twin_walls_become_one_over_the_extent_of_both(
    map_of: MapOf, walls_at: MakeWalls, full: Callable[..., Floats], heading: float
) -> None:
    # Two pieces of one wall that overlap, with anchors a metre and a half apart; the second a centimetre off.
    pieces = [[[2.0, -1.0], [2.0, 1.0]], [[2.01, 0.5], [2.01, 2.5]]]
    filter_ = map_of(walls=walls_at(pieces), pose=(0.3, -0.4, heading))
    filter_.observed[:2], filter_.failed[:2] = [10, 5], [1, 3]
    before = blurred(filter_, full)
    assert merge_twins(filter_, np.array([1], dtype=np.int64)) == (1,)
    left, P = filter_.wall_map(), full(filter_)
    assert (left.ids.tolist(), left.observed.tolist(), left.failed.tolist()) == ([0], [15], [4])
    ends = left.end_points[0] - [0.3, -0.4]
    cos, sin = math.cos(heading), math.sin(heading)
    seen_from_there = ends @ np.array([[cos, -sin], [sin, cos]])
    np.testing.assert_allclose(seen_from_there, [[2.0, -1.0], [2.0, 2.5]], atol=0.02)
    assert np.linalg.eigvalsh(P).min() > 0.0
    assert P[3, 3] < before[3, 3]
    assert -math.pi <= left.normals[0] <= math.pi


TWINS_THAT_ARE_NONE = {
    "too far apart": ({"positions": [[2.0, 1.0], [2.0, 1.2]]}, None),
    "convex and concave": ({"positions": [[2.0, 1.0], [2.0, 1.0]], "convex": [True, False]}, None),
    "facing other ways": ({"positions": [[2.0, 1.0], [2.0, 1.0]], "directions": [0.0, math.pi / 2]}, None),
    "two faces": (None, [[[2.0, -1.0], [2.0, 1.0]], [[2.0, 1.0], [2.0, -1.0]]]),
    "one after the other": (None, [[[2.0, -1.0], [2.0, 1.0]], [[2.0, 1.05], [2.0, 2.5]]]),
    "a step in the wall": (None, [[[2.0, -1.0], [2.0, 1.0]], [[2.1, -1.0], [2.1, 1.0]]]),
    "an angle between them": (None, [[[2.0, -1.0], [2.0, 1.0]], [[1.8, -1.0], [2.3, 1.0]]]),
}


@pytest.mark.parametrize("why", TWINS_THAT_ARE_NONE)
def test_landmarks_that_the_filter_can_tell_apart_stay_two(
    map_of: MapOf, corners_at: MakeCorners, walls_at: MakeWalls, why: str
) -> None:
    corners, walls = TWINS_THAT_ARE_NONE[why]
    filter_ = map_of(corners and corners_at(**corners), walls and walls_at(walls))
    assert merge_twins(filter_, np.array([0, 1], dtype=np.int64)) == ()
    assert filter_.count == 2


def test_twins_are_looked_for_only_among_what_was_just_seen(map_of: MapOf, corners_at: MakeCorners) -> None:
    filter_ = map_of(corners_at([[2.0, 1.0], [2.0, 1.0], [-1.0, 1.0]]))
    assert merge_twins(filter_, np.array([2], dtype=np.int64)) == ()
    assert merge_twins(filter_, np.array([], dtype=np.int64)) == ()
    assert merge_twins(filter_, np.array([1, 2], dtype=np.int64)) == (1,)


def test_after_a_long_life_of_births_merges_and_deaths_the_covariance_is_positive_definite(
    map_of: MapOf, see: See, corners_at: MakeCorners, walls_at: MakeWalls, full: Callable[..., Floats]
) -> None:
    rng = np.random.default_rng(0)
    filter_ = map_of()
    ids: list[int] = []
    merged = 0
    for step in range(400):
        noise = np.diag([1e-4, 1e-4, 1e-5])
        predict(filter_.mean, filter_.covariance, filter_.size, HERE, noise, filter_.mean[:3].copy())
        where = rng.uniform([1.0, -3.0], [7.0, 3.0])
        if step % 2:
            seen = see(corners_at(where, sigma=0.03))
        else:
            seen = see(walls=walls_at([[where, where + np.array([0.3, 1.0])]], sigma_angle=0.03, sigma_distance=0.03))
        ids.append(filter_.add(HERE, seen, 0))
        gone = merge_twins(filter_, np.arange(filter_.count))
        merged += len(gone)
        if filter_.count > 15:
            filter_.drop(int(rng.integers(filter_.count)))
        assert np.linalg.eigvalsh(full(filter_)).min() > 0.0, f"step {step}"
    assert merged > 20
    assert all(a < b for a, b in pairwise(ids))  # no id came twice
