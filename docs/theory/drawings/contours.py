"""From a scan to its contours, equations (1) to (11)."""

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from contourslam.config import Config, ContourConfig
from contourslam.contour import difference_code, equalize, polar_code, segment
from contourslam.geometry.poses import compose
from contourslam.landmarks import trace
from contourslam.report.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILION, styled
from contourslam.scan import LaserScan
from contourslam.scan.deskew import deskew
from contourslam.simulation.ray_casting import PlaneCaster

from .scene import NO_CIRCLES, Floats, arc_length, contour_of, draw_robot, draw_walls, indoor_scan, outline, scan_of

SIGMA = 0.01  # m
LAMBDA = math.radians(ContourConfig().breakpoint_angle_deg)


@styled
def figure_polar_code() -> Figure:
    """Ranges over angles, and the same as complex numbers in the plane."""
    scan = indoor_scan()
    points = polar_code(scan.ranges, scan.angles)
    figure = Figure(figsize=(7.4, 3.1), layout="constrained")
    flat, plane = figure.subplots(1, 2, width_ratios=(1.0, 1.2))
    colours = {"c": scan.angles, "cmap": "viridis", "s": 4}
    flat.scatter(np.degrees(scan.angles), scan.ranges, **colours)
    flat.set(xlabel="angle α(n) (degrees)", ylabel="range r(n) (m)", xticks=[-180, -90, 0, 90, 180])
    plane.scatter(points.real, points.imag, **colours)
    draw_robot(plane, np.zeros(3), INK)
    plane.set(xlabel="Re C(n) (m)", ylabel="Im C(n) (m)", aspect="equal")
    return figure


@styled
def figure_deskew() -> Figure:
    """A scan taken while the robot turns: as it comes, and with each beam put where it belongs."""
    room = outline((-2.0, -1.5), (2.4, -1.5), (2.4, 1.8), (-2.0, 1.8))
    angles = -math.pi + 2.0 * math.pi / 500 * np.arange(500)
    offsets = np.linspace(0.0, 1.0 / 7.0, 500)  # seven turns a second
    times = np.linspace(0.0, 1.0 / 7.0, 4)
    twist = np.array([0.4, 0.0, 1.7])  # m/s, m/s, rad/s
    turns = twist[2] * offsets
    poses = np.stack([twist[0] * offsets, np.zeros(500), turns], axis=1)
    ranges, _ = PlaneCaster(room, NO_CIRCLES).cast(poses[:, :2], angles + turns, 30.0)
    scan = LaserScan(0.0, angles, ranges, offsets, 0.05, 30.0)
    every = np.ones(500, np.bool_)
    skewed, _ = deskew(scan, every, np.empty(0), np.empty((0, 3)), np.zeros(3))
    straight, _ = deskew(scan, every, times, compose(np.zeros(3), times[:, None] * twist), np.zeros(3))
    figure = Figure(figsize=(7.4, 3.0), layout="constrained")
    for axes, points, name in zip(
        figure.subplots(1, 2), (skewed, straight), ("as it comes", "motion undone"), strict=True
    ):
        draw_walls(axes, room, linewidth=5.0, color="#dddddd")
        axes.plot(*points.T, ".", color=BLUE, markersize=2.5)
        draw_robot(axes, np.zeros(3), INK)
        axes.set(xlabel=f"x (m), {name}", ylabel="y (m)", aspect="equal")
    return figure


def break_distance(reach: float | Floats, step: float) -> float | Floats:
    """Largest gap in a contour, as the page derives it."""
    return reach * math.sin(step) / math.sin(LAMBDA - step) + ContourConfig().breakpoint_sigmas * SIGMA


def largest_gap(reach: float, step: float) -> float:
    """Largest gap that :func:`contourslam.contour.segment` lets a contour go on over, by bisection, m."""
    bearings = step * np.arange(-9.0, 10.0)
    config = ContourConfig(max_gap=9.0)

    def in_one(farther: float) -> bool:
        ranges = np.where(bearings > 0.0, reach + farther, reach)
        points = ranges[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
        return len(segment(points, bearings, np.arange(19), 1000, SIGMA, config)) == 1

    low, high = 0.0, 5.0
    for _ in range(30):
        low, high = (0.5 * (low + high), high) if in_one(0.5 * (low + high)) else (low, 0.5 * (low + high))
    return math.hypot((reach + low) * math.cos(step) - reach, (reach + low) * math.sin(step))


@styled
def figure_breakpoints() -> Figure:
    """The farthest that the next point on one surface can lie."""
    figure = Figure(figsize=(7.4, 3.1), layout="constrained")
    sketch, curve = figure.subplots(1, 2, width_ratios=(1.0, 1.1))
    step, shallow = math.radians(9.0), math.radians(28.0)  # far larger than a lidar's, so that one sees something
    lidar, last = np.zeros(2), np.array([2.0, 0.0])
    farther = 2.0 * math.sin(shallow) / math.sin(shallow - step)  # law of sines
    following = farther * np.array([math.cos(step), math.sin(step)])
    for end in (last, following):
        sketch.plot(*np.stack([lidar, 1.25 * end]).T, color=GREY, linewidth=1.0)
    way = following - last
    sketch.plot(*np.stack([last - 0.5 * way, last + 1.2 * way]).T, color=BLUE, linestyle="--")
    sketch.add_patch(Circle(tuple(last), math.hypot(*way), facecolor="none", edgecolor=ORANGE))
    sketch.plot(*last, "o", color=INK)
    sketch.plot(*following, "o", color=ORANGE)
    sketch.annotate("C(n−1)", last, (-4, -14), textcoords="offset points", ha="right")
    sketch.annotate("farthest C(n)\non this surface", following, (12, 4), textcoords="offset points")
    sketch.annotate("Δφ", (0.62, 0.02), fontsize=10)
    sketch.annotate("λ", last + 0.42 * way / math.hypot(*way), (-3, -11), textcoords="offset points", color=BLUE)
    draw_robot(sketch, np.zeros(3), INK)
    sketch.set(aspect="equal", xlim=(-0.2, 4.3), ylim=(-1.2, 1.6))
    sketch.axis("off")
    for beams, colour in ((360, VERMILION), (500, BLUE), (1440, GREEN)):
        step, reach = 2.0 * math.pi / beams, np.linspace(0.2, 8.0, 60)
        curve.plot(reach, break_distance(reach, step), color=colour, label=f"{beams} beams a turn")
        some = reach[4::8]
        curve.plot(some, [largest_gap(r, step) for r in some], "o", color=colour, markersize=4)
    curve.plot([], [], "o", color=GREY, markersize=4, label="what segment() follows")
    curve.set(xlabel="range of the nearer point (m)", ylabel="largest gap (m)", ylim=(0.0, None))
    curve.legend()
    return figure


@styled
def figure_contours() -> Figure:
    """Lengths of the difference code with its breaks, and the contours of the scan."""
    scan = indoor_scan()
    gamma = np.abs(difference_code(polar_code(scan.ranges, scan.angles)))
    limit = break_distance(np.minimum(scan.ranges[:-1], scan.ranges[1:]), 2.0 * math.pi / len(scan.ranges))
    figure = Figure(figsize=(7.4, 5.4), layout="constrained")
    lengths, plane = figure.subplots(2, 1, height_ratios=(1.0, 2.2))
    place, cut = np.arange(len(gamma)), gamma > np.minimum(limit, ContourConfig().max_gap)
    lengths.semilogy(place, gamma, ".", color=GREY, markersize=3, label="|γ(n)|")
    lengths.semilogy(place, limit, color=ORANGE, label="largest gap")
    lengths.semilogy(place[cut], gamma[cut], "o", color=VERMILION, markersize=5, label="break")
    lengths.set(xlabel="beam n", ylabel="length (m)")
    lengths.legend(ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    contours = trace(scan, Config())
    colours = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION)
    for i in range(len(contours)):
        plane.plot(*contours[i].T, ".-", color=colours[i % 6], markersize=3, linewidth=1.0)
    draw_robot(plane, np.zeros(3), INK)
    plane.set(xlabel="x of the lidar (m)", ylabel="y of the lidar (m)", aspect="equal")
    return figure


@styled
def figure_mixed_pixels() -> Figure:
    """Beams that touch two surfaces give points in the air between them."""
    walls = np.concatenate([outline((-2.0, -1.2), (2.5, -1.2), (2.5, 1.6), (-2.0, 1.6)), [[[1.2, 0.5], [1.2, -0.2]]]])
    scan = scan_of(walls, (0.0, 0.0, 0.0), sigma=0.005, beams=360)
    ranges = scan.ranges.copy()
    jumps = np.flatnonzero(np.abs(np.diff(ranges)) > 0.5)
    ranges[jumps] = ranges[jumps + 1] * 0.45 + ranges[jumps] * 0.55  # the spot of the last beam lies half beside
    scan = LaserScan(0.0, scan.angles, ranges, scan.offsets, 0.05, 30.0)
    raw = polar_code(ranges, scan.angles)
    contours = trace(scan, Config())
    kept = {(round(x, 9), round(y, 9)) for x, y in contours.points.tolist()}
    lost = np.array([(z.real, z.imag) for z in raw if (round(z.real, 9), round(z.imag, 9)) not in kept])
    figure = Figure(figsize=(6.0, 3.2), layout="constrained")
    axes = figure.subplots()
    for i in range(len(contours)):
        axes.plot(*contours[i].T, ".", color=(BLUE, ORANGE, GREEN)[i % 3], markersize=4)
    axes.plot(*lost.T, "x", color=VERMILION, markersize=8, markeredgewidth=2.0, label="mixed pixel, dropped")
    for point in lost:
        axes.plot(*np.stack([np.zeros(2), point]).T, color=VERMILION, linewidth=0.6)
    draw_robot(axes, np.zeros(3), INK)
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", xlim=(-0.3, 2.8))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


@styled
def figure_equalization() -> Figure:
    """A contour of uneven vectors cut into pieces of equal arc length; each piece's vector is its chord."""
    raw = np.array([[0.0, 0.0], [0.55, 0.1], [0.8, 0.45], [1.5, 0.6], [1.62, 0.42], [1.7, 0.0], [2.6, -0.15]])
    length = arc_length(raw)[-1]
    pieces = equalize(contour_of(raw), length / 5)
    ends = np.stack([np.interp(pieces.source, np.arange(len(raw)), column) for column in raw.T], axis=1)
    figure = Figure(figsize=(7.4, 2.7), layout="constrained")
    axes = figure.subplots()
    colours = (BLUE, ORANGE, GREEN, PURPLE, SKY)
    for r, (first, last) in enumerate(zip(pieces.source[:-1], pieces.source[1:], strict=True)):
        inner = raw[math.ceil(first + 1e-9) : math.floor(last - 1e-9) + 1]
        way = np.concatenate([ends[r : r + 1], inner, ends[r + 1 : r + 2]])
        axes.plot(*way.T, color=colours[r], linewidth=5.0, alpha=0.35, solid_capstyle="butt")
        axes.annotate(
            "",
            ends[r + 1],
            ends[r],
            arrowprops={"arrowstyle": "-|>", "color": colours[r], "shrinkA": 0, "shrinkB": 0, "lw": 1.6},
        )
        middle = 0.5 * (ends[r] + ends[r + 1])
        axes.annotate(f"ε({r})", middle, (2, (-15, -15, -15, 9, -15)[r]), textcoords="offset points", color=colours[r])
    axes.plot(*raw.T, "o", color=INK, markersize=5, label="end of an elementary vector γ(n)")
    axes.plot(*pieces.points.T, "|", color=VERMILION, markersize=16, markeredgewidth=2.0, label="end of a piece")
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", ylim=(-0.35, 0.9))
    axes.legend(loc="upper right")
    return figure


@styled
def figure_noise_lengthens() -> Figure:
    """A noisy contour is longer than the wall it follows; averaged first, it is not."""
    figure = Figure(figsize=(7.4, 2.9), layout="constrained")
    wall, whole = figure.subplots(1, 2)
    room = np.array([[[0.6, -0.35], [0.6, 0.35]]])
    noisy = trace(scan_of(room, (0.0, 0.0, 0.0)), Config())
    even = equalize(noisy, 0.06, average_below=3.0 * SIGMA)
    wall.plot(*noisy.points.T[::-1], ".-", color=GREY, linewidth=0.8, markersize=3, label="raw")
    wall.plot(*even.points.T[::-1], "o-", color=BLUE, markersize=4, label="averaged and equalized")
    wall.set(xlabel="y (m)", ylabel="x (m)", ylim=(0.5, 0.72))
    wall.legend(loc="upper left")
    distances = np.geomspace(0.4, 6.0, 14)
    lengths = {0.0: [], 3.0 * SIGMA: []}
    for distance in distances.tolist():
        side = np.array([[[distance, -distance], [distance, distance]]])
        contours = trace(scan_of(side, (0.0, 0.0, 0.0)), Config())
        for least, ratios in lengths.items():
            total = np.hypot(*np.diff(equalize(contours, 0.06, average_below=least).points, axis=0).T).sum()
            raw = arc_length(contours.points)[-1]
            ratios.append((raw if least == 0.0 else total) / (2.0 * distance))
    whole.semilogx(distances, lengths[0.0], "o-", color=GREY, markersize=4, label="raw")
    whole.semilogx(distances, lengths[3.0 * SIGMA], "o-", color=BLUE, markersize=4, label="averaged and equalized")
    whole.axhline(1.0, color=INK, linewidth=0.8)
    whole.set(
        xlabel="distance of the wall (m)",
        ylabel="length / true length",
        xticks=[0.5, 1, 2, 5],
        xticklabels=["0.5", "1", "2", "5"],
    )
    whole.minorticks_off()
    whole.legend()
    return figure
