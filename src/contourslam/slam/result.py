"""What a run leaves behind: trajectory, map, consistency and timings, as plain arrays."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contourslam.display import ODOMETRY, TRUTH, WAY, Sketch, card, metres
from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ScanUpdate:
    """What one scan changed.

    Attributes
    ----------
    stamp : float
        Stamp of the scan, s; the pose is the one at this time.
    pose : ndarray, shape (3,)
        x (m), y (m), heading (rad) of the base in the world frame.
    covariance : ndarray, shape (3, 3)
        Its covariance.
    corners, walls : int
        How many were detected in the scan.
    matched, missed, born, dropped : tuple of int
        Ids of landmarks seen again, not seen though they should have been, new, and removed.
    nis : float
        Normalised innovation squared of the whole correction; 0 where nothing matched.
    nis_dof : int
        Its degrees of freedom.
    quality : float or None
        How well the scan's contours fitted the local map, in [0, 1]; None without contour matching.
    """

    stamp: float
    pose: Floats
    covariance: Floats
    corners: int
    walls: int
    matched: tuple[int, ...]
    missed: tuple[int, ...]
    born: tuple[int, ...]
    dropped: tuple[int, ...]
    nis: float
    nis_dof: int
    quality: float | None = None


@dataclass(frozen=True, slots=True)
class Loop:
    """A place recognised, with the evidence for it.

    Attributes
    ----------
    earlier_stamp, later_stamp : float
        Stamps of the two scans that were found to see the same place, s.
    relative_pose : ndarray, shape (3,)
        Base at the later scan seen from the base at the earlier: m, m, rad.
    covariance : ndarray, shape (3, 3)
        Of `relative_pose`, in its own frame.
    shift : ndarray, shape (3,)
        By how much the estimate before the loop was off, in the frame of the later base: m, m, rad.
    method : str
        What proposed it: "nearby" (the pose was sure enough), "search" (contours, inside the pose's uncertainty) or
        "constellation" (corners and walls).
    pairs : int
        Contour points, or landmarks, that were paired.
    residual : float
        Root mean square of the pairs' distances, m.
    overlap : float
        Part of the later scan's contour points that found a partner, in [0, 1].
    runner_up : float
        Score of the best other alignment as a part of this one's, in [0, 1]; near 1 the place is ambiguous, and 0 says
        that none came near.
    """

    earlier_stamp: float
    later_stamp: float
    relative_pose: Floats
    covariance: Floats
    shift: Floats
    method: str
    pairs: int
    residual: float
    overlap: float
    runner_up: float


@dataclass(frozen=True, slots=True)
class OdometryReadings:
    """Every odometry reading of a run, in the order of the recording.

    Attributes
    ----------
    stamps : ndarray, shape (m,)
        s; they may repeat and run backwards in a poor log.
    poses : ndarray, shape (m, 3)
        Base in the frame of :attr:`RunResult.odometry`: m, m, rad.
    scans_before : ndarray of int, shape (m,)
        How many scans of the run came before each reading; ascending.
    """

    stamps: Floats
    poses: Floats
    scans_before: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class RunResult:
    """A recording replayed through the filter; one row per scan.

    Attributes
    ----------
    detector : str
        Name of the landmark detector.
    stamps : ndarray, shape (t,)
        Stamps of the scans in the order of the recording, s; they may run backwards in a poor log.
    poses : ndarray, shape (t, 3)
        Estimated pose of the base in the world frame: x (m), y (m), heading (rad).
    covariances : ndarray, shape (t, 3, 3)
        Their covariance.
    odometry : ndarray, shape (t, 3)
        Raw odometry at the same times, moved so that it starts where the estimate starts.
    truth : ndarray, shape (t, 3), or None
        True poses at the same times, where the recording has them.
    nis, nis_dof : ndarray, shape (t,)
        Normalised innovation squared of each correction and its degrees of freedom.
    matched_count, corner_count, wall_count : ndarray of int, shape (t,)
        Landmarks matched, corners detected and walls detected per scan.
    corner_map, wall_map
        The final map.
    seconds : dict of str to float
        CPU time spent per stage (contour, detection, refinement, association, correction, ...), s.
    skipped : dict of str to int
        Scans and readings that could not be used, by reason.
    complete : bool
        False where the run was interrupted or the recording ended in an error; what was done before is kept.
    back_end : str
        "ekf" or "graph".
    online_poses : ndarray, shape (t, 3), or None
        The pose as it was known at the time of each scan; None where `poses` is that already.
    quality : ndarray, shape (t,), or None
        How well each scan's contours fitted the local map, in [0, 1]: 0 where nothing matched; None without matching.
    loops : tuple of Loop
        Every loop that was closed.
    readings : OdometryReadings or None
        Raw odometry between the scans too, for poses at any time (:func:`contourslam.slam.dense.dense_trajectory`);
        None where there is none.
    """

    detector: str
    stamps: Floats
    poses: Floats
    covariances: Floats
    odometry: Floats
    truth: Floats | None
    nis: Floats
    nis_dof: NDArray[np.int64]
    matched_count: NDArray[np.int64]
    corner_count: NDArray[np.int64]
    wall_count: NDArray[np.int64]
    corner_map: CornerMap
    wall_map: WallMap
    seconds: dict[str, float] = field(default_factory=dict)
    skipped: dict[str, int] = field(default_factory=dict)
    complete: bool = True
    back_end: str = "ekf"
    online_poses: Floats | None = None
    quality: Floats | None = None
    loops: tuple[Loop, ...] = ()
    readings: OdometryReadings | None = None

    def _repr_html_(self) -> str:
        """Show it in a notebook: the map with the way, over the true one and raw odometry."""
        sketch = Sketch(f"map and way of {len(self.stamps)} scans")
        sketch.way(self.odometry[:, :2], ODOMETRY, 0.8)
        self.wall_map.draw(sketch)
        if self.truth is not None:
            sketch.way(self.truth[:, :2], TRUTH, 2.4)
        sketch.way(self.poses[:, :2], WAY)
        self.corner_map.draw(sketch)
        return card(
            "A recording mapped" if self.complete else "A part of a recording mapped", self._figures(), sketch.svg()
        )

    def _figures(self) -> dict[str, object]:
        figures: dict[str, object] = {"back end": self.back_end, "detector": self.detector, "scans": len(self.stamps)}
        if len(self.stamps):
            figures["time"] = f"{np.ptp(self.stamps):.1f} s"
            figures["way (blue)"] = metres(float(np.hypot(*np.diff(self.poses[:, :2], axis=0).T).sum()))
        figures["corners (red), walls"] = f"{len(self.corner_map.ids)}, {len(self.wall_map.ids)}"
        if self.loops:
            figures["loops"] = len(self.loops)
        if self.truth is not None and len(self.stamps):
            for name, poses in (
                ("error from the truth (green)", self.poses),
                ("that of odometry (yellow)", self.odometry),
            ):
                error = np.hypot(*(poses - self.truth)[:, :2].T)
                figures[f"{name}, RMS"] = metres(float(np.sqrt(np.mean(error**2))))
        if self.seconds and len(self.stamps):
            figures["CPU time per scan"] = f"{1e3 * sum(self.seconds.values()) / len(self.stamps):.2f} ms"
        return figures | {f"skipped: {reason}": count for reason, count in self.skipped.items()}
