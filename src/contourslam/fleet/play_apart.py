"""Why common maps stay apart in the end: those that are left, held against each other once more."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

from contourslam.fleet.shared import Shared
from contourslam.joining.chart import Chart
from contourslam.joining.find import find_joint
from contourslam.joining.joint import Joint, Reason
from contourslam.maps.saved_map import SavedMap


@dataclass(frozen=True, slots=True)
class KeptApart:
    """Two common maps that a fleet ended with.

    Attributes
    ----------
    commons : (int, int)
        Their numbers.
    reason : str
        That of :class:`~contourslam.joining.joint.Apart`, or "enough to merge": the whole maps are alike enough to be
        merged once, but what was seen of them on the way was not enough for a server, which asks again and again.
    best : Joint or None
        The likeliest way of laying one on the other; None where nothing was alike.
    """

    commons: tuple[int, int]
    reason: Reason | Literal["enough to merge"]
    best: Joint | None


def why_apart(maps: Sequence[Shared]) -> Iterator[KeptApart]:
    """Say of each pair of common maps why they are two, one after the other.

    Parameters
    ----------
    maps : sequence of Shared
        As they are at the end.

    Yields
    ------
    KeptApart
    """
    charts = {shared.number: _chart(shared.saved) for shared in maps}
    for first, second in combinations(charts, 2):
        one, other = charts[first], charts[second]
        if one is None or other is None:
            yield KeptApart((first, second), "nothing alike", None)
            continue
        found = find_joint(one, other)
        if isinstance(found, Joint):
            yield KeptApart((first, second), "enough to merge", found)
        else:
            yield KeptApart((first, second), found.reason, found.best)


def _chart(saved: SavedMap) -> Chart | None:
    """Give the chart of a map; None of a robot that saw nothing."""
    seen = saved.keyframes is not None and len(saved.keyframes.points)
    return Chart(saved) if seen else None
