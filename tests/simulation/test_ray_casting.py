from collections.abc import Callable

import numpy as np
import pytest

from contourslam.simulation.buildings import office_building
from contourslam.simulation.ray_casting import PlaneCaster, outlines
from contourslam.simulation.rooms import ROOMS

SQUARE = np.array([[[0, 0], [4, 0]], [[4, 0], [4, 4]], [[4, 4], [0, 4]], [[0, 4], [0, 0]]], dtype=np.float64)


@pytest.mark.parametrize("name", ["large_hall", "office_building"])
def test_rays_agree_with_the_plain_way_of_casting(name: str, cast_ray: Callable[..., np.ndarray]) -> None:
    room, chance = ROOMS[name], np.random.default_rng(0)
    origins = np.array(room.route)[chance.integers(0, len(room.route), 2000)] + chance.uniform(-0.1, 0.1, (2000, 2))
    angles = chance.uniform(-np.pi, np.pi, 2000)
    ranges, _ = PlaneCaster(*outlines(room, 0.2)).cast(origins, angles, 100.0)
    np.testing.assert_allclose(ranges, cast_ray(origins, angles, room.segments(0.2), room.circles(0.2)), atol=1e-5)


def test_rays_along_the_axes_and_through_the_corners_of_cells_find_their_wall() -> None:
    caster = PlaneCaster(SQUARE, np.empty((0, 3)))
    angles = np.arange(8) * np.pi / 4
    for origin in ((2.0, 2.0), (1.5, 1.5), (0.5, 3.5), (1.0, 2.25)):
        ranges, incidences = caster.cast(np.tile(origin, (8, 1)), angles, 10.0)
        x, y = origin
        expected = [4 - x, 4 - y, x, y]
        np.testing.assert_allclose(ranges[::2], expected, atol=1e-12)
        np.testing.assert_allclose(incidences[::2], np.pi / 2, atol=1e-7)
        np.testing.assert_allclose(incidences[1::2], np.pi / 4, atol=1e-7)


def test_the_incidence_on_a_column_is_the_angle_to_its_tangent() -> None:
    caster = PlaneCaster(SQUARE, np.array([[2.0, 2.0, 0.5]]))
    ranges, incidences = caster.cast(np.array([[1.0, 2.0], [1.0, 2.25]]), np.zeros(2), 10.0)
    np.testing.assert_allclose(ranges, [0.5, 1 - np.sqrt(0.25 - 0.0625)])
    np.testing.assert_allclose(incidences, [np.pi / 2, np.arccos(0.5)], atol=1e-7)


def test_beyond_the_longest_range_nothing_is_met() -> None:
    ranges, incidences = PlaneCaster(SQUARE, np.empty((0, 3))).cast(np.array([[1.0, 2.0]] * 2), np.zeros(2), 2.5)
    np.testing.assert_array_equal(ranges, np.inf)
    np.testing.assert_array_equal(incidences, 0.0)


def test_no_ray_leaves_a_closed_building(clearance: Callable[..., np.ndarray]) -> None:
    building = office_building(4, 7)
    caster, chance = PlaneCaster(*outlines(building.room, 0.2)), np.random.default_rng(1)
    origins = np.array(list(building.junctions.values()))[chance.integers(0, 16, 20000)]
    origins += chance.uniform(-0.5, 0.5, origins.shape)
    angles = chance.uniform(-np.pi, np.pi, 20000)
    ranges, incidences = caster.cast(origins, angles, 1000.0)
    assert np.isfinite(ranges).all()
    assert (incidences >= 0).all() and (incidences <= np.pi / 2).all()
    hits = origins + ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    assert clearance(hits[::20], *outlines(building.room, 0.2)).max() < 1e-9
