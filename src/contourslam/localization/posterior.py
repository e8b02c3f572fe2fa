"""From what speaks for each pose to its probability, with the chance that the robot is not in this map at all."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap_angle
from contourslam.localization.evidence import Evidence

# Log-odds of a pose against "elsewhere", by the third root of the weight of the view's points: neighbouring surfaces
# err alike, and a map is never quite the room. Fitted (conditional logit) to 1,600 views of simulated rooms, a third of
# them refurnished since, and of real offices, held against their own map, and to 1,052 held against maps of others.
FOUND, NEW, THROUGH, ELSEWHERE = 5.3, 2.6, 1.0, 2.4
UNSEEN, UNSEEN_BASE = 7.4, 3.4  # the same of the likeliest pose that a search cut short left out, by its score
CONFIDENT = 0.9  # probability from which a pose may be relied on, ...
PRECISE = 0.1  # ... where its position is known this well: standard deviation in the worst direction, m
APART, APART_ANGLE = 0.3, math.radians(5.0)  # m, rad: nearer poses are one


@dataclass(frozen=True, slots=True)
class RunnerUp:
    """Another pose that the robot may have.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Base in the map: m, m, rad.
    probability : float
    """

    pose: Floats
    probability: float


@dataclass(frozen=True, slots=True)
class Located:
    """Where a robot is in a map.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Base in the map: m, m, rad; NaN where nothing in the map looks like what was seen.
    covariance : ndarray, shape (3, 3)
        In the axes of the map, if this is the place.
    probability : float
        That the robot is within 0.3 m and 5 degrees of the pose. What is missing to one is the runners-up's, or the
        robot is elsewhere: at a place like none in the map.
    runners_up : tuple of RunnerUp
        Best first.
    method : str
        What proposed the pose: "constellation" (corners and walls), "search" (contours), or "none".
    """

    pose: Floats
    covariance: Floats
    probability: float
    runners_up: tuple[RunnerUp, ...]
    method: str

    @property
    def confident(self) -> bool:
        """Whether the place may be relied on: hardly any other, and known to a decimetre."""
        if not self.probability > CONFIDENT:
            return False
        return float(np.linalg.eigvalsh(self.covariance[:2, :2])[-1]) < PRECISE**2


def log_odds(evidence: Evidence) -> float:
    """Log of how much likelier what was seen is at a pose than elsewhere."""
    balance = FOUND * evidence.found - NEW * evidence.new - THROUGH * evidence.through - ELSEWHERE * evidence.total
    return balance / math.cbrt(max(evidence.total, 1.0)) ** 2


def unseen_log_odds(score: float, total: float) -> float:
    """The same of the likeliest pose that was not looked at, by what it may score; `total` is the points' weight."""
    return (UNSEEN * score - UNSEEN_BASE) * math.cbrt(total) if score > 0.0 else -math.inf


def probabilities(odds: Sequence[float], unseen: float = -math.inf) -> Floats:
    """Probabilities of poses of these log-odds, beside "elsewhere" and one more pose of the log-odds `unseen`."""
    values = np.array([*odds, unseen, 0.0])
    likelihoods = np.exp(values - values.max())
    return np.asarray(likelihoods[:-2] / likelihoods.sum())


def same_place(pose: Floats, other: Floats) -> bool:
    """Whether two poses are so near each other that they count as one."""
    away = math.hypot(pose[0] - other[0], pose[1] - other[1])
    return away < APART and abs(wrap_angle(pose[2] - other[2])) < APART_ANGLE
