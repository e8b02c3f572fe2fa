"""The graph: keyframes and what binds them, doubt, loops, refinement."""

import math
from functools import cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from contourslam.config import Config, GraphConfig
from contourslam.geometry.poses import compose_one
from contourslam.graph.doubt import DoubtTree
from contourslam.graph.landmark_set import find_landmark_set
from contourslam.graph.pose_graph import PoseGraph
from contourslam.graph.sightings import KIND, X, Y
from contourslam.graph.slam import GraphSlam
from contourslam.landmarks import trace
from contourslam.matching.oriented import oriented_points
from contourslam.matching.search import search
from contourslam.matching.search_grid import build_search_grid
from contourslam.matching.small import turned
from contourslam.replay import replay
from contourslam.report.figures.style import BLUE, FAINT, GREEN, GREY, INK, ORANGE, VERMILION, styled
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.long_drive import WheelErrors, building_drive
from contourslam.simulation.ray_casting import outlines
from contourslam.slam import RunResult
from contourslam.slam.measurement import CORNER

from .matching import PLACES
from .scene import (
    NO_CIRCLES,
    Floats,
    draw_ellipse,
    draw_robot,
    draw_room,
    draw_walls,
    drive,
    drive_config,
    outline,
    scan_of,
)


@styled
def figure_factors() -> Figure:
    """The graph of a lap of the furnished room: keyframes, corners, and who saw which."""
    run = drive()
    slam = GraphSlam(drive_config(), initial_pose=run.initial_pose, lidar_mount=run.lidar_mount)
    for message in run.messages():
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            slam.push_scan(message)
    memory = slam.memory
    poses = memory.graph.poses(range(len(memory.keyframes)))
    sightings = memory.landmarks.sightings
    found = find_landmark_set(sightings, poses)
    which = np.flatnonzero(found.labels >= 0)
    corner = which[sightings.rows[which, KIND] == CORNER]
    lines = np.stack([poses[sightings.keys[corner], :2], found.table[found.labels[corner]][:, [X, Y]]], axis=1)
    figure = Figure(figsize=(6.4, 5.0), layout="constrained")
    axes = figure.subplots()
    draw_room(axes)
    axes.add_collection(LineCollection(list(lines), colors=ORANGE, linewidths=0.3, alpha=0.7))
    axes.plot([], [], color=ORANGE, linewidth=0.8, label="sighting")
    axes.plot(*poses[:, :2].T, "o-", color=BLUE, markersize=4.5, label="keyframe")
    corners = found.table[found.table[:, KIND] == CORNER]
    axes.plot(corners[:, X], corners[:, Y], "s", color=VERMILION, markersize=4.5, label="corner")
    places = memory.places.list
    for loop, place in [
        (loop, p) for loop in slam.loops() for p in places if memory.keyframes[p.anchor].stamp == loop.earlier_stamp
    ]:
        later = next(k for k, frame in enumerate(memory.keyframes) if frame.stamp == loop.later_stamp)
        axes.plot(*poses[[place.anchor, later], :2].T, color=GREEN, linewidth=1.6)
    axes.plot([], [], color=GREEN, linewidth=1.6, label="tie to a place seen before")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, columnspacing=1.0)
    return figure


def ring(ties: list[tuple[int, int, Floats, float | None]]) -> Floats:
    """Two laps of a square, driven with a heading that drifts; with ties to places seen before. Poses, shape (n, 3)."""
    chance, graph = np.random.default_rng(7), PoseGraph()
    side, count = 12, 81
    straight, bend = np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, math.pi / 2])
    sigmas = np.array([0.05, 0.05, math.radians(1.5)])
    pose = np.zeros(3)
    graph.add(0, pose)
    graph.fix(0, pose, np.full(3, 1e-3))
    for k in range(1, count):
        step = bend if k % (side - 2) == 0 else straight
        step = step + sigmas * chance.standard_normal(3) + [0.0, 0.0, 0.012]
        pose = compose_one(pose, step)
        graph.add(k, pose)
        graph.relate(k - 1, k, step, np.diag(1.0 / sigmas**2))
    for first, second, seen, robust in ties:
        graph.relate(first, second, seen, np.diag([400.0, 400.0, 1600.0]), robust, tie=True)
    graph.update(20)
    return graph.poses(range(count))


@styled
def figure_loop_closure() -> Figure:
    """Odometry that drifts; tied to places seen before; one of the ties wrong, without and with a robust kernel."""
    right = [(k, k + 40, np.zeros(3), None) for k in (3, 13, 23, 33)]
    wrong = (8, 72, np.array([0.3, 0.2, 0.0]))  # a corner of the next corridor that looks the same
    figure = Figure(figsize=(7.6, 2.5), layout="constrained")
    panes = figure.subplots(1, 4, sharex=True, sharey=True)
    cases = (
        ("no ties", []),
        ("right ties", right),
        ("a wrong one too", [*right, (*wrong, None)]),
        ("… with kernels", [(*tie[:3], 3.0) for tie in (*right, wrong)]),
    )
    for axes, (name, ties) in zip(panes, cases, strict=True):
        poses = ring(ties)
        axes.plot([0, 10, 10, 0, 0], [0, 0, 10, 10, 0], color=FAINT, linewidth=5.0)
        axes.plot(*poses[:, :2].T, color=BLUE, linewidth=1.2)
        for first, second, _, _ in ties:
            is_wrong = (first, second) == wrong[:2]
            axes.plot(*poses[[first, second], :2].T, "o-", color=VERMILION if is_wrong else GREEN, markersize=4)
        axes.set(aspect="equal", xlabel=f"x (m)\n{name}", xlim=(-3, 14), ylim=(-4, 13))
    panes[0].set_ylabel("y (m)")
    return figure


def grow(tied: bool) -> list[tuple[Floats, Floats]]:
    """Places along a loop and their covariances as seen from the start, from the tree of doubt."""
    tree, poses, pose = DoubtTree(), [], np.zeros(3)
    step = np.diag([0.03**2, 0.02**2, math.radians(0.8) ** 2])
    for k in range(24):
        number = tree.add(k - 1, pose, turned(step, pose[2]) if k else 1e-9 * np.eye(3))
        if tied and k == 20:
            tree.better(number, 1, pose, np.diag([0.05**2, 0.05**2, math.radians(0.5) ** 2]))
        poses.append((pose, tree.from_start(number, pose)))
        pose = compose_one(pose, np.array([2.0, 0.0, math.pi / 2 if k % 5 == 4 else 0.0]))
    return poses


@styled
def figure_doubt() -> Figure:
    """Doubt about each place as seen from the start, before and after a loop is closed."""
    figure = Figure(figsize=(7.4, 3.3), layout="constrained")
    panes = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, tied in zip(panes, (False, True), strict=True):
        places = grow(tied)
        axes.plot(*np.array([pose[:2] for pose, _ in places]).T, ".-", color=GREY, linewidth=1.0)
        for k, (pose, covariance) in enumerate(places):
            draw_ellipse(axes, pose[:2], covariance[:2, :2], GREEN if tied and k >= 20 else BLUE, linewidth=1.0)
        draw_robot(axes, np.zeros(3), INK)
        axes.set(xlabel="x (m), " + ("loop closed at the 21st place" if tied else "no loop"), aspect="equal")
    panes[0].set_ylabel("y (m)")
    return figure


def _runners_up(
    axes: Axes, segments: Floats, circles: Floats, known: list[Floats], at: Floats, window: Floats, name: str
) -> None:
    """Search for a scan in what scans from other poses saw, and draw the best poses with their scores."""
    from contourslam.matching.oriented import move

    points = np.concatenate(
        [
            move(oriented_points(trace(scan_of(segments, p, chance=k, circles=circles), Config())), p)
            for k, p in enumerate(known)
        ]
    )
    seen = oriented_points(trace(scan_of(segments, at, chance=99, circles=circles), Config()))
    grid = build_search_grid(points[:, :2], points[:, 2:])
    some = seen[:: max(len(seen) // 200, 1)]
    found = search(
        grid,
        some[:, :2],
        at + np.array([0.3, 0.2, 0.05]),
        window,
        normals=some[:, 2:],
        min_score=0.2,
        rival=0.2,
        keep=3,
    )
    axes.plot(*points[::3, :2].T, ".", color=FAINT, markersize=3)
    for hypothesis, shade in zip(found[::-1], (ORANGE, VERMILION, BLUE)[-len(found) :], strict=True):
        axes.plot(*move(seen[::2], hypothesis.pose)[:, :2].T, ".", color=shade, markersize=2)
        draw_robot(axes, hypothesis.pose, shade, label=f"score {hypothesis.score:.2f}")
    handles, names = axes.get_legend_handles_labels()
    axes.legend(
        handles[::-1],
        names[::-1],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=3,
        columnspacing=0.6,
        handletextpad=0.1,
    )
    axes.set(xlabel=f"x (m), {name}", ylabel="y (m)", aspect="equal")


@styled
def figure_runner_up() -> Figure:
    """The best poses of an exhaustive search: one that stands alone, and several that are as good."""
    figure = Figure(figsize=(7.6, 3.3), layout="constrained")
    room, corridor = figure.subplots(1, 2, width_ratios=(1.0, 1.5))
    segments, circles, _ = PLACES["room"]
    known = [np.array(p) for p in ((1.8, 4.0, 0.0), (4.2, 5.0, 1.0), (6.6, 4.4, 2.0), (5.0, 1.6, 3.0))]
    _runners_up(
        room, segments, circles, known, np.array([3.0, 4.6, 0.4]), np.array([2.0, 2.0, 0.6]), "a furnished room"
    )
    doors = [[x + dx, y] for x in range(-12, 13, 3) for dx, y in ((1.0, -1.0), (1.0, -1.2), (2.0, -1.2), (2.0, -1.0))]
    ring_of_walls = outline((-12.0, -1.0), *(tuple(p) for p in doors), (15.0, -1.0), (15.0, 1.0), (-12.0, 1.0))
    known = [np.array([x, 0.0, 0.0]) for x in (-6.0, 0.0, 6.0)]
    window = np.array([4.5, 0.6, 0.3])
    _runners_up(
        corridor, ring_of_walls, NO_CIRCLES, known, np.array([0.6, 0.1, 0.0]), window, "a corridor of doors alike"
    )
    corridor.set(xlim=(-9.0, 10.0), ylim=(-4.0, 4.0))
    return figure


@cache
def building() -> tuple[RunResult, Floats]:
    """A drive of 90 m through an office building with poor wheels, through the graph; and its walls."""
    route = building_drive(90.0, 2, wheels=WheelErrors(radius=0.02, base=0.05, slip=0.01))
    config = Config(back_end="graph", graph=GraphConfig(loops=True, refine=True))
    return replay(route.messages(), config, lidar_mount=route.lidar_mount), outlines(route.building.room, 0.2)[0]


@styled
def figure_refined() -> Figure:
    """Errors of the poses as known at the time, and after the refinement; wheels alone for comparison."""
    result, segments = building()
    assert result.truth is not None
    assert result.online_poses is not None
    figure = Figure(figsize=(7.6, 3.4), layout="constrained")
    plane, errors = figure.subplots(1, 2, width_ratios=(1.1, 1.0))
    draw_walls(plane, segments, linewidth=0.6)
    plane.plot(*result.odometry[:, :2].T, color=ORANGE, linewidth=1.0, label="wheels alone")
    plane.plot(*result.poses[:, :2].T, color=BLUE, linewidth=1.2, label="refined")
    low, high = result.poses[:, :2].min(axis=0) - 3.0, result.poses[:, :2].max(axis=0) + 3.0
    plane.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    plane.grid(visible=False)
    plane.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    for poses, shade, name in (
        (result.online_poses, VERMILION, "as known at the time"),
        (result.poses, BLUE, "refined"),
    ):
        off = np.hypot(*(poses - result.truth)[:, :2].T)
        errors.plot(
            result.stamps, 100 * off, color=shade, label=f"{name}: RMS {100 * math.sqrt((off**2).mean()):.1f} cm"
        )
    errors.set(xlabel="time (s)", ylabel="distance from the truth (cm)", ylim=(0.0, None))
    errors.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure
