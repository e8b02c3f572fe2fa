"""Cramér-Rao bound of localisation in the known room: what no unbiased estimator can beat on average.

One scan of ranges r with independent Gaussian noise sigma tells about the pose x the Fisher information
J = Σ (∂r/∂x)ᵀ (∂r/∂x) / σ². Along a run the odometry joins the scans by the posterior bound of Tichavsky, Muravchik &
Nehorai (1998), J' = (Q + F J⁻¹ Fᵀ)⁻¹ + J_scan, here taken at the true trajectory.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.config import MotionConfig
from contourslam.evaluation.visibility import cast_beams
from contourslam.geometry.poses import between, compose
from contourslam.slam.motion import motion_noise

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ScanModel:
    """The lidar as the bound sees it.

    Attributes
    ----------
    angles : ndarray, shape (n,)
        Beam directions in the lidar's frame, rad.
    sigma_range : float or ndarray, shape (n,)
        Standard deviation of a range, m.
    mount : tuple of three floats
        x (m), y (m), yaw (rad) of the lidar in the base frame.
    max_range : float
        m.
    min_incidence_deg : float
        Beams that meet their surface at less than this are left out, degrees. The range of a grazing beam changes
        so fast with the pose that its linear model holds for displacements far below the pose's own error only, and
        counting it would claim a precision that nobody reaches.
    """

    angles: Floats
    sigma_range: float | Floats = 0.01
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0)
    max_range: float = 30.0
    min_incidence_deg: float = 5.0


@dataclass(frozen=True, slots=True)
class CramerRaoBound:
    """Least standard deviation per scan, in x (m), y (m) and heading (rad).

    Attributes
    ----------
    scan_sd : ndarray, shape (t, 3)
        From each scan alone; inf where it leaves a direction open.
    filtered_sd : ndarray, shape (t, 3)
        From all scans and the odometry up to each time.
    """

    scan_sd: Floats
    filtered_sd: Floats

    @property
    def scan_rms(self) -> Floats:
        """Root mean square of `scan_sd` over the run, shape (3,)."""
        return np.asarray(np.sqrt(np.mean(self.scan_sd**2, axis=0)))

    @property
    def filtered_rms(self) -> Floats:
        """Root mean square of `filtered_sd` over the run, shape (3,): stands beside the RMSE."""
        return np.asarray(np.sqrt(np.mean(self.filtered_sd**2, axis=0)))


def range_jacobian(segments: Floats, circles: Floats, base_pose: Floats, model: ScanModel) -> tuple[Floats, Floats]:
    """Ranges in the known room and how they change with the pose of the base.

    A surface with unit normal n met by the beam e at distance r gives ∂r/∂p = −n/(n·e) and, turning about the lidar,
    ∂r/∂ψ = −r n·e⊥/(n·e); a lidar off the base's origin adds its own displacement under rotation.

    Parameters
    ----------
    segments, circles : ndarray, shapes (s, 2, 2) and (k, 3)
        Outlines of the true room, m.
    base_pose : ndarray, shape (3,)
        True pose of the base in the world frame.
    model : ScanModel

    Returns
    -------
    ranges : ndarray, shape (n,)
        m; inf where there is no return.
    jacobian : ndarray, shape (n, 3)
        Derivative of each range by x, y (m/m) and heading (m/rad); zero where there is no return or the beam grazes.
    """
    lidar = compose(base_pose, np.array(model.mount))
    ranges, hits = cast_beams(lidar, model.angles, segments, circles, model.max_range)
    beams = np.flatnonzero(hits >= 0)
    bearing = lidar[2] + model.angles[beams]
    e = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    ends = lidar[:2] + ranges[beams, None] * e
    n = np.empty_like(e)
    flat = hits[beams] < len(segments)
    along = np.diff(segments[hits[beams[flat]]], axis=1)[:, 0]
    n[flat] = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    n[~flat] = ends[~flat] - circles[hits[beams[~flat]] - len(segments), :2]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    sine = np.einsum("ij,ij->i", n, e)
    used = np.abs(sine) >= math.sin(math.radians(model.min_incidence_deg))
    beams, e, n, sine = beams[used], e[used], n[used], sine[used]
    by_position = -n / sine[:, None]
    turned = np.stack([-e[:, 1], e[:, 0]], axis=-1)
    by_bearing = -ranges[beams] * np.einsum("ij,ij->i", n, turned) / sine
    arm = lidar[:2] - base_pose[:2]
    jacobian = np.zeros((len(ranges), 3))
    jacobian[beams, :2] = by_position
    jacobian[beams, 2] = by_bearing + by_position @ np.array([-arm[1], arm[0]])
    return ranges, jacobian


def scan_information(segments: Floats, circles: Floats, base_pose: Floats, model: ScanModel) -> Floats:
    """Fisher information of one scan about the pose of the base.

    Parameters
    ----------
    segments, circles, base_pose, model
        As :func:`range_jacobian`.

    Returns
    -------
    ndarray, shape (3, 3)
        In 1/m², 1/(m rad) and 1/rad²; singular where the scan leaves a direction open (a straight corridor).
    """
    _, jacobian = range_jacobian(segments, circles, base_pose, model)
    weighted = jacobian / np.broadcast_to(model.sigma_range, len(jacobian))[:, None]
    return np.asarray(weighted.T @ weighted)


def odometry_covariances(poses: Floats, motion: MotionConfig) -> Floats:
    """Noise of the odometry between consecutive poses, as the filter's own motion model states it.

    Parameters
    ----------
    poses : ndarray, shape (t, 3)
        True poses of the base.
    motion : MotionConfig

    Returns
    -------
    ndarray, shape (t - 1, 3, 3)
        Covariance of the step's end in x, y (m²) and heading (rad²), in the world frame.
    """
    covariances = np.empty((max(len(poses) - 1, 0), 3, 3))
    for t, increment in enumerate(between(poses[:-1], poses[1:])):
        cos, sin = math.cos(poses[t, 2]), math.sin(poses[t, 2])
        rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        covariances[t] = rotation @ motion_noise(increment, motion) @ rotation.T
    return covariances


def cramer_rao_bound(
    segments: Floats,
    circles: Floats,
    poses: Floats,
    model: ScanModel,
    motion: MotionConfig | None = None,
    initial_covariance: Floats | None = None,
) -> CramerRaoBound:
    """Bound of each scan alone, and of a filter that joins scans and odometry.

    Parameters
    ----------
    segments, circles : ndarray, shapes (s, 2, 2) and (k, 3)
        Outlines of the true room, m.
    poses : ndarray, shape (t, 3)
        True poses of the base at the scans.
    model : ScanModel
    motion : MotionConfig, optional
        Noise of the odometry; its defaults where left out.
    initial_covariance : ndarray, shape (3, 3), optional
        Of the first pose before its scan: zeros where the start is known, as in SLAM. Left out, nothing is known.

    Returns
    -------
    CramerRaoBound
    """
    motion = motion or MotionConfig()
    noise = odometry_covariances(poses, motion)
    scan_sd, filtered_sd = np.empty((len(poses), 3)), np.empty((len(poses), 3))
    covariance = initial_covariance
    for t, pose in enumerate(poses):
        information = scan_information(segments, circles, pose, model)
        alone = _inverse(information)
        scan_sd[t] = np.inf if alone is None else np.sqrt(np.diagonal(alone))
        if covariance is None:  # nothing known yet: the first scan that leaves no direction open begins
            covariance = alone
        else:
            if t > 0:
                covariance = _carried(covariance, pose - poses[t - 1], noise[t - 1])
            covariance = _corrected(covariance, information)
        filtered_sd[t] = np.inf if covariance is None else np.sqrt(np.diagonal(covariance))
    return CramerRaoBound(scan_sd, filtered_sd)


def _carried(covariance: Floats, step: Floats, noise: Floats) -> Floats:
    """Covariance after a step in the world frame: an error of the heading swings the step's end sideways."""
    F = np.array([[1.0, 0.0, -step[1]], [0.0, 1.0, step[0]], [0.0, 0.0, 1.0]])
    return np.asarray(F @ covariance @ F.T + noise)


def _corrected(covariance: Floats, information: Floats) -> Floats:
    """(P⁻¹ + J)⁻¹, written so that neither needs an inverse: the start may be known exactly."""
    corrected = np.linalg.solve(np.eye(3) + covariance @ information, covariance)
    return np.asarray(0.5 * (corrected + corrected.T), dtype=np.float64)


def _inverse(information: Floats) -> Floats | None:
    """Inverse, or None where a direction is open: scaled to a unit diagonal, so that metres and radians compare."""
    diagonal = np.diagonal(information)
    if (diagonal <= 0.0).any():
        return None
    scale = 1.0 / np.sqrt(diagonal)
    scaled = information * np.outer(scale, scale)
    if np.linalg.eigvalsh(scaled)[0] < 1e-9:
        return None
    return np.asarray(np.linalg.inv(scaled) * np.outer(scale, scale))
