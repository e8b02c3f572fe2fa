"""From a recording (rosbag 1, rosbag 2, MCAP, CARMEN log) to a map: trajectory, GeoJSON, and Nav2's map server's files.

usage: 04_map_a_recording.py [RECORDING [FOLDER]]; without a recording, one is simulated first.
"""

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from contourslam.config import Config, SlamConfig
from contourslam.evaluation.metrics import run_metrics
from contourslam.recordings import open_recording, write_recording
from contourslam.replay import replay
from contourslam.report.occupancy import FREE, OCCUPIED
from contourslam.report.result_folder import write_result_folder
from contourslam.report.run_grid import run_grid


def simulated(path: Path) -> Path:
    """Record half a minute in a furnished room."""
    from contourslam.simulation.config import SimulationConfig
    from contourslam.simulation.rooms import ROOMS
    from contourslam.simulation.simulate import simulate

    run = simulate(ROOMS["furnished_room"], SimulationConfig(duration=30.0), seed=2)
    write_recording(path, run.messages(), lidar_mount=tuple(run.lidar_mount.tolist()))
    return path


def main(arguments: list[str]) -> None:
    place = Path(tempfile.mkdtemp())
    recording = open_recording(arguments[0] if arguments else simulated(place / "recording"))
    folder = Path(arguments[1]) if len(arguments) > 1 else place / "map"
    config = Config(slam=SlamConfig(walls=True))

    result = replay(recording.messages(), config, lidar_mount=recording.lidar_mount)
    grid = run_grid(recording.messages(), result, lidar_mount=np.array(recording.lidar_mount or (0.0, 0.0, 0.0)))
    write_result_folder(folder, result, config, run_metrics(result), grid=grid)

    print(f"{len(result.stamps)} scans, {len(result.corner_map.ids)} corners, {len(result.wall_map.ids)} walls")
    print(f"{folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")

    cells, (x, y) = grid.cells()
    rows, columns = cells.shape
    right, top = x + columns * grid.resolution, y + rows * grid.resolution
    _, axes = plt.subplots(figsize=(8.0, 6.0), layout="constrained")
    axes.imshow(
        np.select([cells == OCCUPIED, cells == FREE], [0.0, 1.0], 0.8),
        origin="lower",
        extent=(x, right, y, top),
        cmap="gray",
    )
    axes.plot(*result.poses[:, :2].T, color="tab:orange", label="the robot's way")
    axes.plot(*result.corner_map.positions.T, "s", color="tab:red", fillstyle="none", label="corners")
    axes.set(xlabel="x, m", ylabel="y, m")
    axes.legend(loc="upper right")
    plt.show()


if __name__ == "__main__":
    main(sys.argv[1:])
