"""yag-slam: Karto's scan matcher and graph behind a Python interface, with wheel odometry, set as its ROS node sets it.

A scan is added after 0.5 m or 0.5 rad. Between these the pose is carried along the odometry, as the node's transform
from map to odometry does; all poses are those after the last loop was closed.
"""

from typing import Any

import numpy as np
from handover import Drive, Floats, Result, matrix, planar, run
from yag_slam.graph_slam import GraphSlam
from yag_slam.models import LocalizedRangeScan
from yag_slam.scan_matching import Scan2DMatcherCpp

MIN_DISTANCE, MIN_ROTATION = 0.5, 0.5  # m, rad
RANGE_THRESHOLD, MAX_RANGE = 30.0, 50.0  # m: beams beyond the first do not count
SEQUENTIAL = {"range_threshold": RANGE_THRESHOLD, "search_size": 0.5, "resolution": 0.01, "smear_deviation": 0.03}
LOOP = SEQUENTIAL | {"search_size": 8.0, "resolution": 0.05}


def slam(drive: Drive) -> Result:
    mapper = GraphSlam(Scan2DMatcherCpp(SEQUENTIAL), Scan2DMatcherCpp(LOOP, loop=True))
    added: list[int] = []
    for i, scan in enumerate(drive):
        pose = scan.odometry
        if added:
            x, y, turn = pose - drive.odometry[added[-1]]
            if np.hypot(x, y) < MIN_DISTANCE and abs(np.arctan2(np.sin(turn), np.cos(turn))) < MIN_ROTATION:
                continue
        step = float(np.median(np.diff(scan.angles)))
        if np.ptp(np.diff(scan.angles)) > 0.01 * abs(step):
            raise SystemExit("yag-slam takes evenly spaced beams only")
        ranges = np.where(np.isnan(scan.ranges), 2.0 * MAX_RANGE, scan.ranges)
        beams = float(scan.angles[0]), float(scan.angles[-1]), step
        mapper.process_scan(LocalizedRangeScan(ranges, *beams, 0.0, MAX_RANGE, RANGE_THRESHOLD, *pose))
        added.append(i)
    found = [vertex.obj.corrected_pose for vertex in mapper.graph.vertices]
    return _everywhere(drive.odometry, added, found), mapper.to_file


def _everywhere(odometry: Floats, added: list[int], found: list[Any]) -> Floats:
    """Carry the poses of the scans that were added on to all others."""
    poses, last = [], -1
    for i, wheels in enumerate(odometry):
        if last + 1 < len(added) and i == added[last + 1]:
            last += 1
            at = matrix(np.array([found[last].x, found[last].y, found[last].euler[-1]]))
            correction = at @ np.linalg.inv(matrix(wheels))
        poses.append(planar(correction @ matrix(wheels)))
    return np.array(poses)


if __name__ == "__main__":
    run(slam)
