"""Two maps that know nothing of each other: whether they overlap, and how."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between, between_one, compose, compose_one, inverse
from contourslam.joining.carrying import frame_among
from contourslam.joining.chart import Chart
from contourslam.joining.joint import Apart, Evidence, Joint, Tie
from contourslam.joining.laying import Laid, lay, thinned
from contourslam.joining.looks import Look, look, turned_round
from contourslam.joining.overlay import Overlay, Tally, surfaces_of
from contourslam.joining.refound import refound
from contourslam.joining.rivals import best_rival, elsewhere
from contourslam.joining.ties import ties_of, turned_tie
from contourslam.joining.verdict import reason

Observer = Callable[[int, int], None]

LIKELY = -10.0  # log-odds of a look from which it is worth a try
TRIED = 8  # ways of laying that are tried
AGREE, AGREE_ANGLE, DRIFT = 0.3, math.radians(3.0), 0.02  # two looks that agree: m, rad, and m more per m between


@dataclass(frozen=True, slots=True)
class _Hypothesis:
    """A way of laying the second map on the first."""

    laid: Laid
    overlay: Overlay
    tally: Tally
    looks: tuple[Look, ...]


def find_joint(first: Chart, second: Chart, *, observer: Observer | None = None) -> Joint | Apart:
    """Find out whether two maps overlap, and how one lies to the other.

    Parameters
    ----------
    first, second : Chart
    observer : callable, optional
        Called after each view that was looked for, with how many are done and how many there are.

    Returns
    -------
    Joint or Apart
        That of the maps in the other order is its inverse.
    """
    if _size(second) > _size(first):
        return inverted(find_joint(second, first, observer=observer))
    looks: list[Look] = []
    count = len(first.stretches) + len(second.stretches)
    for done in range(count):
        if done < len(second.stretches):
            looks += look(first, second, done)
        else:
            back = look(second, first, done - len(second.stretches))
            looks += [turned_round(each, second, first) for each in back]
        if observer is not None:
            observer(done + 1, count)
    return _decided(first, second, looks)


def decide(first: Chart, second: Chart, looks: Iterable[Look]) -> Joint | Apart:
    """Decide from what was found of views.

    Parameters
    ----------
    first, second : Chart
    looks : iterable of Look
        Of views of the second map in the first, and of views of the first in the second, the latter given through
        :func:`contourslam.joining.looks.turned_round`; in any order.

    Returns
    -------
    Joint or Apart
    """
    if _size(second) > _size(first):  # the smaller is laid on the larger, whatever the order
        return inverted(_decided(second, first, [turned_round(each, first, second) for each in looks]))
    return _decided(first, second, list(looks))


def _size(chart: Chart) -> tuple[int, int, float]:
    return len(chart.frames), len(chart.frames.points), float(chart.way[-1])


def _decided(first: Chart, second: Chart, looks: list[Look]) -> Joint | Apart:
    keyframes = thinned(second)
    found: list[_Hypothesis] = []
    for group in _groups(second, looks)[:TRIED]:
        if any(_in(hypothesis, group[0], second) for hypothesis in found):
            continue
        laid = lay(first, second, [(each.keyframe, each.pose) for each in group], keyframes)
        if laid.fits.any():
            overlay = Overlay(first.surfaces, surfaces_of(second.frames, laid.keyframes, laid.poses))
            found.append(_Hypothesis(laid, overlay, overlay.tally(np.zeros(3)), tuple(group)))
    if not found:
        return Apart("nothing alike")
    found.sort(key=lambda hypothesis: -hypothesis.tally.worth)
    best = found[0]
    others = [other.tally.worth for other in found[1:] if _differs(best.laid, other.laid, second)]
    rival = max([best_rival(best.overlay), *others, 0.0]) / max(best.tally.worth, 1e-9)
    joint = _joint(first, second, best, min(rival, 1.0))
    missing = reason(joint.evidence)
    return joint if missing is None else Apart(missing, joint)


def _groups(second: Chart, looks: list[Look]) -> list[list[Look]]:
    """Looks that agree, those first of which most speaks for; each look is in one group."""
    likely = sorted((each for each in looks if each.odds > LIKELY), key=lambda each: (-each.odds, each.view, each.back))
    if not likely:
        return []
    own = second.frames.poses[[each.keyframe for each in likely]]
    there = np.array([each.pose for each in likely])
    free, groups = np.ones(len(likely), np.bool_), list[list[Look]]()
    while free.any():
        waiting, group = [int(np.argmax(free))], list[int]()
        free[waiting[0]] = False
        while waiting:
            group.append(waiting.pop(0))
            new = np.flatnonzero(free)
            new = new[_agree(own[group[-1]], there[group[-1]], own[new], there[new])]
            free[new] = False
            waiting += new.tolist()
        groups.append([likely[k] for k in group])
    return sorted(groups, key=lambda group: -_support(group))


def _agree(own: Floats, there: Floats, others: Floats, others_there: Floats) -> NDArray[np.bool_]:
    """Whether a look, a keyframe and where it may lie, agrees with others: by what the map may be bent between them."""
    way = between(own, others)
    off = between(compose(there, way), others_there)
    near = np.hypot(off[:, 0], off[:, 1]) < AGREE + DRIFT * np.hypot(way[:, 0], way[:, 1])
    return np.asarray(near & (np.abs(off[:, 2]) < AGREE_ANGLE))


def _support(group: list[Look]) -> float:
    """Sum of what speaks for the looks of a group, of each view once."""
    views: dict[tuple[int, bool], float] = {}
    for each in group:
        views[each.view, each.back] = max(views.get((each.view, each.back), -math.inf), each.odds - LIKELY)
    return sum(views.values())


def _in(hypothesis: _Hypothesis, new: Look, second: Chart) -> bool:
    """Whether a look is one that a hypothesis already has."""
    laid = hypothesis.laid
    at = np.flatnonzero(laid.keyframes == new.keyframe)
    at = at if len(at) else np.array([np.argmin(np.abs(laid.keyframes - new.keyframe))])
    key = int(laid.keyframes[at[0]])
    own = between_one(second.frames.poses[key], second.frames.poses[new.keyframe])
    if not laid.fits[at[0]] or math.hypot(own[0], own[1]) > 2.0:
        return False
    return not bool(elsewhere(between_one(compose_one(laid.poses[at[0]], own), new.pose)))


def _differs(laid: Laid, other: Laid, second: Chart) -> bool:
    """Whether two ways of laying a map contradict each other, more than it may be bent in between."""
    own = second.frames.poses
    mine, theirs = laid.keyframes[laid.fits], other.keyframes[other.fits]
    apart = np.hypot(*(own[mine][:, None, :2] - own[theirs][None, :, :2]).transpose(2, 0, 1))
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    expected = compose_one(laid.poses[laid.fits][i], between_one(own[mine[i]], own[theirs[j]]))
    off = between_one(expected, other.poses[other.fits][j])
    shrunk = max(1.0 - DRIFT * float(apart[i, j]) / max(math.hypot(off[0], off[1]), 1e-9), 0.0)
    return bool(elsewhere(np.array([shrunk * off[0], shrunk * off[1], off[2]])))


def _joint(first: Chart, second: Chart, best: _Hypothesis, rival: float) -> Joint:
    laid, tally = best.laid, best.tally
    corners, walls = refound(first, second, laid)
    way = _way(second, laid)
    evidence = Evidence(corners, walls, 0.5 * (tally.agreeing + tally.found), tally.contradicted, way, rival)
    method = max(best.looks, key=lambda each: each.odds).method
    pose, _ = frame_among(second.frames.poses[laid.keyframes[laid.fits]], laid.poses[laid.fits])
    return Joint(pose, ties_of(first, second, laid), evidence, method)


def _way(second: Chart, laid: Laid) -> float:
    """Length of the way between keyframes that follow each other and both fit, m."""
    steps = np.diff(second.way[laid.keyframes])
    both = laid.fits[1:] & laid.fits[:-1] & (np.diff(second.frames.drives[laid.keyframes]) == 0)
    return float(steps[both & (steps < 2.0)].sum())


def inverted(found: Joint | Apart) -> Joint | Apart:
    """Give what was found out about two maps with the first for the second."""
    if isinstance(found, Apart):
        return Apart(found.reason, None if found.best is None else _inverted(found.best))
    return _inverted(found)


def _inverted(joint: Joint) -> Joint:
    ties: tuple[Tie, ...] = tuple(turned_tie(tie) for tie in joint.ties)
    return replace(joint, pose=inverse(joint.pose), ties=ties)
