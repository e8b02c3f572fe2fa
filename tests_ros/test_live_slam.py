"""The node slam beside a robot that drives: as true as offline, no scan lost, and at once."""

import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
from contourslam_msgs.msg import LandmarkMap
from contourslam_msgs.srv import LoadMap, SaveMap
from nav_msgs.msg import OccupancyGrid
from observer import Observer, error_of, figures, wait_for

from conftest import Processes
from contourslam.maps.file import load_map
from contourslam.replay import replay
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.simulate import SimulatedRun
from contourslam_ros.settings import Settings

Observe = Callable[..., Observer]


def part_on_walls(grid: OccupancyGrid, landmarks: LandmarkMap) -> float:
    """Part of the walls' middles that lie within a decimetre of a cell that is occupied."""
    cells = np.array(grid.data, dtype=np.int8).reshape(grid.info.height, grid.info.width)
    assert set(np.unique(cells)) == {-1, 0, 100}
    corner = np.array([grid.info.origin.position.x, grid.info.origin.position.y])
    occupied = (np.argwhere(cells == 100)[:, ::-1] + 0.5) * grid.info.resolution + corner
    middles = np.array([[(a.x + b.x) / 2.0, (a.y + b.y) / 2.0] for a, b in (wall.ends for wall in landmarks.walls)])
    return float(np.mean(np.min(np.hypot(*(middles[:, None] - occupied).T), axis=0) < 0.1))


def test_live_is_as_true_as_offline_loses_no_scan_and_keeps_its_map(
    drive: SimulatedRun, processes: Processes, observe: Observe, tmp_path: Path
) -> None:
    messages = [m for m in drive.messages() if isinstance(m, LaserScan | Odometry)]
    offline = replay(messages, Settings().core, lidar_mount=drive.lidar_mount)
    online = offline.poses if offline.online_poses is None else offline.online_poses
    kept = tmp_path / "kept.map"
    node = processes.start("slam", map_file=kept)
    observer = observe()
    processes.drive([observer], {})
    assert observer.took_in(len(offline.stamps)) == len(offline.stamps) == processes.played()["scans"]
    stamps, poses = observer.trajectory()
    assert len(stamps) == len(offline.stamps)
    assert (np.diff(stamps) > 0.0).all()
    stamps -= processes.played()["shift"]
    at_offline = error_of(drive, offline.stamps, online)
    assert np.sqrt(np.mean(error_of(drive, stamps, poses) ** 2)) < 1.2 * np.sqrt(np.mean(at_offline**2)) + 1e-3
    # The covariance holds what the pose is off by, and only x, y and heading are unsure.
    covariance = observer.poses[-1][3]
    assert np.linalg.eigvalsh(covariance[np.ix_([0, 1, 5], [0, 1, 5])]).min() > 0.0
    assert np.count_nonzero(covariance[2:5]) == 0

    # A loose bound, for tests share their machine; BENCHMARK.md has the figure.
    assert float(figures(observer.latest("publication"))["median (ms)"]) < 50.0

    # What it shows is one map, and what it saves too.
    assert wait_for(lambda: observer.landmarks is not None and observer.markers is not None, 5.0)
    assert observer.landmarks is not None and observer.markers is not None
    assert len(observer.landmarks.corners) > 10
    assert len(observer.landmarks.walls) > 10
    drawn = {marker.ns: len(marker.points) for marker in observer.markers.markers}
    assert drawn["corners"] == len(observer.landmarks.corners)
    assert drawn["walls"] == 2 * len(observer.landmarks.walls)
    assert drawn["corner_ellipses"] == 32 * len(observer.landmarks.corners)
    assert observer.grid is not None
    assert part_on_walls(observer.grid, observer.landmarks) > 0.9
    answer = observer.call(SaveMap, "slam/save", path=str(tmp_path / "other.map"))
    assert answer.success, answer.message
    assert set(load_map(tmp_path / "other.map").corners.ids) == {corner.id for corner in observer.landmarks.corners}
    refused = observer.call(LoadMap, "slam/load", path=str(tmp_path / "absent.map"))
    assert not refused.success
    assert "absent.map" in refused.message

    node.send_signal(signal.SIGINT)
    assert node.wait(20.0) == 0
    assert len(load_map(kept).corners.ids) == len(load_map(tmp_path / "other.map").corners.ids)
