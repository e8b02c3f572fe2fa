import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.geometry.poses import between_one
from contourslam.matching.align import align
from contourslam.matching.cell_map import CellMap
from contourslam.matching.rescue import find_again

Floats = NDArray[np.float64]
See = Callable[..., Floats]
PRIOR = np.diag([1.0 / 0.001**2, 1.0 / 0.001**2, 1.0 / math.radians(0.1) ** 2])  # wheels that are very sure
TRUTH, OFF = np.array([0.4, 0.1, 0.35]), np.array([0.45, -0.4, math.radians(20.0)])


@pytest.fixture(scope="module")
def cells(see: See, room: Floats) -> CellMap:
    made, chance = CellMap(np.zeros(3), 20.0), np.random.default_rng(0)
    for x in (-0.5, 0.0, 0.5):
        made.insert(see(room, (x, 0.0, 0.0), chance), np.array([x, 0.0, 0.0]))
    return made


def test_a_scan_that_the_wheels_have_far_off_is_found_by_the_search(see: See, room: Floats, cells: CellMap) -> None:
    scan = see(room, TRUTH, np.random.default_rng(1))
    wrong = TRUTH + OFF
    poor = align(scan, cells, wrong, PRIOR)
    found, contradicts = find_again(scan, cells, [wrong], PRIOR, poor, enough=0.9)
    assert contradicts
    assert found.overlap > poor.overlap + 0.3
    assert np.abs(between_one(TRUTH, found.pose)).max() < 0.015


def test_another_expectation_that_fits_spares_the_search(see: See, room: Floats, cells: CellMap) -> None:
    scan = see(room, TRUTH, np.random.default_rng(2))
    wrong = TRUTH + OFF
    poor = align(scan, cells, wrong, PRIOR)
    found, contradicts = find_again(scan, cells, [wrong, TRUTH + 0.02], PRIOR, poor, enough=0.9)
    assert contradicts
    assert np.abs(between_one(TRUTH, found.pose)).max() < 0.015


def test_what_fits_no_better_elsewhere_stays(see: See, room: Floats, cells: CellMap) -> None:
    scan = see(room, TRUTH, np.random.default_rng(3))
    good = align(scan, cells, TRUTH, PRIOR)
    found, contradicts = find_again(scan, cells, [TRUTH], PRIOR, good, enough=0.9)
    assert found is good
    assert not contradicts


def test_a_scan_of_nothing_known_stays_where_it_was_thought_to_be(cells: CellMap) -> None:
    chance = np.random.default_rng(4)
    angles = chance.uniform(-math.pi, math.pi, 60)
    nonsense = np.column_stack([chance.uniform(-8.0, 8.0, (60, 2)), np.cos(angles), np.sin(angles)])
    poor = align(nonsense, cells, TRUTH, PRIOR)
    found, _ = find_again(nonsense, cells, [TRUTH], PRIOR, poor, enough=0.9)
    assert np.isfinite(found.pose).all()
    assert found.overlap < 0.6
