"""The relation metric: known relative poses between pairs of times, against the ones the trajectory gives.

Kuemmerle et al. (2009), "On measuring the accuracy of SLAM algorithms", Autonomous Robots 27. It needs no common frame.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.poses import between, compose
from contourslam.slam.dense import dense_trajectory
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

# A pose this close to the stamp asked for is taken as it is, s.
_NEAR = 0.1


@dataclass(frozen=True, slots=True)
class Distribution:
    """Mean, standard deviation, median and largest of a set of errors; NaN where the set is empty."""

    mean: float
    sd: float
    median: float
    max: float


@dataclass(frozen=True, slots=True)
class RelationErrors:
    """Error of each relation.

    Attributes
    ----------
    translation : ndarray, shape (n,)
        Length of the difference of the relative positions, m.
    rotation : ndarray, shape (n,)
        Absolute difference of the relative headings, rad.
    outside : int
        Relations with a stamp before the first or after the last pose (by more than 0.1 s): the trajectory ends
        early, and their error says so.
    """

    translation: Floats
    rotation: Floats
    outside: int

    @property
    def translation_summary(self) -> Distribution:
        """Of the translational errors, m."""
        return _distribution(self.translation)

    @property
    def rotation_summary(self) -> Distribution:
        """Of the rotational errors, rad."""
        return _distribution(self.rotation)


@dataclass(frozen=True, slots=True)
class JudgedRelations:
    """One set of known relative poses against all that a run has to show.

    Attributes
    ----------
    stamps : ndarray, shape (n, 2)
        The two times of each relation, s.
    estimate : RelationErrors
        Of the run's trajectory, refined where it was.
    online : RelationErrors or None
        Of the poses as they were known at the time of each scan; None where the trajectory is that already.
    odometry : RelationErrors
        Of raw odometry.
    """

    stamps: Floats
    estimate: RelationErrors
    online: RelationErrors | None
    odometry: RelationErrors


def judge(result: RunResult, relation_stamps: Floats, relation_poses: Floats) -> JudgedRelations:
    """Hold a run's trajectory, its online poses and raw odometry against known relative poses.

    The trajectories are those of :func:`contourslam.slam.dense.dense_trajectory`: with a pose at each odometry reading.

    Parameters
    ----------
    result : RunResult
        Of two scans or more.
    relation_stamps, relation_poses
        As :func:`relation_errors`.

    Returns
    -------
    JudgedRelations

    Raises
    ------
    ValueError
        As :func:`relation_errors`.
    """
    readings, asked = result.readings, (relation_stamps, relation_poses)
    wheels = result.stamps, result.odometry
    if readings is not None and len(readings.stamps) > 1:
        wheels = readings.stamps, readings.poses
    online = None
    if result.online_poses is not None:
        online = relation_errors(*dense_trajectory(result, online=True), *asked, *wheels)
    return JudgedRelations(
        relation_stamps,
        relation_errors(*dense_trajectory(result), *asked, *wheels),
        online,
        relation_errors(*wheels, *asked),
    )


def relation_errors(
    stamps: Floats,
    poses: Floats,
    relation_stamps: Floats,
    relation_poses: Floats,
    odometry_stamps: Floats | None = None,
    odometry_poses: Floats | None = None,
) -> RelationErrors:
    """Hold a trajectory against known relative poses.

    Parameters
    ----------
    stamps : ndarray, shape (t,)
        Stamps of the poses, s, in the clock of the relations. They may run backwards: they are sorted, and of
        equal stamps the first is used.
    poses : ndarray, shape (t, 3)
        x (m), y (m), heading (rad) in any one frame.
    relation_stamps : ndarray, shape (n, 2)
        The two times of each relation, s.
    relation_poses : ndarray, shape (n, 3)
        Pose at the second time seen from the pose at the first.
    odometry_stamps : ndarray, shape (m,), optional
    odometry_poses : ndarray, shape (m, 3), optional
        Raw odometry in its own frame. A stamp farther than 0.1 s from any pose is reached from the nearest one
        along it; without it, by interpolation between the poses.

    Returns
    -------
    RelationErrors

    Raises
    ------
    ValueError
        If shapes disagree, the trajectory has fewer than two poses, or only one half of the odometry is given.
    """
    if relation_stamps.shape != (len(relation_poses), 2) or relation_poses.shape != (len(relation_stamps), 3):
        raise ValueError(
            f"relation stamps {relation_stamps.shape} and poses {relation_poses.shape} must be (n, 2) and (n, 3)"
        )
    first, second = (
        poses_at(relation_stamps[:, end], stamps, poses, odometry_stamps, odometry_poses) for end in (0, 1)
    )
    difference = between(relation_poses, between(first, second))
    beyond = (relation_stamps < stamps.min() - _NEAR) | (relation_stamps > stamps.max() + _NEAR)
    return RelationErrors(
        np.hypot(difference[:, 0], difference[:, 1]), np.abs(difference[:, 2]), int(beyond.any(axis=1).sum())
    )


def poses_at(
    wanted: Floats,
    stamps: Floats,
    poses: Floats,
    odometry_stamps: Floats | None = None,
    odometry_poses: Floats | None = None,
) -> Floats:
    """Poses of a trajectory at other times than its own, as the relation metric takes them.

    Parameters
    ----------
    wanted : ndarray, shape (n,)
        s.
    stamps, poses, odometry_stamps, odometry_poses
        As :func:`relation_errors`.

    Returns
    -------
    ndarray, shape (n, 3)

    Raises
    ------
    ValueError
        As :func:`relation_errors`, where it is about trajectory and odometry.
    """
    stamps, poses = trajectory = _sorted("the trajectory", stamps, poses)
    if (odometry_stamps is None) != (odometry_poses is None):
        raise ValueError("give both stamps and poses of the odometry, or neither")
    after = np.clip(np.searchsorted(stamps, wanted), 1, len(stamps) - 1)
    nearest = np.where(wanted - stamps[after - 1] <= stamps[after] - wanted, after - 1, after)
    near = np.abs(stamps[nearest] - wanted) <= _NEAR
    if odometry_stamps is None or odometry_poses is None:
        carried = _interpolate(trajectory, wanted)
    else:
        odometry = _sorted("the odometry", odometry_stamps, odometry_poses)
        moved = between(_interpolate(odometry, stamps[nearest]), _interpolate(odometry, wanted))
        carried = compose(poses[nearest], moved)
    return np.where(near[:, None], poses[nearest], carried)


def _sorted(name: str, stamps: Floats, poses: Floats) -> tuple[Floats, Floats]:
    if poses.shape != (len(stamps), 3) or len(stamps) < 2:
        raise ValueError(f"{name} needs two poses or more, got stamps {stamps.shape} and poses {poses.shape}")
    order = np.argsort(stamps, kind="stable")
    return stamps[order], poses[order]


def _interpolate(track: tuple[Floats, Floats], wanted: Floats) -> Floats:
    """As ``geometry.poses.interpolate``, but of equal stamps it takes the first: a repeated stamp is one time."""
    stamps, poses = track
    index = np.clip(np.searchsorted(stamps, wanted, side="left") - 1, 0, len(stamps) - 2)
    span = np.maximum(stamps[index + 1] - stamps[index], 1e-9)
    weight = np.clip((wanted - stamps[index]) / span, 0.0, 1.0)
    return compose(poses[index], between(poses[index], poses[index + 1]) * weight[:, None])


def _distribution(values: Floats) -> Distribution:
    if len(values) == 0:
        return Distribution(np.nan, np.nan, np.nan, np.nan)
    return Distribution(float(values.mean()), float(values.std()), float(np.median(values)), float(values.max()))
