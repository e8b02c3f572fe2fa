"""The live world at real time in its process, with a board that has no firmware."""

import multiprocessing
import os
import signal
import threading
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from fake_board import FakeBoard

from contourslam.errors import ContourslamError
from contourslam.robot.lidar.ydlidar_x4 import YdlidarX4
from contourslam.simulation.hardware.line import Damage
from contourslam.simulation.hardware.live_world import LiveWorld, WorldConfig
from contourslam.simulation.hardware.running_world import RunningWorld
from contourslam.simulation.rooms import ROOMS

CONFIG = WorldConfig(ROOMS["furnished_room"], 3)


def test_the_world_runs_at_the_pace_of_the_clock_and_tells_what_happened(tmp_path: Path) -> None:
    with RunningWorld(CONFIG, partial(FakeBoard, (200, 250)), tmp_path) as world:
        begun = time.time()
        with YdlidarX4(str(world.lidar_port), timeout=1.0) as lidar:
            scans = lidar.scans()
            first = next(scans)
            world.unplug_lidar(0.4)
            later = next(scan for scan in scans if lidar.reconnections)
        seconds = time.time() - begun
        record = world.finish()
    assert 400 < first.ranges.size < 900
    assert later.stamp > first.stamp + 0.3
    # The world's time is the wall's, up to what a busy machine holds it up by.
    assert record.steps * 0.002 == pytest.approx(seconds, abs=1.0 + record.latest)
    assert np.allclose(np.diff(record.stamps), 0.01, atol=1e-6)
    assert record.poses[0] == pytest.approx(world.start, abs=1e-3)
    assert np.hypot(*(record.poses[-1] - record.poses[0])[:2]) > 0.1 and record.poses[-1, 2] > record.poses[0, 2]
    assert record.bytes_hit == 0 < record.bytes_sent


def test_lines_are_damaged_when_asked_and_bytes_of_the_base_go_both_ways(tmp_path: Path) -> None:
    with RunningWorld(CONFIG, partial(FakeBoard, (0, 0)), tmp_path) as world:
        with world.base_port.open("r+b", buffering=0) as port:
            port.write(b"hello")
            seen = b""
            while len(seen) < 5:
                seen += port.read(5 - len(seen))
            assert seen == b"hello"
            world.damage(Damage(0.05))
            time.sleep(0.2)
            drain = threading.Thread(target=lambda: [port.read(4096) for _ in range(3)], daemon=True)
            drain.start()
            for _ in range(40):
                port.write(bytes(100))
                time.sleep(0.01)
        record = world.finish()
    assert record.bytes_hit / record.bytes_sent == pytest.approx(0.05, abs=0.03)


def test_a_world_that_cannot_be_made_says_why(tmp_path: Path) -> None:
    with pytest.raises(ContourslamError, match="the simulated robot failed: ContourslamError: the board is not there"):
        RunningWorld(CONFIG, partial(FakeBoard, (0, 0), fails=True), tmp_path)


def process() -> multiprocessing.process.BaseProcess:
    return next(one for one in multiprocessing.active_children() if one.name == "world")


def test_ctrl_c_leaves_the_world_to_the_process_that_made_it(tmp_path: Path) -> None:
    with RunningWorld(CONFIG, partial(FakeBoard, (0, 0)), tmp_path) as world:
        os.kill(process().pid or 0, signal.SIGINT)
        time.sleep(0.2)
        assert world.finish().steps > 0


def test_a_world_that_has_ended_is_told_with_its_reason_whatever_it_is_asked(tmp_path: Path) -> None:
    with RunningWorld(CONFIG, partial(FakeBoard, (0, 0)), tmp_path) as world:
        killed = process()
        killed.kill()
        killed.join()
        with pytest.raises(ContourslamError, match="its process ended with code -9"):
            world.unplug_lidar(1.0)
        with pytest.raises(ContourslamError, match="its process ended with code -9"):
            world.finish()


def test_the_same_seed_makes_the_same_robot(tmp_path: Path) -> None:
    poses = []
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        world = LiveWorld(CONFIG, FakeBoard((300, 200)), tmp_path / folder)
        for _ in range(300):
            world.step()
        poses.append(world.body.now.pose)
        world.lidar_line.unplug()
        world.base_line.unplug()
    assert poses[0] == poses[1]
