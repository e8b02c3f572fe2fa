"""Error of the estimated pose, coordinate by coordinate: the quantity of Table I."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose, transform

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PoseRmse:
    """Root mean square error of a trajectory, one number per coordinate.

    Attributes
    ----------
    x, y : float
        m, along the axes of the world frame; NaN where no true pose is known.
    theta : float
        rad.
    """

    x: float
    y: float
    theta: float


def known_rows(poses: Floats, truth: Floats) -> NDArray[np.bool_]:
    """Rows in which both the estimate and the truth are finite.

    Parameters
    ----------
    poses, truth : ndarray, shape (t, 3)
        x (m), y (m), heading (rad), row by row at the same times.

    Returns
    -------
    ndarray of bool, shape (t,)

    Raises
    ------
    ValueError
        If the two trajectories differ in shape.
    """
    if poses.shape != truth.shape or poses.ndim != 2 or poses.shape[1] != 3:
        raise ValueError(f"estimated poses {poses.shape} and true poses {truth.shape} must both have shape (t, 3)")
    return np.asarray(np.isfinite(poses).all(axis=1) & np.isfinite(truth).all(axis=1))


def align_first(poses: Floats, truth: Floats) -> Floats:
    """Move a trajectory rigidly so that its first pose with a known truth is the true one.

    Parameters
    ----------
    poses, truth : ndarray, shape (t, 3)
        x (m), y (m), heading (rad), row by row at the same times.

    Returns
    -------
    ndarray, shape (t, 3)
        Unchanged where no truth is known.

    Raises
    ------
    ValueError
        If the two trajectories differ in shape.
    """
    known = known_rows(poses, truth)
    if not known.any():
        return poses
    first = int(np.argmax(known))
    return compose(truth[first], between(poses[first], poses))


def fit(points: Floats, onto: Floats) -> Floats:
    """Find the rigid motion, without scale, that lays points onto others with the least sum of squares (Umeyama 1991).

    Parameters
    ----------
    points, onto : ndarray, shape (n, 2)
        m.

    Returns
    -------
    ndarray, shape (3,)
        Pose of the points' frame in that of the others: m, m, rad; NaN where there are none.
    """
    if not len(points):
        return np.full(3, np.nan)
    middle, target = points.mean(axis=0), onto.mean(axis=0)
    a, b = points - middle, onto - target
    turn = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    return np.array([*(target - transform(np.array([0.0, 0.0, turn]), middle[None])[0]), turn])


def pose_errors(poses: Floats, truth: Floats, *, aligned: bool = False) -> Floats:
    """Estimated minus true pose, the heading's difference wrapped.

    Parameters
    ----------
    poses, truth : ndarray, shape (t, 3)
        x (m), y (m), heading (rad) in one world frame; a row that is not finite gives an error row of NaN.
    aligned : bool
        Move the estimate first so that its first pose is the true one.

    Returns
    -------
    ndarray, shape (t, 3)
        Errors in x (m), y (m) and heading (rad, in (-pi, pi]).

    Raises
    ------
    ValueError
        If the two trajectories differ in shape.
    """
    known = known_rows(poses, truth)
    errors = np.full(poses.shape, np.nan)
    errors[known] = ((align_first(poses, truth) if aligned else poses) - truth)[known]
    errors[:, 2] = wrap(errors[:, 2])
    return errors


def rmse(poses: Floats, truth: Floats, *, aligned: bool = False) -> PoseRmse:
    """Root mean square error per coordinate (Table I), over the poses whose truth is known.

    Parameters
    ----------
    poses, truth, aligned
        As :func:`pose_errors`.

    Returns
    -------
    PoseRmse

    Raises
    ------
    ValueError
        If the two trajectories differ in shape.
    """
    errors = pose_errors(poses, truth, aligned=aligned)
    errors = errors[np.isfinite(errors[:, 0])]
    if len(errors) == 0:
        return PoseRmse(np.nan, np.nan, np.nan)
    x, y, theta = np.sqrt(np.mean(errors**2, axis=0))
    return PoseRmse(float(x), float(y), float(theta))
