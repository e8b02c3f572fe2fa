"""Why common maps are two: each pair is told of, and one that saw nothing is alike to none."""

from types import SimpleNamespace
from typing import cast

from contourslam.fleet.play_apart import KeptApart, why_apart
from contourslam.fleet.shared import Shared
from contourslam.maps.saved_map import SavedMap


def blind(number: int) -> Shared:
    return Shared(number, (("robot", number),), (0,), cast(SavedMap, SimpleNamespace(keyframes=None)), (), ())


def test_maps_of_robots_that_saw_nothing_are_told_of_like_all_others() -> None:
    assert list(why_apart([blind(1)])) == []
    told = list(why_apart([blind(1), blind(2), blind(5)]))
    assert told == [KeptApart(pair, "nothing alike", None) for pair in ((1, 2), (1, 5), (2, 5))]
