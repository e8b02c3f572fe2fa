"""Do the relative poses that contour matching gives know how wrong they are? Their normalised errors against truth."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.evaluation.consistency import nees
from contourslam.geometry.poses import between, between_one, compose_one, interpolate
from contourslam.landmarks import trace
from contourslam.matching.certainty import exposure
from contourslam.matching.odometry import ContourOdometry
from contourslam.matching.oriented import move, oriented_points
from contourslam.matching.small import invert, moved
from contourslam.replay import replay
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.slam.wheels import Wheels

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose


@dataclass(frozen=True, slots=True)
class RelativeErrors:
    """Relative poses against the truth.

    Attributes
    ----------
    errors : ndarray, shape (n, 3)
        Estimated pose seen from the true one: forward, left (m), heading (rad).
    covariances : ndarray, shape (n, 3, 3)
        What was stated.
    """

    errors: Floats
    covariances: Floats

    @property
    def nees(self) -> Floats:
        """Normalised errors squared, shape (n,); ideally 3 in the mean."""
        return nees(self.errors, self.covariances)

    @property
    def by_axis(self) -> Floats:
        """Mean of squared error over variance, forward, left and heading; ideally 1 each."""
        variances = np.diagonal(self.covariances, axis1=1, axis2=2)
        return np.asarray((self.errors**2 / variances).mean(axis=0))


def keyframe_errors(
    messages: Iterable[Message], config: Config, lidar_mount: Floats, *, wheels_too: bool = False
) -> RelativeErrors:
    """Each keyframe as seen from the anchor of the local map that it was aligned to.

    Parameters
    ----------
    messages : iterable
        Of a simulated drive.
    config : Config
    lidar_mount : ndarray, shape (3,)
        ``T_base_lidar``.
    wheels_too : bool
        Combine what the contours say with what the wheels say of the motion between the two, as the graph does.

    Returns
    -------
    RelativeErrors
    """
    wheels, odometry = Wheels(config.slam), ContourOdometry(config.lidar.max_range)
    truth: list[TruePose] = []
    stamps: list[float] = []
    poses: list[Floats] = []
    pairs: list[tuple[int, int]] = []
    found: list[Floats] = []
    stated: list[Floats] = []
    doubts: dict[int, tuple[Floats, Floats]] = {}  # of each keyframe: pose and covariance by the wheels since then
    stamp = -math.inf
    for message in messages:
        if isinstance(message, TruePose):
            truth.append(message)
        elif isinstance(message, Odometry):
            wheels.push(message)
        else:
            motion = wheels.during(message)
            oriented = move(oriented_points(trace(message, config, motion, lidar_mount)), lidar_mount)
            increment, noise = wheels.step_or_guess(message.stamp, motion)
            before = odometry.pose
            step = odometry.push(oriented, increment, noise, exposure(message.offsets, message.stamp - stamp))
            wheels.went(between_one(before, step.pose))
            stamp = message.stamp
            doubts = {k: moved(*doubt, increment, noise) for k, doubt in doubts.items() if k >= step.anchor}
            if step.keyframe is None:
                continue
            stamps.append(message.stamp)
            poses.append(step.pose)
            doubts[step.keyframe] = np.zeros(3), 1e-9 * np.eye(3)
            if step.match is not None:
                covariance, seen = step.match, between_one(poses[step.anchor], step.pose)
                if wheels_too:
                    way, doubt = doubts[step.anchor]
                    by_wheels = invert(_own_frame(doubt, way[2]))
                    covariance = invert(invert(covariance) + by_wheels)
                    seen = compose_one(seen, covariance @ by_wheels @ between_one(seen, way))
                pairs.append((step.anchor, step.keyframe))
                found.append(seen)
                stated.append(covariance)
    true, (first, second) = _true_poses(truth, np.array(stamps)), np.array(pairs).reshape(-1, 2).T
    errors = between(between(true[first], true[second]), np.array(found).reshape(-1, 3))
    return RelativeErrors(errors, np.array(stated).reshape(-1, 3, 3))


def tie_errors(messages: Iterable[Message], config: Config, lidar_mount: Floats) -> RelativeErrors:
    """Each keyframe as seen from the anchor of a place of another pass that the graph tied it to."""
    truth: list[TruePose] = []

    def kept() -> Iterator[Message]:
        for message in messages:
            if isinstance(message, TruePose):
                truth.append(message)
            yield message

    config = replace(config, back_end="graph", graph=replace(config.graph, refine=False))
    loops = replay(kept(), config, lidar_mount=lidar_mount).loops
    ends = [
        _true_poses(truth, np.array(stamps))
        for stamps in ([loop.earlier_stamp for loop in loops], [loop.later_stamp for loop in loops])
    ]
    found = np.array([loop.relative_pose for loop in loops]).reshape(-1, 3)
    covariances = np.array([loop.covariance for loop in loops]).reshape(-1, 3, 3)
    return RelativeErrors(between(between(*ends), found), covariances)


def _own_frame(covariance: Floats, heading: float) -> Floats:
    """Covariance in axes, in the frame of a pose with this heading in them."""
    cos, sin = math.cos(heading), math.sin(heading)
    turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ covariance @ turn.T)


def _true_poses(truth: list[TruePose], stamps: Floats) -> Floats:
    return interpolate(np.array([t.stamp for t in truth]), np.array([t.pose for t in truth]), stamps)


def narrowed(messages: Iterable[Message]) -> Iterator[Message]:
    """Leave of each scan the half that looks ahead."""
    for message in messages:
        if isinstance(message, LaserScan):
            ahead = np.abs(message.angles) <= 0.5 * np.pi
            message = LaserScan(
                message.stamp, message.angles[ahead], message.ranges[ahead], message.offsets[ahead],
                message.range_min, message.range_max,
            )  # fmt: skip
        yield message


def bare_corridor(length: float, seed: int, *, sigma: float = 0.01, slip: float = 0.03) -> Iterator[Message]:
    """Drive along two endless walls 2 m apart: contours say nothing of the way, only the wheels do.

    Parameters
    ----------
    length : float
        m.
    seed : int
    sigma : float
        Standard deviation of a range, m.
    slip : float
        Standard deviation of the wheels' way after one metre, m.
    """
    chance = np.random.default_rng(seed)
    angles = np.radians(np.arange(-180.0, 180.0))
    x, rolled = 0.0, 0.0
    for k in range(int(length / 0.1)):
        stamp = 0.2 * k
        yield Odometry(stamp, np.array([rolled, 0.0, 0.0]))
        yield TruePose(stamp, np.array([x, 0.0, 0.0]))
        with np.errstate(divide="ignore"):
            ranges = 1.0 / np.abs(np.sin(angles)) + sigma * chance.standard_normal(360)
        ranges[ranges > 30.0] = np.inf
        yield LaserScan(stamp, angles, ranges, np.zeros(360), 0.1, 30.0)
        x += 0.1
        rolled += 0.1 + slip * math.sqrt(0.1) * float(chance.standard_normal())
