"""From a scan to its landmarks: the left half of the pipeline in one function a stage."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from contourslam.config import Config, LidarConfig
from contourslam.contour import Contours, equalize, segment
from contourslam.contour.contours import Floats, Ints
from contourslam.detectors import Detector, make_detector, suppress
from contourslam.display import CORNER, POINT, WALL, Sketch, card, metres
from contourslam.landmarks.corner import Corners, refine_corners
from contourslam.landmarks.wall import Walls, extract_walls
from contourslam.scan import LaserScan
from contourslam.scan.deskew import deskew
from contourslam.scan.validity import valid_beams

NO_MOTION = (np.empty(0), np.empty((0, 3)))
NO_WALLS = Walls(np.empty((0, 2, 2)), np.empty((0, 2)), np.empty((0, 2, 2)), np.empty((0, 2, 2, 2)))
Lap = Callable[[str], None]
_FAR = 1e6  # m; no lidar sees as far


def _no_lap(stage: str) -> None:
    """Nobody measures."""


@dataclass(frozen=True, slots=True)
class Detection:
    """Everything seen in one scan, in the lidar's frame at its stamp.

    Attributes
    ----------
    contours : Contours
        Raw contours.
    curve : Contours
        The contours as the detector saw them: equalized, or the raw ones.
    response : ndarray, shape (m,)
        The detector's response at each point of `curve`.
    candidates : ndarray of int, shape (k,)
        Points of `curve` that survived the suppression.
    corners : Corners
    walls : Walls
    """

    contours: Contours
    curve: Contours
    response: Floats
    candidates: Ints
    corners: Corners
    walls: Walls

    def _repr_html_(self) -> str:
        """Show it in a notebook: contours, walls and corners around the lidar."""
        sketch = Sketch(f"{len(self.corners)} corners in a scan")
        self.contours.draw(sketch)
        sketch.lines(self.walls.end_points, WALL, 0.8)
        sketch.dots(np.zeros((1, 2)), POINT, 8.0)
        sketch.dots(self.corners.positions, CORNER, 7.0)
        figures: dict[str, object] = {
            "contours": len(self.contours),
            "candidates": len(self.candidates),
            "corners (red)": len(self.corners),
            "walls": len(self.walls),
        }
        if len(self.corners):
            sigmas = np.sqrt(0.5 * np.trace(self.corners.covariances, axis1=1, axis2=2))
            figures["σ of a corner, median"] = metres(float(np.median(sigmas)))
        return card("What was seen in a scan", figures, sketch.svg())


def trace(
    scan: LaserScan, config: Config, motion: tuple[Floats, Floats] = NO_MOTION, T_base_lidar: Floats | None = None
) -> Contours:
    """Contours of a scan: valid beams, motion undone, cut where the surface changes (eq. 1).

    Parameters
    ----------
    scan : LaserScan
    config : Config
    motion : (ndarray of shape (k,), ndarray of shape (k, 3))
        Times after the scan's stamp, s, and base poses of the odometry there; see :func:`contourslam.scan.deskew`.
    T_base_lidar : ndarray, shape (3,), optional
        Mounting of the lidar; that of the configuration by default.

    Returns
    -------
    Contours
    """
    lidar = config.lidar
    mount = np.array(lidar.mount) if T_base_lidar is None else T_base_lidar
    points, beams = deskew(scan, valid_beams(scan, lidar.max_range), *motion, mount)
    return segment(points, scan.angles[beams], beams, scan.ranges.size, lidar.sigma_range, config.contour)


def find_landmarks(
    contours: Contours, detector: Detector, config: Config, lap: Lap = _no_lap, *, walls: bool = True
) -> Detection:
    """Corners and walls of the contours: response, suppression, refinement.

    Parameters
    ----------
    contours : Contours
        Raw contours.
    detector : Detector
    config : Config
    lap : callable, optional
        Called with the name of each stage when it is done, for those who measure time.
    walls : bool
        Extract walls too.

    Returns
    -------
    Detection
    """
    sigma = config.lidar.sigma_range
    curve = contours
    if detector.equalized:
        spacing = max(config.contour.spacing, config.contour.spacing_sigmas * sigma)
        curve = equalize(contours, spacing, average_below=config.contour.average_sigmas * sigma)
        lap("equalization")
    response = detector.respond(curve)
    candidates = suppress(response, curve, detector.threshold, detector.reach(curve))
    lap("detection")
    corners = refine_corners(contours, curve.source[candidates], sigma, config.landmarks)
    lap("refinement")
    segments = extract_walls(contours, sigma, config.landmarks) if walls else NO_WALLS
    lap("walls")
    return Detection(contours, curve, response, candidates, corners, segments)


def detect(scan: LaserScan, detector: Detector, config: Config) -> Detection:
    """Landmarks of a single scan, taken as if the robot stood still.

    Parameters
    ----------
    scan : LaserScan
    detector : Detector
    config : Config

    Returns
    -------
    Detection
    """
    return find_landmarks(trace(scan, config), detector, config)


def find_corners(
    ranges: ArrayLike, angles: ArrayLike, detector: str = "matched_filter", *, sigma_range: float = 0.01
) -> tuple[Floats, Ints]:
    """Corners of a scan that is two arrays, as two arrays: all defaults, for a first look.

    Parameters
    ----------
    ranges : array_like, shape (n,)
        m; NaN, infinite and 0 mean that nothing came back.
    angles : array_like, shape (n,)
        Direction of each beam in the lidar's frame, rad, in their order.
    detector : str
        A key of :data:`contourslam.detectors.DETECTORS`.
    sigma_range : float
        Standard deviation of a range, m.

    Returns
    -------
    positions : ndarray, shape (k, 2)
        Corners, refined, in the lidar's frame, m.
    beams : ndarray of int, shape (k,)
        The beam that fell nearest to each.

    Raises
    ------
    ScanError
        If the arrays differ in shape, or an angle is not finite.
    ConfigError
        If there is no such detector, or `sigma_range` is not above 0.
    """
    values, directions = np.asarray(ranges, dtype=np.float64), np.asarray(angles, dtype=np.float64)
    scan = LaserScan(0.0, directions, values, np.zeros(directions.shape), 0.0, np.inf)
    config = Config(lidar=LidarConfig(sigma_range=sigma_range, max_range=_FAR))
    corners = detect(scan, make_detector(detector), config).corners
    x, y = corners.positions[:, :1], corners.positions[:, 1:]
    with np.errstate(invalid="ignore"):
        off = np.hypot(x - values * np.cos(directions), y - values * np.sin(directions))
    off[~np.isfinite(off)] = np.inf
    return corners.positions, np.argmin(off, axis=1) if len(off) else np.empty(0, dtype=np.int64)
