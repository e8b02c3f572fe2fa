"""What is measured about a fleet that was played: errors in the common frame, who was joined with whom, bytes."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from itertools import combinations
from typing import Any

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.evaluation.errors import align_first, fit
from contourslam.evaluation.fleet import met, rmse
from contourslam.fleet.common import Joined
from contourslam.fleet.play import Fleet
from contourslam.fleet.play_apart import KeptApart
from contourslam.fleet.play_robot import Played
from contourslam.fleet.shared import Shared
from contourslam.report.joints import joint_figures


def fleet_metrics(fleet: Fleet, apart: Sequence[KeptApart] = ()) -> dict[str, Any]:
    """Everything measured about a fleet, ready for metrics.json.

    Parameters
    ----------
    fleet : Fleet
    apart : sequence of KeptApart
        Why common maps are two.

    Returns
    -------
    dict
        Of each robot the errors, m, after one rigid motion per common map that lays all its robots on the world: at
        the end (`rmse`), as known at the time (`online_rmse`, over the scans from which on the robot was told of the
        common map that it ended in), and of its raw odometry, which begins at its own true pose.
    """
    begun = [robot for robot in fleet.robots if robot.told]
    robots = {robot.name: _of_robot(robot, fleet) for robot in begun}
    for shared in fleet.maps:
        _add_errors(robots, [robot for robot in begun if robots[robot.name]["common"] == shared.number], shared)
    return {
        "robots": list(robots.values()),
        "maps": [
            {
                "common": shared.number,
                "members": sorted({name for name, _ in shared.members}),
                "runs": len(shared.members),
                "keyframes": sum(shared.counts),
                "corners": len(shared.saved.corners.ids),
                "walls": len(shared.saved.walls.ids),
            }
            for shared in fleet.maps
        ],
        "joined": [_of_joined(event) for event in fleet.joined],
        "met": [_of_pair(first, second, fleet) for first, second in combinations(begun, 2)],
        "apart": [_of_apart(each) for each in apart],
        "complete": fleet.complete,
        "faults": [asdict(fault) for fault in fleet.faults],
        "server_restarts": fleet.restarts,
        "server_seconds": fleet.seconds,
        "solving_seconds": fleet.solving,
    }


def home(robot: Played, fleet: Fleet) -> Shared | None:
    """Give the common map that holds a robot's last run; None where there is none."""
    last = robot.name, robot.told[-1].run
    return next((shared for shared in fleet.maps if last in shared.members), None)


def _of_robot(robot: Played, fleet: Fleet) -> dict[str, Any]:
    shared, seconds = home(robot, fleet), robot.told[-1].time
    first = next((each.time for each in robot.told if shared is not None and each.common == shared.number), None)
    return {
        "name": robot.name,
        "scans": len(robot.told),
        "seconds": seconds,
        "runs": len({each.run for each in robot.told}),
        "restarts": robot.restarts,
        "damage": robot.damage,
        "messages": robot.up.messages,
        "bytes": robot.up.size,
        "bytes_per_second": robot.up.size / max(seconds, 1e-9),
        "bytes_received": robot.down.size,
        "common": -1 if shared is None else shared.number,
        "told_from": first,
        "rmse": None,
        "online_rmse": None,
        "odometry_rmse": None,
    }


def _add_errors(robots: dict[str, dict[str, Any]], members: list[Played], shared: Shared) -> None:
    known = {robot.name: robot.final(shared) for robot in members if robot.truth}
    if not known:
        return
    truth = {robot.name: robot.true(known[robot.name][0]) for robot in members if robot.name in known}
    every = np.concatenate([poses for _, poses in known.values()]), np.concatenate(list(truth.values()))
    motion = fit(*(poses[:, :2] for poses in every))  # one for all robots of the map
    for robot in members:
        if robot.name not in known:
            continue
        times, poses = robot.online(shared.number)
        robots[robot.name] |= {
            "rmse": rmse(known[robot.name][1], truth[robot.name], motion),
            "online_rmse": _or_none(rmse(poses, robot.true(times), motion)),
            "odometry_rmse": _odometry(robot),
        }


def _odometry(robot: Played) -> float:
    """Error of the raw odometry, the first pose being the true one, m."""
    raw = np.array([each.odometry for each in robot.told])
    truth = robot.true(np.array([each.time for each in robot.told]))
    return rmse(align_first(raw, truth), truth, np.zeros(3))


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _of_joined(event: Joined) -> dict[str, Any]:
    return {
        "time": event.at,
        "common": event.kept,
        "members": event.members,
        "joining": event.joining,
        **joint_figures(event.joint),
    }


def _of_apart(each: KeptApart) -> dict[str, Any]:
    best = None if each.best is None else joint_figures(each.best)
    return {"maps": each.commons, "reason": each.reason, "best": best}


def _of_pair(first: Played, second: Played, fleet: Fleet) -> dict[str, Any]:
    """When two robots had seen the same room, and when they were in the same common map."""
    times: list[Floats] = [np.array([each.time for each in robot.told]) for robot in (first, second)]
    seen = None
    if first.truth and second.truth:
        seen = _or_none(met(first.true(times[0]), second.true(times[1]), (times[0], times[1])))
    return {"robots": (first.name, second.name), "met": seen, "joined": _together(first.name, second.name, fleet)}


def _together(first: str, second: str, fleet: Fleet) -> float | None:
    for event in fleet.joined:
        if any(a in event.members and b in event.joining for a, b in ((first, second), (second, first))):
            return event.at
    return None
