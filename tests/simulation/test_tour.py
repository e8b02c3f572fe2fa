from itertools import islice, pairwise

import numpy as np
import pytest

from contourslam.simulation.buildings import Building, office_building
from contourslam.simulation.tour import Leg, tour


@pytest.fixture(scope="module")
def building() -> Building:
    return office_building(6, 1)


def way(leg: Leg) -> float:
    return float(np.hypot(*np.diff(np.array(leg.points), axis=0).T).sum())


def shares(legs: list[Leg]) -> tuple[float, float]:
    """Metres on new and on known ground."""
    return sum(way(leg) for leg in legs if leg.fresh), sum(way(leg) for leg in legs if not leg.fresh)


def test_half_of_the_way_explores_and_half_comes_back(building: Building) -> None:
    for count in (150, 300):
        fresh, again = shares(list(islice(tour(building, 3), count)))
        assert 0.4 < fresh / (fresh + again) < 0.6


def test_once_all_has_been_seen_the_robot_still_drives() -> None:
    legs = list(islice(tour(office_building(2, 0), 0), 400))
    assert sum(leg.fresh for leg in legs[:40]) > 4
    assert sum(leg.fresh for leg in legs[200:]) == 0


def test_each_leg_begins_where_the_last_one_ended_or_across_a_junction(building: Building) -> None:
    legs = list(islice(tour(building, 0), 200))
    gaps = [np.hypot(*np.subtract(after.points[0], before.points[-1])) for before, after in pairwise(legs)]
    assert max(gaps) < 2.0


def test_fresh_legs_lead_where_the_robot_has_not_been(building: Building) -> None:
    been = np.empty((0, 2))
    for leg in islice(tour(building, 5), 150):
        middle = np.mean(leg.points[-2:], axis=0) if len(leg.points) == 2 else np.array(leg.points[6])
        nearest = np.hypot(*(been - middle).T).min(initial=np.inf)
        if leg.fresh:
            assert nearest > 0.4
        parts = [np.linspace(p, q, max(2, int(np.hypot(*np.subtract(q, p)) / 0.1))) for p, q in pairwise(leg.points)]
        been = np.concatenate([been, *parts])


def test_the_seed_decides_the_way(building: Building) -> None:
    first, again, other = (list(islice(tour(building, seed), 60)) for seed in (1, 1, 2))
    assert first == again
    assert first != other
