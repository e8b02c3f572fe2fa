"""What a peer gets and gives: scans from an .npz without pickle, a trajectory as TUM rows, figures as a line of JSON.

Runs in the peers' environment, which has numpy and not contourslam.
"""

import json
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Scan:
    """One scan.

    Attributes
    ----------
    angles, ranges : ndarray, shape (n,)
        rad in the lidar's frame and m; NaN is no return.
    odometry : ndarray, shape (3,)
        Pose of the lidar by the wheels: m, m, rad.
    """

    angles: Floats
    ranges: Floats
    odometry: Floats

    def points(self, max_range: float) -> Floats:
        """Give the returns nearer than `max_range` as points with z = 0, shape (m, 3), m."""
        kept = self.ranges < max_range  # not true of NaN
        angles, ranges = self.angles[kept], self.ranges[kept]
        return np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles), np.zeros(len(ranges))])


@dataclass(frozen=True)
class Drive:
    """All scans of a log."""

    stamps: Floats
    odometry: Floats
    ranges: Floats
    starts: NDArray[np.int64]
    angles: Floats
    angle_starts: NDArray[np.int64]

    def __iter__(self) -> Iterator[Scan]:
        for i, pose in enumerate(self.odometry):
            ranges = self.ranges[self.starts[i] : self.starts[i + 1]]
            first = self.angle_starts[i]
            yield Scan(self.angles[first : first + len(ranges)], ranges, pose)


def matrix(pose: Floats) -> Floats:
    """Give a pose in the plane as a transform in space, shape (4, 4)."""
    x, y, heading = pose
    result = np.eye(4)
    result[:2, :2] = [[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]
    result[:2, 3] = x, y
    return result


def planar(transform: Floats) -> Floats:
    """Give x, y and heading of a transform in space."""
    return np.array([transform[0, 3], transform[1, 3], np.arctan2(transform[1, 0], transform[0, 0])])


Result = tuple[Floats, Callable[[Path], None] | None]
"""Pose of the lidar at each scan, shape (t, 3), and how the map is written to a file, where the peer can do that."""


def run(slam: Callable[[Drive], Result]) -> None:
    """Run as ``PEER SCANS.npz FOLDER``; ``trajectory.tum``, ``figures.json`` and perhaps ``map`` come into the folder.

    The time is that of `slam` alone: libraries are loaded and scans are in memory before it.
    """
    with np.load(sys.argv[1], allow_pickle=False) as file:
        drive = Drive(**file)
    folder = Path(sys.argv[2])
    start = time.process_time()
    poses, save = slam(drive)
    seconds = time.process_time() - start
    zero, half = np.zeros(len(poses)), 0.5 * poses[:, 2]
    columns = [drive.stamps, poses[:, 0], poses[:, 1], zero, zero, zero, np.sin(half), np.cos(half)]
    np.savetxt(folder / "trajectory.tum", np.column_stack(columns), fmt="%.9f")
    (folder / "figures.json").write_text(json.dumps({"mapping_seconds": seconds}) + "\n")
    if save is not None:
        save(folder / "map")
