"""A map of yesterday: the node localization finds the robot in it, and slam goes on in it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped
from observer import Observer, error_of, wait_for

from conftest import Processes
from contourslam.cli import main as contourslam
from contourslam.maps.file import load_map
from contourslam.simulation.simulate import SimulatedRun
from contourslam_ros.messages import header, pose_message

CLOSE = 0.1  # m
PIECE = [14.0, 22.0]  # begins far from where the map does


@pytest.fixture(scope="module")
def known(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("known")
    assert contourslam(["run", str(recording), "-o", str(folder), "--overwrite"]) == 0
    return folder / "map.cmap"


@pytest.fixture(scope="module")
def found(
    processes: Processes, observe: Callable[[str], Observer], known: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Observer]:
    copy = tmp_path_factory.mktemp("continued") / "map.cmap"
    copy.write_bytes(known.read_bytes())
    files = {"localization": known, "slam": copy}
    observers = {node: observe(node) for node in files}
    for node, file in files.items():
        processes.start(node, namespace=node, frame_prefix=f"{node}/", map_file=file)
    plans = [{"namespace": node, "prefix": f"{node}/", "pieces": [PIECE]} for node in files]
    processes.drive(observers.values(), *plans)
    return observers


@pytest.mark.parametrize("node", ["localization", "slam"])
def test_the_robot_is_found_in_the_map_at_once(
    node: str, found: dict[str, Observer], processes: Processes, drive: SimulatedRun
) -> None:
    stamps, poses = found[node].trajectory()
    stamps -= processes.played(node)["shift"]
    assert stamps[0] < PIECE[0] + 2.0
    assert error_of(drive, stamps, poses).max() < CLOSE
    assert wait_for(lambda: found[node].landmarks is not None and found[node].grid is not None, 15.0)


def test_localization_leaves_the_map_as_it_is(found: dict[str, Observer], known: Path) -> None:
    landmarks = found["localization"].landmarks
    assert landmarks is not None
    saved = load_map(known)
    assert [corner.id for corner in landmarks.corners] == saved.corners.ids.tolist()
    np.testing.assert_array_equal([[corner.x, corner.y] for corner in landmarks.corners], saved.corners.positions)


def test_a_robot_that_was_carried_is_found_where_somebody_points(
    found: dict[str, Observer], processes: Processes, drive: SimulatedRun
) -> None:
    robot = found["localization"]
    before = len(robot.poses)
    start = drive.truth(np.array([drive.scans[0].stamp, PIECE[0]]))
    guess = start[1] - start[0]
    publisher = robot.node.create_publisher(PoseWithCovarianceStamped, "initialpose", 1)
    assert wait_for(lambda: publisher.get_subscription_count() > 0, 10.0)
    publisher.publish(pose_message(header(robot.node.get_clock().now().to_msg(), "map"), guess, np.eye(3)))
    player = processes.play(namespace="localization", prefix="localization/", pieces=[[*PIECE[:1], PIECE[0] + 4.0]])
    assert player.wait(60.0) == 0
    stamps, poses = robot.trajectory()
    stamps -= processes.played("localization")["shift"]
    assert len(stamps) > before + 20
    assert error_of(drive, stamps[before:], poses[before:]).max() < CLOSE
