"""Why common maps stay apart in the end: those that are left, held against each other once more."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

from contourslam.fleet.shared import Shared
from contourslam.joining.chart import Chart
from contourslam.joining.find import find_joint
from contourslam.joining.joint import Joint, Reason


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


def why_apart(maps: Sequence[Shared], stopped: Callable[[], bool] = lambda: False) -> tuple[KeptApart, ...]:
    """Say of each pair of common maps why they are two.

    Parameters
    ----------
    maps : sequence of Shared
        As they are at the end.
    stopped : callable
        Asked before each pair; pairs that are left then are not told of.
    """
    charts = [Chart(shared.saved) for shared in maps] if len(maps) > 1 else []
    told = []
    for (first, one), (second, other) in combinations(zip(maps, charts, strict=False), 2):
        if stopped():
            break
        found, numbers = find_joint(one, other), (first.number, second.number)
        if isinstance(found, Joint):
            told.append(KeptApart(numbers, "enough to merge", found))
        else:
            told.append(KeptApart(numbers, found.reason, found.best))
    return tuple(told)
