from collections.abc import Callable

import numpy as np
import pytest

from contourslam.errors import ConfigError
from contourslam.simulation.buildings import Building, office_building
from contourslam.simulation.ray_casting import outlines
from contourslam.simulation.ways import LOOP_DEPTH, LOOP_RADIUS


@pytest.fixture(scope="module")
def building() -> Building:
    return office_building(4, 2)


def test_the_same_seed_gives_the_same_building_and_another_seed_another(building: Building) -> None:
    assert office_building(4, 2) == building
    assert office_building(4, 3) != building


@pytest.mark.parametrize("seed", range(4))
def test_corridors_connect_and_no_junction_is_a_dead_end(seed: int) -> None:
    building = office_building(6, seed)
    assert len(building.stretches) < 2 * 6 * 5  # some fire doors are shut
    for junction in building.junctions:
        assert sum(junction in stretch for stretch in building.stretches) >= 2
    reached = {(0, 0)}
    for _ in range(36):
        reached |= {j for stretch in building.stretches if reached & set(stretch) for j in stretch}
    assert reached == set(building.junctions)


def test_open_corridors_and_doorways_are_wide_enough(building: Building, clearance: Callable[..., np.ndarray]) -> None:
    matter = outlines(building.room, 0.2)
    for (a, b), doorways in building.stretches.items():
        start, end = np.array(building.junctions[a]), np.array(building.junctions[b])
        assert clearance(start + np.linspace(0, 1, 25)[:, None] * (end - start), *matter).min() > 0.55
        for doorway in doorways:
            inward = np.array(doorway.inward)
            middle = np.array([doorway.x, doorway.y])
            assert clearance(middle + np.linspace(-0.5, LOOP_DEPTH, 30)[:, None] * inward, *matter).min() > 0.4
            assert clearance((middle + LOOP_DEPTH * inward)[None], *matter).min() > LOOP_RADIUS + 0.3


def test_a_shut_fire_door_bars_the_way(building: Building, cast_ray: Callable[..., np.ndarray]) -> None:
    junctions, matter = building.junctions, outlines(building.room, 0.2)
    shut = 0
    for i, j in junctions:
        for other in ((i + 1, j), (i, j + 1)):
            if other in junctions:
                ray = np.subtract(junctions[other], junctions[i, j])
                origin = np.array([junctions[i, j]])
                seen = cast_ray(origin, np.array([np.arctan2(ray[1], ray[0])]), *matter)[0] > np.hypot(*ray)
                assert seen == (((i, j), other) in building.stretches)
                shut += not seen
    assert shut > 0


@pytest.mark.parametrize("seed", range(3))
def test_walls_and_furniture_leave_no_slivers(seed: int) -> None:
    room = office_building(3, seed).room
    segments = room.segments(0.2)  # raises where a column touches something
    assert np.hypot(*(segments[:, 1] - segments[:, 0]).T).min() > 0.004
    assert len(room.circles(0.2)) >= 1


def test_corridors_look_alike(building: Building) -> None:
    """Doors seen from the corridor repeat: fewer rhythms than walls with doors."""
    rhythms = []
    for (a, _), doorways in building.stretches.items():
        for inward in {doorway.inward for doorway in doorways}:
            start = building.junctions[a]
            on_side = [(d.x - start[0], d.y - start[1]) for d in doorways if d.inward == inward]
            rhythms.append(tuple(sorted(round(x * abs(inward[1]) + y * abs(inward[0]), 1) for x, y in on_side)))
    spaced = [tuple(np.diff(rhythm).round(1)) for rhythm in rhythms if len(rhythm) > 1]
    assert len(set(spaced)) < len(spaced)


@pytest.mark.parametrize("corridors", [1, 41])
def test_a_building_that_cannot_be_is_refused(corridors: int) -> None:
    with pytest.raises(ConfigError, match="corridors must be 2 to 40"):
        office_building(corridors)
