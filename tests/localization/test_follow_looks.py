"""When looks at the map are believed: two sure ones that agree, or all along some way; never where two places vie."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.geometry.poses import between, compose
from contourslam.landmarks import trace
from contourslam.localization.lookout import EAGER, STEADY_LOOKS, Lookout
from contourslam.localization.posterior import Located, RunnerUp
from contourslam.localization.trust import CHECK_EVERY, FOUND, LOST, Trust
from contourslam.localization.view import View
from contourslam.matching.oriented import oriented_points
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
Rooms = Callable[..., Floats]
Scans = Callable[..., LaserScan]

T_map_room = np.array([20.0, -5.0, 1.0])
NOISE = np.diag([0.01**2, 0.01**2, 0.01**2])
CONFIG = Config()
WAY = [np.array([0.2 * i, 0.0, 0.0]) for i in range(25)]


class Told:
    """Says what it is told to: the true pose in the map, moved by an offset, with a probability and a rival's."""

    def __init__(self, offsets: Callable[[int], Floats], probability: float, rival: float = 0.0) -> None:
        self._offsets, self._probability, self._rival = offsets, probability, rival
        self.looks = 0
        self.pose: Floats = np.zeros(3)
        self.views: list[View] = []

    def find(self, view: View) -> Located:
        pose = compose(compose(T_map_room, self.pose), self._offsets(self.looks))
        self.looks += 1
        self.views.append(view)
        rivals = (RunnerUp(pose + 3.0, self._rival),) if self._rival else ()
        return Located(pose, np.diag([1e-4, 1e-4, 1e-4]), self._probability, rivals, "search")


@pytest.fixture(scope="session")
def scans(room: Rooms, scan_of: Scans) -> list[Floats]:
    """Contour points along a straight way through a room with a box in it."""
    walls = room([[-3.0, -2.5], [8.0, -2.5], [8.0, 3.0], [-3.0, 3.0]], [[1.2, 1.4], [1.2, 2.0], [2.4, 2.0], [2.4, 1.4]])
    return [
        oriented_points(trace(scan_of(walls, pose.tolist(), sigma=0.005, seed=i), CONFIG)) for i, pose in enumerate(WAY)
    ]


def found_after(finder: Told, scans: Sequence[Floats], *, standing: bool = False, hint: bool = False) -> int | None:
    """Looks that were needed until a pose was believed, or hinted at; None where none was."""
    lookout, last = Lookout(finder, 30.0, np.zeros(2)), np.zeros(3)
    for k in range(len(scans)):
        i = 0 if standing else k
        finder.pose = WAY[i]
        lookout.push(scans[i], between(last, WAY[i]), NOISE, 0.0, 0.3)
        last = WAY[i]
        agreed = lookout.look()
        if agreed is not None and (agreed.word == "hint") == hint:
            np.testing.assert_allclose(agreed.pose, compose(T_map_room, WAY[i]), atol=1e-9)
            return finder.looks
    return None


def here(look: int) -> Floats:
    return np.zeros(3)


def test_two_sure_looks_that_agree_are_enough_also_at_rest(scans: list[Floats]) -> None:
    assert found_after(Told(here, 0.95), scans) == 2
    assert found_after(Told(here, 0.95), scans, standing=True) == 2


def test_sure_looks_that_contradict_each_other_are_not_believed(scans: list[Floats]) -> None:
    astray = Told(lambda look: np.array([0.7 * look, 0.0, 0.0]), 0.95)
    turning = Told(lambda look: np.array([0.0, 0.0, 0.2 * look]), 0.95)
    assert found_after(astray, scans) is None
    assert found_after(turning, scans) is None


def test_looks_that_are_not_sure_must_all_agree_along_some_way(scans: list[Floats]) -> None:
    looks = found_after(Told(here, 0.2), scans)
    assert looks is not None
    assert looks >= STEADY_LOOKS
    assert found_after(Told(here, 0.2), scans, standing=True) is None
    once_astray = Told(lambda look: np.array([float(look == 5), 0.0, 0.0]), 0.2)
    later = found_after(once_astray, scans)
    assert later is None or later > looks


def test_two_looks_that_are_less_sure_but_see_no_second_place_give_a_hint(scans: list[Floats]) -> None:
    assert found_after(Told(here, 0.4), scans, standing=True, hint=True) == 2
    assert found_after(Told(here, 0.4), scans, standing=True) is None
    assert found_after(Told(here, 0.4, 0.15), scans, standing=True, hint=True) is None
    assert found_after(Told(here, 0.2), scans, standing=True, hint=True) is None


@pytest.mark.parametrize(("probability", "rival"), [(0.5, 0.4), (0.2, 0.15), (0.05, 0.0)])
def test_a_place_with_a_rival_or_hardly_like_the_map_is_never_believed(
    probability: float, rival: float, scans: list[Floats]
) -> None:
    assert found_after(Told(here, probability, rival), scans) is None


def test_a_look_takes_in_the_way_before_and_none_of_what_was_before_the_robot_was_carried_off(
    scans: list[Floats], room: Rooms, scan_of: Scans
) -> None:
    finder = Told(here, 0.0)
    lookout, last = Lookout(finder, 30.0, np.zeros(2)), np.zeros(3)
    for k in range(10):
        lookout.push(scans[k], between(last, WAY[k]), NOISE, 0.0, 2.0)
        last = WAY[k]
        lookout.look()
    assert len(finder.views[-1].points) > 2.5 * len(scans[9])
    # All points lie where the walls are, seen from where the robot is.
    assert np.abs(finder.views[-1].points[:, 1]).max() < 3.1
    elsewhere = room([[-1.0, -1.0], [1.5, -1.0], [2.0, 0.0], [1.5, 4.0], [-1.0, 4.0]])
    seen = oriented_points(trace(scan_of(elsewhere, (0.0, 0.0, 0.5), sigma=0.005), CONFIG))
    for _ in range(2):
        lookout.push(seen, np.zeros(3), NOISE, 0.0, 2.0)
        lookout.look()
    assert len(finder.views[-1].points) < 1.1 * len(seen)


def test_looks_come_quickly_at_first_and_seldom_later(scans: list[Floats]) -> None:
    finder = Told(here, 0.0)
    lookout = Lookout(finder, 30.0, np.zeros(2))
    for k in range(200):
        lookout.push(scans[0], np.zeros(3), NOISE, 0.0, 0.1)
        lookout.look()
        if k == 19:
            early = finder.looks
    assert early >= EAGER
    assert finder.looks <= EAGER + 20


def test_trust_is_lost_by_poor_scans_and_won_back_by_good_ones() -> None:
    trust = Trust()
    for _ in range(FOUND):
        assert not trust.localized
        trust.count_good(0.9, 0.1)
    assert trust.localized
    assert trust.poor == 0
    for _ in range(LOST):
        assert trust.localized
        trust.count_poor()
    assert not trust.localized
    trust.found()
    assert trust.localized


def test_scans_that_fit_in_part_ask_for_a_second_opinion_now_and_then_and_stay_unusual() -> None:
    trust = Trust()
    for _ in range(round(10 * CHECK_EVERY) + FOUND):
        trust.count_good(0.95, 0.1)
        assert not trust.wants_check()
    enough, asked = trust.enough, []
    for i in range(round(22 * CHECK_EVERY)):
        trust.count_good(0.5, 0.1)
        if trust.wants_check():
            asked.append(i)
    assert asked[0] == 0
    assert len(asked) == 3
    assert trust.enough == enough
    assert trust.quality(0.5) < 0.6
