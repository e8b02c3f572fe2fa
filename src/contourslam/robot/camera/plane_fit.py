"""Points of the lidar laid into the planes of boards that the camera sees."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.rigid import rigid, rotation_from_vector

Floats = NDArray[np.float64]

_STEPS = 30
_LEAST_SIGMA = 1e-4  # m


@dataclass(frozen=True)
class PlaneFit:
    """Where the lidar is, seen from the camera.

    Attributes
    ----------
    T_camera_lidar : ndarray, shape (4, 4)
        m.
    covariance : ndarray, shape (6, 6)
        Of a small move (m) of the lidar and a small turn (rad) about its origin, along and about the camera's axes.
    rms : float
        Of the points' distances from their planes, m.
    counts : tuple of int
        Points on each board.
    stand_rms : tuple of float
        The same as `rms` for each board; NaN without points.
    """

    T_camera_lidar: Floats
    covariance: Floats
    rms: float
    counts: tuple[int, ...]
    stand_rms: tuple[float, ...]

    @property
    def used(self) -> tuple[bool, ...]:
        """Which boards have points."""
        return tuple(count > 0 for count in self.counts)


def fit_planes(start: Floats, boards: Sequence[Floats], clouds: Sequence[Floats]) -> PlaneFit:
    """Move the lidar so that its points lie in the boards' planes.

    Parameters
    ----------
    start : ndarray, shape (4, 4)
        ``T_camera_lidar`` to start from, m.
    boards : sequence of ndarray, shape (4, 4)
        ``T_camera_board``, m.
    clouds : sequence of ndarray, each of shape (n, 2)
        Points on each board, lidar frame, m.

    Returns
    -------
    PlaneFit
    """
    counts = np.array([len(cloud) for cloud in clouds])
    which = np.repeat(np.arange(len(clouds)), counts)
    flat = np.vstack([cloud for cloud in clouds if len(cloud)])
    points = np.column_stack([flat, np.zeros(len(flat))])
    normals = np.array([board[:3, 2] for board in boards])[which]
    depths = (normals * np.array([board[:3, 3] for board in boards])[which]).sum(axis=1)
    turn, place = start[:3, :3], start[:3, 3]
    weight = np.ones(len(points))
    for _ in range(_STEPS):
        residuals, slopes = _linearise(turn, place, points, normals, depths)
        sigma = max(1.4826 * float(np.median(np.abs(residuals))), _LEAST_SIGMA)
        robust = 2.0 * sigma
        weight = robust / np.maximum(np.abs(residuals), robust) / counts[which]  # each board counts alike
        weighed = slopes * weight[:, None]
        # A board that no other tilt joins leaves directions open: there nothing moves.
        change = np.linalg.lstsq(weighed.T @ slopes, -weighed.T @ residuals, rcond=1e-9)[0]
        turn, place = rotation_from_vector(change[3:]) @ turn, place + change[:3]
        if np.abs(change).max() < 1e-7:
            break
    residuals, slopes = _linearise(turn, place, points, normals, depths)
    covariance = _covariance(residuals, slopes, flat, which, counts)
    squares = np.bincount(which, residuals**2, len(clouds))
    with np.errstate(invalid="ignore"):
        each = np.sqrt(squares / counts)
    rms = float(np.sqrt((residuals**2).mean()))
    u, _, vt = np.linalg.svd(turn)  # many small turns leave it a rotation but for rounding
    return PlaneFit(rigid(u @ vt, place), covariance, rms, tuple(counts.tolist()), tuple(each.tolist()))


def _linearise(turn: Floats, place: Floats, points: Floats, normals: Floats, depths: Floats) -> tuple[Floats, Floats]:
    turned = points @ turn.T
    residuals: Floats = ((turned + place) * normals).sum(axis=1) - depths
    return residuals, np.hstack([normals, np.cross(turned, normals)])


def _covariance(
    residuals: Floats, slopes: Floats, flat: Floats, which: NDArray[np.int64], counts: NDArray[np.int64]
) -> Floats:
    """Covariance where, beside the points' own scatter, each plane is off by a move and a tilt that its points share.

    Their usual sizes are told by how far, and how slanted, the points of each board lie off their plane, over all
    boards together: one board alone tells too little.
    """
    used = np.flatnonzero(counts)
    information, spread = np.zeros((6, 6)), np.zeros((6, 6))
    means, slants, parts, alone = [], [], [], []
    for board in used:
        here = which == board
        r, x = residuals[here], slopes[here]
        centred = flat[here] - flat[here].mean(axis=0)
        along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
        means.append(float(r.mean()))
        slants.append(float(along @ r / max(float(along @ along), 1e-12)))
        alone.append(float(((r - means[-1] - slants[-1] * along) ** 2).sum()))
        parts.append((x, along))
        information += x.T @ x / len(r)
    # Of the boards' moves and tilts, the six unknowns of the place have taken up their share.
    share = 2.0 * len(used) / max(2.0 * len(used) - 6.0, 1.0)
    move, slant = share * float(np.mean(np.square(means))), share * float(np.mean(np.square(slants)))
    point = sum(alone) / max(len(residuals) - 2.0 * len(used), 1.0)
    for x, along in parts:
        one, two = x.mean(axis=0), along @ x / len(x)
        spread += point * x.T @ x / len(x) ** 2 + move * np.outer(one, one) + slant * np.outer(two, two)
    inverse = np.linalg.pinv(information, rcond=1e-12, hermitian=True)
    covariance = inverse @ spread @ inverse
    return 0.5 * (covariance + covariance.T)
