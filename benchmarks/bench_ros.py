"""The node slam beside a robot that is played in real time: latency, scans lost, accuracy, CPU and memory.

Runs in the environment of the ROS 2 tests: ``make bench-ros``.
"""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from table import ROOT, Table, publish

PATHS = [str(ROOT / "tests_ros"), str(ROOT / "ros2" / "contourslam_ros")]
sys.path[:0] = PATHS
os.environ |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": "39"}
os.environ["PYTHONPATH"] = os.pathsep.join(PATHS)

SECONDS = 110.0  # of driving: the node tells of its last thousand scans
TICKS = os.sysconf("SC_CLK_TCK")


def cpu_seconds(pid: int) -> float:
    """CPU time of a process until now."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def memory_mb(pid: int) -> float:
    """Largest resident memory of a process until now, MB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    (peak,) = (line.split()[1] for line in lines if line.startswith("VmHWM"))
    return int(peak) / 1000.0


def main() -> None:
    import numpy as np
    import rclpy
    from observer import Observer, error_of, wait_for
    from player import Plan

    from contourslam.recordings import write_recording
    from contourslam.replay import replay
    from contourslam.scan import LaserScan, Odometry
    from contourslam.simulation.config import SimulationConfig
    from contourslam.simulation.rooms import ROOMS
    from contourslam.simulation.simulate import simulate
    from contourslam_ros.settings import Settings

    drive = simulate(ROOMS["furnished_room"], SimulationConfig(duration=SECONDS), seed=1)
    messages = [m for m in drive.messages() if isinstance(m, LaserScan | Odometry)]
    offline = replay(messages, Settings().core, lidar_mount=drive.lidar_mount)
    online = offline.poses if offline.online_poses is None else offline.online_poses
    rclpy.init()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        x, y, yaw = drive.lidar_mount.tolist()
        write_recording(folder / "recording", messages, lidar_mount=(x, y, yaw))
        plan = Plan(recording=str(folder / "recording"), report=str(folder / "report"))
        (folder / "plan").write_text(plan.text())
        observer = Observer("", "observer")  # listens to everything, as RViz does
        node = subprocess.Popen([sys.executable, "-m", "contourslam_ros.slam"])
        try:
            if not wait_for(lambda: observer.latest("scans") is not None, 300.0):
                raise SystemExit("the node did not start")
            before = cpu_seconds(node.pid)
            subprocess.run([sys.executable, str(ROOT / "tests_ros" / "player.py"), str(folder / "plan")], check=True)
            busy, memory = (cpu_seconds(node.pid) - before) / SECONDS, memory_mb(node.pid)
            told = observer.latest("publication")
        finally:
            node.send_signal(signal.SIGINT)
            node.wait(30.0)
        stamps, poses = observer.trajectory()
        figures = {value.key: value.value for value in told.values} if told is not None else {}
        shift = plan.played()["shift"]
        observer.close()
    live = float(np.sqrt(np.mean(error_of(drive, stamps - shift, poses) ** 2)))
    at_offline = float(np.sqrt(np.mean(error_of(drive, offline.stamps, online) ** 2)))
    rows = [
        ["from scan received to pose published, median, ms", figures.get("median (ms)", ""), ""],
        ["the same, 99th percentile, ms", figures.get("99th percentile (ms)", ""), "20"],
        ["the same, longest, ms", figures.get("longest (ms)", ""), ""],
        ["scans played, and lost", f"{len(offline.stamps)}, {len(offline.stamps) - len(stamps)}", "0 lost"],
        ["RMSE of the position, live, mm", 1e3 * live, ""],
        ["the same offline, as known at the time, mm", 1e3 * at_offline, ""],
        ["CPU, % of one core", 100.0 * busy, ""],
        ["memory at most, MB", memory, ""],
    ]
    publish(Table("ros", ["node slam, graph, 500 beams at 10 Hz", "measured", "target"], rows))


if __name__ == "__main__":
    main()
