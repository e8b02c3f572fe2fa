"""Several robots side by side, with lidars mounted as they come."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from observer import Observer, error_of, wait_for
from std_srvs.srv import Trigger

from conftest import Processes
from contourslam.geometry.poses import compose
from contourslam.recordings.ros_messages import TRANSFORM, odometry_from
from contourslam.simulation.simulate import SimulatedRun

CLOSE = 0.1  # m
PIECES = [[0.0, 10.0]]
# The same drive seen by another lidar, or told of by other means.
PLANS = {
    "one": {"odometry": "tf", "yaw": math.pi / 2.0},
    "two": {"upside_down": True, "yaw": -2.0},
    "scans_alone": {"odometry": "none"},
    "unmounted": {"mounted": False},
}
PARAMETERS = {"one": {"odometry": "tf"}, "scans_alone": {"odometry": "none"}}


@pytest.fixture(scope="module")
def robots(processes: Processes, observe: Callable[[str], Observer]) -> dict[str, Observer]:
    observers = {name: observe(name) for name in PLANS}
    for name in PLANS:
        processes.start("slam", namespace=name, frame_prefix=f"{name}/", **PARAMETERS.get(name, {}))
    plans = [{"namespace": name, "prefix": f"{name}/", "pieces": PIECES, **plan} for name, plan in PLANS.items()]
    processes.drive(observers.values(), *plans)
    return observers


@pytest.mark.parametrize("name", ["one", "two", "scans_alone"])
def test_each_robot_has_a_map_of_its_own_and_is_right_in_it(
    drive: SimulatedRun, processes: Processes, robots: dict[str, Observer], name: str
) -> None:
    sent = processes.played(name)["scans"]
    assert robots[name].took_in(sent) == sent
    stamps, poses = robots[name].trajectory()
    assert len(stamps) == sent
    assert error_of(drive, stamps - processes.played(name)["shift"], poses).max() < CLOSE
    assert robots[name].frames == {f"{name}/map"}
    assert wait_for(lambda: robots[name].landmarks is not None, 5.0)


@pytest.mark.parametrize("name", ["one", "two"])
def test_the_transforms_lead_from_the_map_over_the_odometry_to_the_pose(
    drive: SimulatedRun, processes: Processes, robots: dict[str, Observer], name: str
) -> None:
    heard = [t for t in robots["one"].transforms if t.header.frame_id == f"{name}/map"]
    assert {t.child_frame_id for t in heard} == {f"{name}/odom"}
    last = odometry_from(heard[-1], TRANSFORM)
    stamps, poses = robots[name].trajectory()
    wheels = drive.odometry
    at = np.searchsorted(wheels.stamps, stamps[-1] - processes.played(name)["shift"])
    assert np.hypot(*(compose(last.pose, wheels.poses[at]) - poses[-1])[:2]) < 0.1
    # Often enough for a controller, each stamped after the one before.
    times = np.array([t.header.stamp.sec + 1e-9 * t.header.stamp.nanosec for t in heard])
    assert (np.diff(times) > 0.0).all()
    assert np.median(np.diff(times)) < 0.1


def test_without_odometry_the_base_is_placed_in_the_map_itself(robots: dict[str, Observer]) -> None:
    heard = [t for t in robots["one"].transforms if t.header.frame_id == "scans_alone/map"]
    assert {t.child_frame_id for t in heard} == {"scans_alone/base_link"}
    assert robots["scans_alone"].latest("/scans_alone/slam: odometry").message.startswith("not used")


def test_a_lidar_of_which_nobody_says_where_it_sits_is_named(robots: dict[str, Observer]) -> None:
    assert robots["unmounted"].said("no transform from unmounted/base_link to unmounted/laser")
    assert robots["unmounted"].poses == []
    answer = robots["unmounted"].call(Trigger, "slam/pause")
    assert not answer.success
    assert "no transform" in answer.message


def test_a_robot_can_be_paused_resumed_and_begun_anew(
    robots: dict[str, Observer], processes: Processes, drive: SimulatedRun
) -> None:
    robot = robots["two"]
    assert robot.call(Trigger, "slam/pause").success
    before = len(robot.poses)
    assert processes.play(namespace="two", prefix="two/", pieces=[[0.0, 2.0]], **PLANS["two"]).wait(60.0) == 0
    assert len(robot.poses) == before
    assert robot.said("paused: scans are left out")
    assert robot.call(Trigger, "slam/reset").success
    assert robot.call(Trigger, "slam/resume").success
    assert processes.play(namespace="two", prefix="two/", pieces=[[0.0, 3.0]], **PLANS["two"]).wait(60.0) == 0
    played = processes.played("two")
    assert wait_for(lambda: len(robot.poses) - before >= played["scans"], 5.0), len(robot.poses) - before
    stamps, poses = robot.trajectory()
    assert len(stamps) - before == played["scans"]
    assert error_of(drive, stamps[before:] - played["shift"], poses[before:]).max() < CLOSE
