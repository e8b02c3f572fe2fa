"""What goes wrong on robots: each is named, and the pose is right again within two seconds of its end.

The robots drive at the same time, in namespaces of their own, for a test that waits costs what it waits.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from observer import Observer, error_of

from conftest import Processes
from contourslam.simulation.simulate import SimulatedRun

CLOSE = 0.1  # m
RIGHT_AGAIN = 2.0  # s after the return
GAP = (5.0, 10.0)
LENGTH = 14.0


@dataclass
class Trouble:
    plan: dict[str, Any] = field(default_factory=dict)
    parameters: dict[str, Any] = field(default_factory=dict)
    unplaced: int = 0  # scans of which no pose comes, at most


TROUBLES = {
    "early": Trouble({"silent": [["odom", 0.0, 6.0]]}),
    "late": Trouble({"standing": True}),
    "without": Trouble({"odometry": "none"}),
    "wheels_stop": Trouble({"silent": [["odom", *GAP]]}),
    "scans_stop": Trouble({"silent": [["scan", *GAP]]}),
    "time_runs_back": Trouble({"clock": True, "pieces": [[0.0, 7.0], [0.0, 7.0]]}, {"use_sim_time": True}, 5),
}


@dataclass
class Seen:
    observer: Observer
    stamps: np.ndarray
    errors: np.ndarray
    sent: float
    received: int  # by the node

    def worst(self, after: float) -> float:
        """Largest error of the poses after a time, m."""
        return float(self.errors[self.stamps > after].max())


@pytest.fixture(scope="module")
def seen(drive: SimulatedRun, processes: Processes, observe: Callable[[str], Observer]) -> dict[str, Seen]:
    names = list(TROUBLES)
    observers: dict[str, Observer] = {}
    received: dict[str, int] = {}
    for together in (names[:3], names[3:]):  # as many as two cores bear
        observers |= {name: observe(name) for name in together}
        for name in together:
            processes.start("slam", namespace=name, frame_prefix=f"{name}/", **TROUBLES[name].parameters)
        robots = [{"namespace": name, "prefix": f"{name}/", "pieces": [[0.0, LENGTH]]} for name in together]
        plans = [robot | TROUBLES[name].plan for name, robot in zip(together, robots, strict=True)]
        processes.drive([observers[name] for name in together], *plans)
        for name in together:
            received[name] = observers[name].took_in(processes.played(name)["scans"], TROUBLES[name].unplaced)
        processes.end()
    found = {}
    for name, observer in observers.items():
        stamps, poses = observer.trajectory()
        played = processes.played(name)
        stamps -= played["shift"]
        found[name] = Seen(observer, stamps, error_of(drive, stamps, poses), played["scans"], received[name])
    return found


def test_a_node_that_starts_before_the_odometry_says_so_and_is_right(seen: dict[str, Seen]) -> None:
    early = seen["early"]
    assert early.observer.said("no odometry has come on /early/odom")
    assert early.sent == early.received == len(early.stamps)
    assert early.worst(6.0 + RIGHT_AGAIN) < CLOSE, early.observer.faults()


def test_a_node_that_starts_after_the_odometry_is_right_from_the_first_scan(seen: dict[str, Seen]) -> None:
    late = seen["late"]
    assert not late.observer.said("no odometry has come on /late/odom")
    assert late.sent == late.received == len(late.stamps)
    assert late.errors.max() < CLOSE, late.observer.faults()


def test_a_robot_without_odometry_is_mapped_and_told_so(seen: dict[str, Seen]) -> None:
    without = seen["without"]
    assert without.observer.said("no odometry has come on /without/odom")
    assert without.errors.max() < CLOSE, without.observer.faults()


def test_odometry_that_stops_is_named_and_the_scans_carry_the_pose(seen: dict[str, Seen]) -> None:
    stopped = seen["wheels_stop"]
    assert stopped.observer.said("no odometry for", "/wheels_stop/odom")
    assert stopped.sent == stopped.received == len(stopped.stamps)
    assert stopped.worst(GAP[1] + RIGHT_AGAIN) < CLOSE, stopped.observer.faults()


def test_scans_that_stop_are_named_and_the_pose_is_right_after(seen: dict[str, Seen]) -> None:
    stopped = seen["scans_stop"]
    assert stopped.observer.said("no scan for", "/scans_stop/scan")
    assert stopped.worst(GAP[1] + RIGHT_AGAIN) < CLOSE, stopped.observer.faults()


def test_time_that_runs_back_is_named_and_the_drive_begun_anew(seen: dict[str, Seen]) -> None:
    back = seen["time_runs_back"]
    assert back.observer.said("time ran back by"), back.observer.faults()
    (at,) = np.flatnonzero(np.diff(back.stamps) < 0.0)
    again = back.stamps[at + 1 :]
    assert again[0] < 1.0
    assert back.errors[at + 1 :][again > RIGHT_AGAIN].max() < CLOSE, back.observer.faults()
    assert (
        len(back.stamps) >= back.sent - TROUBLES["time_runs_back"].unplaced
    )  # one may be a stray, and some pass until the robot is found
