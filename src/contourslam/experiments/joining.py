"""How well it is found out whether maps overlap: pairs that are known to, or not to, and a judge."""

import math
from dataclasses import dataclass, replace
from time import thread_time

import numpy as np
from numpy.typing import NDArray

from contourslam.experiments.joinable_maps import Mapped
from contourslam.geometry.poses import between
from contourslam.joining.find import find_joint
from contourslam.joining.joint import Apart, Evidence
from contourslam.joining.verdict import hurdle
from contourslam.localization.known_map import KnownMap
from contourslam.maps.saved_map import Contoured, SavedMap

Floats = NDArray[np.float64]

FALSE = 0.5  # m; a tie that is wrong by more binds what does not belong together
SHARED = 1.5  # m; two drives share the way where they came so near each other
NEAR = 0.3  # m; a landmark this near to a contour point is kept with it


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came of a pair of maps.

    Attributes
    ----------
    first, second : str
        Names of the maps.
    related : bool
        They are of one building.
    shared : float
        Length of the way of the second map along the way of the first, m; 0 where they are unrelated.
    joined : bool
    reason : str
        Why they stay apart; empty where they were joined.
    hurdle : float
        The factor by which they miss what a joint needs, at most 1 where they were joined.
    errors : ndarray, shape (t,)
        Distance of each tie from the truth, m; of no meaning for unrelated maps.
    evidence : Evidence or None
    seconds : float
        CPU time, the maps being ready.
    """

    first: str
    second: str
    related: bool
    shared: float
    joined: bool
    reason: str
    hurdle: float
    errors: Floats
    evidence: Evidence | None
    seconds: float

    @property
    def false(self) -> bool:
        """Whether the maps were joined that are not related, or otherwise than they lie."""
        return self.joined and (not self.related or bool(np.median(self.errors) > FALSE))


def judge(first: Mapped, second: Mapped) -> Verdict:
    """Look for a joint of two maps and hold it against the truth."""
    charts = first.chart, second.chart
    begin = thread_time()
    found = find_joint(*charts)
    seconds = thread_time() - begin
    best = found.best if isinstance(found, Apart) else found
    related = first.building == second.building
    missing = math.inf if best is None else hurdle(best.evidence)
    errors = np.empty(0)
    if best is not None and best.ties:
        keys = np.array([(tie.first, tie.second) for tie in best.ties])
        truth = between(first.truth[keys[:, 0]], second.truth[keys[:, 1]])
        errors = np.hypot(*between(truth, np.array([tie.pose for tie in best.ties]))[:, :2].T)
    return Verdict(
        first.name, second.name, related, shared_way(first, second) if related else 0.0, not isinstance(found, Apart),
        found.reason if isinstance(found, Apart) else "", missing, errors, None if best is None else best.evidence,
        seconds,
    )  # fmt: skip


def shared_way(first: Mapped, second: Mapped) -> float:
    """Length of the way of the second map along which the first drive came by, m."""
    mine, theirs = second.truth[:, :2], first.truth[:, :2]
    near = np.array([np.hypot(*(theirs - spot).T).min() < SHARED for spot in mine])
    steps = np.hypot(*np.diff(mine, axis=0).T)
    return float(steps[near[1:] & near[:-1]].sum())


def piece(whole: Mapped, start: float, end: float) -> Mapped:
    """Cut out what was seen from a part of the way (m), as a map without what binds its keyframes."""
    frames = whole.saved.keyframes
    assert frames is not None
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(frames.poses[:, :2], axis=0).T))])
    chosen = np.flatnonzero((way >= start) & (way < end))
    part = slice(int(chosen[0]), int(chosen[-1]) + 1)
    first, last = frames.starts[part.start], frames.starts[part.stop]
    own = Contoured(
        frames.stamps[part], frames.poses[part], frames.covariances[part], frames.blurs[part],
        frames.starts[part.start : part.stop + 1] - first, frames.points[first:last], frames.drives[part],
    )  # fmt: skip
    saved = _near(SavedMap(whole.saved.corners, whole.saved.walls, own))
    return Mapped(f"{whole.name}[{start:.0f}:{end:.0f}]", whole.building, saved, whole.truth[part])


def _near(saved: SavedMap) -> SavedMap:
    """The map without corners and walls that none of its contours touches."""
    spots = KnownMap(saved).points[:, :2]

    def touched(places: Floats) -> NDArray[np.bool_]:
        return np.array([np.hypot(*(spots - place).T).min() < NEAR for place in places], np.bool_)

    corners, walls = touched(saved.corners.positions), touched(saved.walls.end_points.mean(axis=1))
    return replace(
        saved,
        corners=type(saved.corners)(*(getattr(saved.corners, name)[corners] for name in saved.corners.__slots__)),
        walls=type(saved.walls)(*(getattr(saved.walls, name)[walls] for name in saved.walls.__slots__)),
    )
