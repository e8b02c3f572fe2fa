"""What the server answers a robot: where the newest keyframe of each of its runs is in its common map."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.fleet.common import CommonMap
from contourslam.fleet.facts import Answer
from contourslam.fleet.inbox import Source


@dataclass(frozen=True, slots=True)
class Standing:
    """Where a run stands: what an answer says of it, but for what is received; the fields are those of Answer."""

    common: int
    members: tuple[str, ...]
    keyframe: int
    pose: Floats
    covariance: Floats

    def answer(self, source: Source, received: int, missing: tuple[int, ...]) -> Answer:
        """Make an answer of it."""
        members = self.members or source[:1]
        return Answer(*source, received, missing, self.common, members, self.keyframe, self.pose, self.covariance)


NOWHERE = Standing(-1, (), -1, np.zeros(3), np.zeros((3, 3)))


def standings(common: CommonMap, before: Mapping[Source, Standing]) -> dict[Source, Standing]:
    """Tell where each run of a common map stands now; a covariance, which is dear, is asked for once a keyframe.

    Parameters
    ----------
    common : CommonMap
    before : mapping of (str, int) to Standing
        Where runs stood when this was last asked.

    Returns
    -------
    dict of (str, int) to Standing
    """
    placed, members = {}, common.members
    for run in common.runs:
        last, source = len(run.keys) - 1, (run.robot, run.number)
        if last < 0:
            continue
        was = before.get(source, NOWHERE)
        same = was.keyframe == last and was.common == common.number
        covariance = was.covariance if same else common.covariance(run, last)
        placed[source] = Standing(common.number, members, last, common.pose(run, last), covariance)
    return placed
