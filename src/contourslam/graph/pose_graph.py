"""A factor graph of poses in the plane, over GTSAM: grown step by step by iSAM2, or solved at once."""

from collections.abc import Sequence

import gtsam
import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.matching.small import square_root, turned

# Variables are all Pose2: keyframes, corners (position and direction of the bisector), walls (a point and the normal).
RELINEARIZE = 3  # updates after which iSAM2 looks for what it must linearise anew
Robust = float | None  # width of a Cauchy kernel in standard deviations


def noise_model(information: Floats, robust: Robust) -> gtsam.noiseModel.Base:
    """GTSAM's noise model; directions without information are left free."""
    noise = gtsam.noiseModel.Gaussian.SqrtInformation(square_root(information), False)
    if robust is None:
        return noise
    return gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Cauchy.Create(robust), noise)


def to_array(pose: gtsam.Pose2) -> Floats:
    """x, y, heading."""
    return np.array([pose.x(), pose.y(), pose.theta()])


class PoseGraph:
    """Variables and factors; changed in place.

    Attributes
    ----------
    factors, ties : gtsam.NonlinearFactorGraph
        All factors so far but those of landmarks; the ties of keyframes to places seen before are kept apart. Ties and
        landmarks can be had anew.
    updates : int
        How often iSAM2 has taken in what was new.
    """

    def __init__(self) -> None:
        parameters = gtsam.ISAM2Params()
        parameters.setRelinearizeThreshold(0.02)
        parameters.relinearizeSkip = RELINEARIZE
        # Only what hangs on something that moved is looked at: half the time after some kilometres, and the same poses.
        parameters.enablePartialRelinearizationCheck = True
        self._isam = gtsam.ISAM2(parameters)
        self.factors, self.ties = gtsam.NonlinearFactorGraph(), gtsam.NonlinearFactorGraph()
        self._new = gtsam.NonlinearFactorGraph()
        self._values = gtsam.Values()
        self.updates = 0

    def add(self, key: int, pose: Floats) -> None:
        """Bring in a variable where it is thought to be."""
        self._values.insert(key, gtsam.Pose2(*pose))

    def fix(self, key: int, pose: Floats, sigmas: Floats) -> None:
        """Tie a variable to the world."""
        factor = gtsam.PriorFactorPose2(key, gtsam.Pose2(*pose), gtsam.noiseModel.Diagonal.Sigmas(sigmas))
        self._put(factor, self.factors)

    def relate(
        self, first: int, second: int, pose: Floats, information: Floats, robust: Robust = None, *, tie: bool = False
    ) -> None:
        """Say where `second` lies, seen from `first`; `information` is in the frame of `second`."""
        self._put(relation(first, second, pose, information, robust), self.ties if tie else self.factors)

    def recall(
        self, first: int, second: int, pose: Floats, information: Floats, robust: Robust, *, tie: bool, now: Floats
    ) -> None:
        """As :meth:`relate`, of a solution that is to stay as it is: iSAM2 is told how `second` lies `now`."""
        self._new.push_back(relation(first, second, now, information, robust))
        (self.ties if tie else self.factors).push_back(relation(first, second, pose, information, robust))

    def sight(self, key: int, variable: int, pose: Floats, information: Floats, robust: Robust = None) -> None:
        """As :meth:`relate`, of a landmark: iSAM2 gets it, and it is not kept."""
        self._new.push_back(relation(key, variable, pose, information, robust))

    def _put(self, factor: gtsam.NonlinearFactor, kept: gtsam.NonlinearFactorGraph) -> None:
        self._new.push_back(factor)
        kept.push_back(factor)

    def update(self, more: int = 0) -> None:
        """Let iSAM2 take in what is new; `more` further steps where much has moved."""
        self.updates += 1
        new, values = self._new, self._values
        self._new, self._values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        self._isam.update(new, values)
        for _ in range(more):
            self._isam.update()

    @property
    def settled(self) -> bool:
        """True where nothing waits for the next update."""
        return bool(self._new.size() == 0)

    def _catch_up(self) -> None:
        """Take in what waits, so that everything can be asked for."""
        if self._new.size() > 0:
            self.update()

    def pose(self, key: int) -> Floats:
        """Estimate of one variable."""
        self._catch_up()
        return to_array(self._isam.calculateEstimatePose2(key))

    def covariance(self, key: int) -> Floats:
        """Marginal covariance of one variable, in the world's axes, shape (3, 3)."""
        angle = self.pose(key)[2]
        return turned(np.asarray(self._isam.marginalCovariance(key)), float(angle))

    def poses(self, keys: Sequence[int]) -> Floats:
        """Estimates of several variables, shape (n, 3)."""
        self._catch_up()
        values = self._isam.calculateEstimate()
        return np.array([to_array(values.atPose2(key)) for key in keys]).reshape(-1, 3)

    def estimate(self, count: int) -> gtsam.Values:
        """Estimate of the keyframes 0 to `count` - 1."""
        self._catch_up()
        return keyframes_of(self._isam.calculateEstimate(), count)


def relation(
    first: int, second: int, pose: Floats, information: Floats, robust: Robust = None
) -> gtsam.BetweenFactorPose2:
    """Give the factor that says where `second` lies, seen from `first`; `information` is in the frame of `second`."""
    return gtsam.BetweenFactorPose2(first, second, gtsam.Pose2(*pose), noise_model(information, robust))


def solve(factors: gtsam.NonlinearFactorGraph, start: gtsam.Values) -> gtsam.Values:
    """Solve a graph at once, by Levenberg and Marquardt."""
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(30)
    parameters.setRelativeErrorTol(1e-4)  # a tenth of it takes twice the steps and moves no pose by a millimetre
    return gtsam.LevenbergMarquardtOptimizer(factors, start, parameters).optimize()


def joined(*graphs: gtsam.NonlinearFactorGraph) -> gtsam.NonlinearFactorGraph:
    """All factors of several graphs."""
    every = gtsam.NonlinearFactorGraph()
    for graph in graphs:
        every.push_back(graph)
    return every


def spreads(factors: gtsam.NonlinearFactorGraph, values: gtsam.Values, keys: Ints) -> Floats:
    """Marginal covariances of poses, in the world's axes, shape (n, 3, 3)."""
    marginals = gtsam.Marginals(factors, values)
    out = [turned(marginals.marginalCovariance(key), values.atPose2(key).theta()) for key in keys.tolist()]
    return np.array(out).reshape(-1, 3, 3)


def keyframes_of(values: gtsam.Values, count: int) -> gtsam.Values:
    """Those of the keyframes 0 to `count` - 1."""
    out = gtsam.Values()
    for key in range(count):
        out.insert(key, values.atPose2(key))
    return out


def poses_of(values: gtsam.Values, count: int) -> Floats:
    """Poses of the keyframes 0 to `count` - 1, shape (count, 3)."""
    return np.array([to_array(values.atPose2(key)) for key in range(count)]).reshape(-1, 3)
