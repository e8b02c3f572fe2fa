"""A peer that pip installs: its environment, made on demand, the scans handed to it, and its run.

The peers share ``.venv-peers`` and nothing with the project; versions are pinned in peers/NAME.txt, and
peers/run_NAME.py drives the peer. What they are handed and hand back is in peers/handover.py.
"""

import json
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np

from contourslam.geometry.poses import compose, interpolate, inverse
from contourslam.recordings import read_trajectory, write_trajectory
from contourslam.scan import LaserScan, Odometry
from contourslam.scan.validity import valid_beams
from logs import Log
from measure import SystemFailedError, last_line, measured
from table import ROOT

PEERS = ROOT / "benchmarks" / "peers"
ENVIRONMENT = ROOT / ".venv-peers"
PYTHON = ENVIRONMENT / "bin" / "python"
MAX_RANGE = 50.0  # m: nothing indoors is farther


def run_peer(name: str, log: Log, folder: Path) -> tuple[float, float, int]:
    """Run a peer over a log; it leaves ``trajectory.tum``, of the robot's base, in the folder.

    Returns
    -------
    cpu_seconds, mapping_seconds : float
        CPU time of the whole process, and between the scans in memory and the last pose.
    peak_bytes : int

    Raises
    ------
    SystemFailedError
        If it cannot be installed or run.
    """
    error = _install(name)
    if error:
        raise SystemFailedError(f"cannot be installed: {error}")
    scans, path = folder / "scans.npz", folder / "trajectory.tum"
    hand_over(log, scans)
    cpu_seconds, peak = measured([str(PYTHON), str(PEERS / f"run_{name}.py"), str(scans), str(folder)], folder)
    scans.unlink()
    mount = log.recording.lidar_mount
    if mount is not None:  # the peers know of the lidar only
        stamps, poses = read_trajectory(path)
        write_trajectory(path, stamps, compose(poses, inverse(np.array(mount))))
    figures = json.loads((folder / "figures.json").read_text())
    return cpu_seconds, figures["mapping_seconds"], peak


@cache
def _install(name: str) -> str:
    """Install a peer where it is not yet; say why where that fails."""
    wanted = PEERS / f"{name}.txt"
    installed = ENVIRONMENT / wanted.name
    if installed.exists() and installed.read_bytes() == wanted.read_bytes():
        return ""
    print(f"installing {name} into {ENVIRONMENT.name} ...", file=sys.stderr)
    commands = [] if PYTHON.exists() else [[sys.executable, "-m", "venv", str(ENVIRONMENT)]]
    pip = [str(PYTHON), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1"]
    for words in (*commands, [*pip, "-r", str(wanted)]):
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode:
            return last_line(done.stderr or done.stdout)
    shutil.copy(wanted, installed)
    return ""


def hand_over(log: Log, path: Path) -> None:
    """Write the scans for a peer, each with the lidar's pose by the wheels; NaN is no return."""
    mount = np.array(log.recording.lidar_mount or (0.0, 0.0, 0.0))
    stamps, wheels = log.odometry
    order = np.argsort(stamps, kind="stable")
    latest: Odometry | None = None
    tables: dict[bytes, int] = {}  # where a set of beam angles begins: scans of one lidar share theirs
    angles: list[float] = []
    times, poses, beams, angle_starts = [], [], [], []
    for message in log.messages:
        if isinstance(message, Odometry):
            latest = message
        if not isinstance(message, LaserScan):
            continue
        # A CARMEN scan line carries its own odometry, which comes just before it.
        if latest is not None and latest.stamp == message.stamp:
            base = latest.pose
        else:
            base = interpolate(stamps[order], wheels[order], np.array([message.stamp]))[0]
        key = message.angles.tobytes()
        if key not in tables:
            tables[key] = len(angles)
            angles += message.angles.tolist()
        times.append(message.stamp)
        poses.append(compose(base, mount))
        beams.append(np.where(valid_beams(message, MAX_RANGE), message.ranges, np.nan))
        angle_starts.append(tables[key])
    np.savez(
        path,
        stamps=np.array(times),
        odometry=np.array(poses),
        ranges=np.concatenate(beams),
        starts=np.concatenate([[0], np.cumsum([len(ranges) for ranges in beams])]),
        angles=np.array(angles),
        angle_starts=np.array(angle_starts),
    )
