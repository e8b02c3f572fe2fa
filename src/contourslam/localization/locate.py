"""Finding a robot in a known map without a first guess: propose, align, weigh, and say how sure that is."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.localization.evidence import weigh
from contourslam.localization.global_search import search_everywhere
from contourslam.localization.known_map import KnownMap
from contourslam.localization.posterior import (
    Located,
    RunnerUp,
    log_odds,
    probabilities,
    same_place,
    unseen_log_odds,
)
from contourslam.localization.view import View, view_of
from contourslam.matching.align import align
from contourslam.matching.certainty import hold
from contourslam.matching.constellation import Constellation, propose
from contourslam.matching.small import turned

FEWEST_POINTS = 8  # of a view that is looked for
KEPT = 10  # poses of the contour search that are looked at closely
KEPT_PROPOSALS = 5  # and of the constellation's
LEAST_LANDMARKS = 4  # corners count two, walls one; a constellation of fewer proposes nothing
LOOSE = np.diag([1.0 / 0.3**2, 1.0 / 0.3**2, 1.0 / math.radians(10.0) ** 2])  # doubt about a proposed pose


@dataclass(frozen=True, slots=True)
class _Candidate:
    pose: Floats
    odds: float
    method: str


class Locator:
    """Finds views in a known map; has no memory of its own.

    Parameters
    ----------
    known : KnownMap
    """

    def __init__(self, known: KnownMap) -> None:
        self.known = known

    def locate(
        self, oriented: Floats, landmarks: Constellation | None = None, *, lidar: Floats | None = None
    ) -> Located:
        """Find one scan.

        Parameters
        ----------
        oriented : ndarray, shape (n, 4)
            Its contour points and normals in the frame of the base, see
            :func:`contourslam.matching.oriented.oriented_points` and :func:`~contourslam.matching.oriented.move`.
        landmarks : Constellation, optional
            Its corners and walls in the same frame.
        lidar : ndarray, shape (>= 2,), optional
            Where the lidar sits in that frame, m; the origin by default.

        Returns
        -------
        Located
        """
        return self.find(view_of(oriented, None if lidar is None else lidar[:2]), landmarks)

    def find(self, view: View, landmarks: Constellation | None = None) -> Located:
        """Find what was seen, in one scan or several; the parameters and the result are those of :meth:`locate`."""
        if len(view.points) < FEWEST_POINTS:
            return NOT_FOUND
        candidates: list[_Candidate] = []
        if landmarks is not None and 2 * len(landmarks.corners) + len(landmarks.normals) >= LEAST_LANDMARKS:
            proposals = propose(landmarks, self.known.landmarks, keep=KEPT_PROPOSALS)
            candidates += [self._look(view, proposal.pose, "constellation") for proposal in proposals]
        hypotheses, rest = search_everywhere(self.known.grid, self.known.standing, view, keep=KEPT)
        for hypothesis in hypotheses:
            if not any(same_place(hypothesis.pose, known.pose) for known in candidates):
                candidates.append(self._look(view, hypothesis.pose, "search"))
        if not candidates:
            return NOT_FOUND
        candidates.sort(key=lambda c: -c.odds)
        places: list[_Candidate] = []
        for candidate in candidates:
            if not any(same_place(candidate.pose, better.pose) for better in places):
                places.append(candidate)
        shares = probabilities([p.odds for p in places], unseen_log_odds(rest, float(view.weights.sum())))
        others = tuple(RunnerUp(p.pose, float(s)) for p, s in zip(places[1:], shares[1:], strict=True) if s > 1e-3)
        best = places[0]
        held = hold(view.points, self.known.around(best.pose), best.pose)
        covariance = turned(held.covariance(held.variance, 0.0), best.pose[2])
        return Located(best.pose, covariance, float(shares[0]), others, best.method)

    def _look(self, view: View, pose: Floats, method: str) -> _Candidate:
        """Align the view where a pose was proposed, and weigh what then speaks for it."""
        cells = self.known.around(pose)
        aligned = align(view.points, cells, pose, LOOSE).pose
        return _Candidate(aligned, log_odds(weigh(view, cells, self.known.free, aligned)), method)


NOT_FOUND = Located(np.full(3, np.nan), np.diag(np.full(3, np.inf)), 0.0, (), "none")
"""What comes of a view that says too little, or looks like nothing in the map."""
