"""Points of the lidar laid into the planes of boards that the camera sees."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.rigid import rigid, rotation_from_vector

Floats = NDArray[np.float64]

_STEPS = 30
_LEAST_SIGMA = 1e-4  # m
_LINE = 8  # points, above which their line is fitted well


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


def fit_planes(
    start: Floats, boards: Sequence[Floats], board_covariances: Sequence[Floats], clouds: Sequence[Floats]
) -> PlaneFit:
    """Move the lidar so that its points lie in the boards' planes, as well as each plane is known.

    Parameters
    ----------
    start : ndarray, shape (4, 4)
        ``T_camera_lidar`` to start from, m.
    boards : sequence of ndarray, shape (4, 4)
        ``T_camera_board``, m.
    board_covariances : sequence of ndarray, shape (6, 6)
        Of a small turn (rad) of each board about its origin and of a small move (m), about and along the camera's axes.
    clouds : sequence of ndarray, each of shape (n, 2)
        Points on each board, lidar frame, m.

    Returns
    -------
    PlaneFit
    """
    counts = [len(cloud) for cloud in clouds]
    points = [np.column_stack([cloud, np.zeros(len(cloud))]) for cloud in clouds]
    lines = [_line(cloud) for cloud in clouds]
    turn, place = start[:3, :3], start[:3, 3]
    information: Floats = np.eye(6)
    sigma = _LEAST_SIGMA
    for step in range(_STEPS):
        # The turn settles first: what a point scatters about its plane is known only then.
        parts = [_linearise(turn, place, *pair) for pair in zip(points, boards, strict=True)]
        sigma = _scatter(parts, lines)
        robust = 2.0 * sigma
        information, side = np.zeros((6, 6)), np.zeros(6)
        for (residuals, slopes, by_board), covariance in zip(parts, board_covariances, strict=True):
            if residuals.size:
                weight: Floats = np.ones(residuals.size)
                if step > 2:
                    weight = robust / np.maximum(np.abs(residuals), robust)
                weighed = _weighed(slopes, by_board, covariance, weight / sigma**2)
                information += weighed.T @ slopes
                side -= weighed.T @ residuals
        # A board that no other tilt joins leaves directions open: there nothing moves.
        change = np.linalg.lstsq(information, side, rcond=1e-10)[0].astype(np.float64)
        turn = rotation_from_vector(change[3:]) @ turn
        place = np.add(place, change[:3], dtype=np.float64)
        if np.abs(change).max() < 1e-7:
            break
    parts = [_linearise(turn, place, *pair) for pair in zip(points, boards, strict=True)]
    excess = _excess(parts, board_covariances, sigma)
    known = excess * np.linalg.pinv(information, rcond=1e-12, hermitian=True).astype(np.float64)
    each = [float(np.sqrt((r**2).mean())) if r.size else np.nan for r, _, _ in parts]
    rms = float(np.sqrt(np.concatenate([r**2 for r, _, _ in parts]).mean()))
    u, _, vt = np.linalg.svd(turn)  # many small turns leave it a rotation but for rounding
    return PlaneFit(rigid(u @ vt, place), 0.5 * (known + known.T), rms, tuple(counts), tuple(each))


def _linearise(turn: Floats, place: Floats, points: Floats, board: Floats) -> tuple[Floats, Floats, Floats]:
    """Distances from a board's plane, and how they change with the lidar's move and turn, and the board's."""
    normal = board[:3, 2]
    turned = points @ turn.T
    arm = turned + place - board[:3, 3]
    ones = np.broadcast_to(normal, turned.shape)
    return arm @ normal, np.hstack([ones, np.cross(turned, normal)]), np.hstack([np.cross(normal, arm), -ones])


def _scatter(parts: Sequence[tuple[Floats, Floats, Floats]], lines: Sequence[Floats]) -> float:
    """Standard deviation of a point about the straight line that its board's points lie on, m."""
    rest = []
    for (residuals, _, _), line in zip(parts, lines, strict=True):
        if residuals.size > _LINE:
            rest.append(residuals - line @ (residuals @ line))
    scatter = 1.4826 * float(np.median(np.abs(np.concatenate(rest)))) if rest else _LEAST_SIGMA
    return max(scatter, _LEAST_SIGMA)


def _line(cloud: Floats) -> Floats:
    """Orthonormal columns, shape (n, 2): one for all points alike, one by where they are along their line."""
    if len(cloud) <= _LINE:
        return np.zeros((len(cloud), 2))
    centred = cloud - cloud.mean(axis=0)
    along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
    return np.column_stack([np.full(len(cloud), len(cloud) ** -0.5), along / np.linalg.norm(along)])


def _weighed(slopes: Floats, by_board: Floats, covariance: Floats, weight: Floats) -> Floats:
    """The inverse covariance of a board's residuals, applied to columns (Woodbury's identity)."""
    root = np.linalg.cholesky(covariance + 1e-15 * np.eye(6))
    shared = by_board @ root
    both = np.linalg.solve(np.eye(6) + shared.T @ (weight[:, None] * shared), shared.T @ (weight[:, None] * slopes))
    weighed: Floats = weight[:, None] * (slopes - shared @ both)
    return weighed


def _excess(parts: Sequence[tuple[Floats, Floats, Floats]], board_covariances: Sequence[Floats], sigma: float) -> float:
    """By how much the boards lie farther off than they should, in variance; at least 1.

    The lens' own error, a board that is not flat or did not quite stand still make the planes worse than the corners'
    noise does.
    """
    ratios = []
    for (residuals, _, by_board), covariance in zip(parts, board_covariances, strict=True):
        if residuals.size:
            mean = by_board.mean(axis=0)
            ratios.append(float(residuals.mean() ** 2 / (mean @ covariance @ mean + sigma**2 / residuals.size)))
    # Of the boards' moves and tilts, the six unknowns of the place have taken up their share.
    share = 2.0 * len(ratios) / max(2.0 * len(ratios) - 6.0, 1.0)
    return max(share * float(np.mean(ratios)), 1.0)
