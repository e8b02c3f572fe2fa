"""A robot found in a known map."""

import math
from functools import cache

import numpy as np
from matplotlib.figure import Figure

from contourslam.config import Config
from contourslam.geometry.poses import compose
from contourslam.graph import GraphSlam, kept
from contourslam.landmarks import trace
from contourslam.localization.evidence import weigh
from contourslam.localization.known_map import KnownMap
from contourslam.localization.locate import Locator
from contourslam.localization.posterior import CONFIDENT, log_odds, probabilities
from contourslam.localization.view import view_of
from contourslam.matching.oriented import move, oriented_points
from contourslam.report.figures.style import BLUE, FAINT, GREEN, GREY, ORANGE, VERMILION, styled
from contourslam.scan import LaserScan, Odometry

from .scene import Floats, draw_robot, outline, scan_of

SYMMETRIC = outline((0, 0), (6, 0), (6, 1.2), (7, 1.2), (7, 4), (1, 4), (1, 2.8), (0, 2.8))
CUPBOARD = outline((3.4, 3.98), (3.4, 3.5), (4.8, 3.5), (4.8, 3.98))
ROOMS = {"symmetric": SYMMETRIC, "with a cupboard": np.concatenate([SYMMETRIC, CUPBOARD])}
WAY = np.array([[1.5 + 0.5 * k, 2.0, 0.0] for k in range(9)])
AT = np.array([2.4, 1.3, 0.9])


@cache
def known(room: str) -> KnownMap:
    """Map of a room, from a short drive through it."""
    slam = GraphSlam(Config(), initial_pose=WAY[0])
    for k, pose in enumerate(WAY):
        scan = scan_of(ROOMS[room], pose, chance=k, beams=360)
        slam.push_odometry(Odometry(float(k), pose - WAY[0]))
        slam.push_scan(LaserScan(float(k), scan.angles, scan.ranges, scan.offsets, scan.range_min, scan.range_max))
    slam.finish()
    return KnownMap(kept(slam, {}))


def seen(room: str) -> Floats:
    """Contour points of a scan from another place."""
    return oriented_points(trace(scan_of(ROOMS[room], AT, chance=50, beams=360), Config()))


@styled
def figure_places() -> Figure:
    """A scan found in the map of a room that looks the same from both ends, and in one that does not."""
    figure = Figure(figsize=(7.4, 3.1), layout="constrained")
    panes = figure.subplots(1, 2, sharey=True)
    for axes, room in zip(panes, ROOMS, strict=True):
        view, there = seen(room), known(room)
        found = Locator(there).locate(view)
        axes.plot(*there.points[::2, :2].T, ".", color=FAINT, markersize=5)
        poses = [(found.pose, found.probability), *((r.pose, r.probability) for r in found.runners_up)]
        for (pose, probability), shade in zip(poses, (BLUE, ORANGE, VERMILION), strict=False):
            axes.plot(*move(view[::2], pose)[:, :2].T, ".", color=shade, markersize=2)
            draw_robot(axes, pose, shade, label=f"probability {probability:.2f}")
        axes.set(xlabel=f"x (m), {room}", aspect="equal")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, handletextpad=0.1, columnspacing=0.8)
    panes[0].set_ylabel("y (m)")
    return figure


@styled
def figure_evidence() -> Figure:
    """What speaks for the true pose and for the one that the room looks like from its other end."""
    room = "with a cupboard"
    there, view = known(room), view_of(seen(room))
    turned = compose(np.array([7.0, 4.0, math.pi]), AT)
    figure = Figure(figsize=(7.4, 3.1), layout="constrained")
    plane, bars = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
    plane.plot(*there.points[:, :2].T, ".", color=FAINT, markersize=4)
    rows = []
    for pose, shade, name in ((AT, BLUE, "here"), (turned, ORANGE, "turned about")):
        plane.plot(*move(view.points, pose)[:, :2].T, ".", color=shade, markersize=2)
        draw_robot(plane, pose, shade)
        evidence = weigh(view, there.around(pose), there.free, pose)
        rows.append(
            (
                np.array([evidence.found, evidence.new, evidence.through]) / evidence.total,
                shade,
                name,
                log_odds(evidence),
            )
        )
    for k, (parts, shade, name, odds) in enumerate(rows):
        bars.bar(np.arange(3) + 0.36 * (k - 0.5), 100 * parts, 0.34, color=shade, label=f"{name}: log-odds {odds:+.1f}")
    plane.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    bars.set(xticks=[0, 1, 2], xticklabels=["found", "new", "through"], ylabel="% of what was seen")
    bars.grid(visible=False, axis="x")
    bars.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


@styled
def figure_probability() -> Figure:
    """Probability of the best pose against its log-odds, with and without a second one."""
    figure = Figure(figsize=(6.0, 2.7), layout="constrained")
    axes = figure.subplots()
    odds = np.linspace(-4.0, 12.0, 80)
    for rival, shade, name in (
        (None, BLUE, "no other pose"),
        (5.0, ORANGE, "another of log-odds 5"),
        (9.0, GREEN, "another of log-odds 9"),
    ):
        others = [] if rival is None else [rival]
        axes.plot(odds, [probabilities([o, *others])[0] for o in odds], color=shade, label=name)
    axes.axhline(CONFIDENT, color=GREY, linestyle="--", linewidth=0.9, label="sure")
    axes.set(xlabel="log-odds of a pose against elsewhere", ylabel="probability")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
