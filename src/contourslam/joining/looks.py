"""Where in one map a view of another may lie: corners and walls and a search of contours propose, contours verify."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import compose_one, inverse
from contourslam.joining.chart import Chart
from contourslam.localization.evidence import weigh
from contourslam.localization.global_search import search_everywhere
from contourslam.localization.locate import FEWEST_POINTS, KEPT_PROPOSALS, LEAST_LANDMARKS, LOOSE
from contourslam.localization.posterior import log_odds, same_place
from contourslam.matching.align import align
from contourslam.matching.constellation import propose

KEPT = 5  # looks at one view that are kept
SEARCHED = 6  # poses of the contour search that are looked at closely
Method = Literal["constellation", "search"]


@dataclass(frozen=True, slots=True)
class Look:
    """Where in the first map a keyframe of the second may lie.

    Attributes
    ----------
    view : int
        Number of the view that was looked for.
    keyframe : int
        Of the second map.
    pose : ndarray, shape (3,)
        Of that keyframe in the first map: m, m, rad.
    odds : float
        Log-odds that what the view saw is there rather than elsewhere.
    method : str
        What proposed it: "constellation" (corners and walls) or "search" (contours).
    back : bool
        The view was one of the first map, looked for in the second.
    """

    view: int
    keyframe: int
    pose: Floats
    odds: float
    method: Method
    back: bool = False


def look(first: Chart, second: Chart, view: int) -> tuple[Look, ...]:
    """Look for one view of the second map in the first.

    Depends on nothing else than the first map and the view: what was found may be kept while the second map grows.

    Parameters
    ----------
    first, second : Chart
    view : int
        Below ``len(second.stretches)``.

    Returns
    -------
    tuple of Look
        The likeliest first; empty where the view looks like nothing in the first map.
    """
    seen, known = second.view(view), first.known
    if len(seen.view.points) < FEWEST_POINTS:
        return ()
    proposed: list[tuple[Floats, Method]] = []
    if 2 * len(seen.landmarks.corners) + len(seen.landmarks.normals) >= LEAST_LANDMARKS:
        found = propose(seen.landmarks, first.landmarks, keep=KEPT_PROPOSALS)
        proposed += [(proposal.pose, "constellation") for proposal in found]
    hypotheses, _ = search_everywhere(known.grid, known.standing, seen.view, keep=SEARCHED)
    proposed += [(hypothesis.pose, "search") for hypothesis in hypotheses]
    looks: list[Look] = []
    for pose, method in proposed:
        if not any(same_place(pose, other.pose) for other in looks):
            cells = known.around(pose)
            aligned = align(seen.view.points, cells, pose, LOOSE).pose
            odds = log_odds(weigh(seen.view, cells, known.free, aligned))
            looks.append(Look(view, seen.anchor, aligned, odds, method))
    kept: list[Look] = []
    for candidate in sorted(looks, key=lambda each: -each.odds):
        if not any(same_place(candidate.pose, better.pose) for better in kept):
            kept.append(candidate)
    return tuple(kept[:KEPT])


def turned_round(found: Look, first: Chart, second: Chart) -> Look:
    """Give a look at a view of the second map as one of the first that was looked for in the second.

    Parameters
    ----------
    found : Look
        From ``look(first, second, view)``.
    first, second : Chart

    Returns
    -------
    Look
        With the keyframe of the first map that is nearest, in the second one's frame.
    """
    # Second map's frame as the look has it in the first map's, where the view lies.
    laid = compose_one(found.pose, inverse(second.frames.poses[found.keyframe]))
    away = np.hypot(*(first.frames.poses[:, :2] - found.pose[:2]).T)
    nearest = int(np.argmin(away))
    pose = compose_one(inverse(laid), first.frames.poses[nearest])
    return Look(found.view, nearest, pose, found.odds, found.method, not found.back)
