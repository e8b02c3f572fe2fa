"""What the commands of the documents find in their folder: recordings, poses, settings, made as users have them."""

import lzma
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from contourslam.recordings import open_recording
from contourslam.scan import LaserScan, Odometry

ROOT = Path(__file__).parents[1]
BIN = Path(sys.executable).parent


def contourslam(*words: object, cwd: Path) -> None:
    """Run a command that must succeed."""
    subprocess.run([BIN / "contourslam", *map(str, words)], cwd=cwd, check=True, capture_output=True)


class Made:
    """Makes each thing once and copies it to where it is needed.

    A name says what it is: ``*.bag`` a rosbag1, ``*.mcap`` a lone MCAP file, ``*.log.xz`` a CARMEN log, ``*.tum`` true
    poses, ``*.cmap`` a map, ``robot.yaml`` settings; ``ros2``, ``firmware``, ``examples`` and ``docs`` are the clone's
    folders, and any other name is the folder of a rosbag2.
    """

    def __init__(self, store: Path) -> None:
        self.store = store

    def put(self, name: str, folder: Path) -> None:
        """Have it there under its name."""
        goal = folder / name
        goal.parent.mkdir(parents=True, exist_ok=True)
        if name in ("ros2", "firmware", "examples", "docs"):
            goal.symlink_to(ROOT / name)
        elif name == "robot.yaml":
            shutil.copy(ROOT / "ros2" / "contourslam_ros" / "config" / "robot.yaml", goal)
        elif name.endswith(".bag"):
            self._convert(self._recording(), goal)
        elif name.endswith(".mcap"):
            shutil.copy(next(self._recording().glob("*.mcap")), goal)
        elif name.endswith(".log.xz"):
            with lzma.open(goal, "wt", preset=0) as log:
                log.writelines(carmen_lines(self._recording()))
        elif name.endswith(".tum"):
            goal.write_text("".join(true_poses(self._recording())))
        elif name.endswith(".cmap"):
            shutil.copy(self._run() / "map.cmap", goal)
        elif "." not in name:
            shutil.copytree(self._recording(), goal)
        else:
            raise LookupError(f"nobody here knows how to make {name}")

    def _recording(self) -> Path:
        drive = self.store / "drive"
        if not drive.exists():
            contourslam("simulate", "--duration", 65, "--seed", 5, "-o", drive, cwd=self.store)
        return drive

    def _run(self) -> Path:
        run = self.store / "run"
        if not run.exists():
            contourslam("run", self._recording(), "-o", run, cwd=self.store)
        return run

    def _convert(self, recording: Path, bag: Path) -> None:
        """Write a rosbag1 with the rosbags package's own tool."""
        kept = self.store / "drive.bag"
        if not kept.exists():
            command = [BIN / "rosbags-convert", "--src", recording, "--dst", kept]
            subprocess.run(command, check=True, capture_output=True, env=os.environ)
        shutil.copy(kept, bag)


def carmen_lines(recording: Path) -> list[str]:
    """The front half of each scan as FLASER, with the odometry of the moment."""
    lines, pose = [], np.zeros(3)
    ahead = np.radians(np.arange(-90.0, 90.0))
    for message in open_recording(recording).messages():
        if isinstance(message, Odometry):
            pose = message.pose
        elif isinstance(message, LaserScan):
            order = np.argsort(message.angles)
            nearest = np.searchsorted(message.angles[order], ahead).clip(max=len(order) - 1)
            ranges = np.nan_to_num(message.ranges[order][nearest], nan=81.83, posinf=81.83)
            seen = " ".join(f"{r:.3f}" for r in ranges)
            at = " ".join(f"{value:.6f}" for value in pose)
            lines.append(f"FLASER {len(ahead)} {seen} {at} {at} {message.stamp:.6f} sim {message.stamp:.6f}\n")
    return lines


def true_poses(recording: Path) -> list[str]:
    """The true poses in the TUM format."""
    lines = []
    for message in open_recording(recording).messages():
        if type(message).__name__ == "TruePose":
            x, y, theta = message.pose
            lines.append(
                f"{message.stamp:.6f} {x:.6f} {y:.6f} 0 0 0 {math.sin(theta / 2):.9f} {math.cos(theta / 2):.9f}\n"
            )
    return lines
