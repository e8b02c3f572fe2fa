"""Corners and walls refined by lines, and whether their covariance is that of their errors."""

import math
from functools import cache

import numpy as np
from matplotlib.figure import Figure

from contourslam.config import Config, LidarConfig
from contourslam.detectors import make_detector
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import transform
from contourslam.landmarks import detect, extract_walls, trace
from contourslam.matching.small import turned
from contourslam.report.figures.style import BLUE, GREY, INK, ORANGE, VERMILION, styled

from .scene import Floats, draw_ellipse, draw_robot, draw_walls, scan_of, wedge

SIGMA = 0.02  # m: enough for the eye to see
NOISY = Config(lidar=LidarConfig(sigma_range=SIGMA))
DETECTOR = make_detector("matched_filter")
LIDAR = np.array([3.0, 0.0, math.pi])  # looks from +x at the corner in the origin


@cache
def corners_seen(opening_deg: float, count: int) -> tuple[Floats, Floats, Floats]:
    """Errors of refined corners (k, 2), their stated covariances (k, 2, 2), and errors of the raw vertices (k, 2)."""
    chance = np.random.default_rng(int(opening_deg))
    walls, true = wedge(math.radians(opening_deg)), np.array([3.0, 0.0])
    refined, stated, raw = [], [], []
    for _ in range(count):
        pose = LIDAR + np.array([0.0, 0.0, chance.uniform(0.0, 0.02)])  # the beams fall elsewhere each time
        corners = detect(scan_of(walls, pose, sigma=SIGMA, chance=chance), DETECTOR, NOISY).corners
        if len(corners) == 1:
            turn = np.array([0.0, 0.0, pose[2] - math.pi])
            refined.append(transform(turn, corners.positions[0]) - true)
            raw.append(transform(turn, corners.vertices[0]) - true)
            stated.append(turned(np.pad(corners.covariances[0], (0, 1)), turn[2])[:2, :2])
    return np.array(refined), np.array(stated), np.array(raw)


@styled
def figure_refinement() -> Figure:
    """Lines fitted to the two sides of a corner, and where they meet."""
    walls, lidar = wedge(math.radians(90.0)), LIDAR + np.array([0.0, 0.0, 0.009])
    scan = scan_of(walls, lidar, sigma=SIGMA, beams=360, chance=36)
    found = detect(scan, DETECTOR, NOISY)
    corners, points = found.corners, transform(lidar, found.contours.points)
    (x, y), vertex = transform(lidar, corners.positions[0]), transform(lidar, corners.vertices[0])
    bisector, half = corners.directions[0] + lidar[2], 0.5 * corners.openings[0]
    covariance = turned(np.pad(corners.covariances[0], (0, 1)), lidar[2])[:2, :2]
    figure = Figure(figsize=(7.4, 3.3), layout="constrained")
    for axes, reach in zip(figure.subplots(1, 2), (1.25, 0.13), strict=True):
        draw_walls(axes, walls, color="#d5d5d5", linewidth=4.0)
        for way, shade in ((half, BLUE), (-half, ORANGE)):
            end = np.array([x, y]) + 1.2 * np.array([math.cos(bisector + way), math.sin(bisector + way)])
            axes.plot([x, end[0]], [y, end[1]], color=shade)
        upper = points[:, 1] > 0.0
        axes.plot(*points[upper].T, ".", color=BLUE)
        axes.plot(*points[~upper].T, ".", color=ORANGE)
        axes.plot(
            *vertex,
            "s",
            markerfacecolor="none",
            markeredgecolor=GREY,
            markersize=11,
            markeredgewidth=1.6,
            label="raw vertex",
        )
        axes.plot(x, y, "o", color=VERMILION, markersize=6, label="refined, with 2σ", zorder=5)
        axes.plot(0.0, 0.0, "+", color=INK, markersize=13, markeredgewidth=1.8, label="true corner", zorder=6)
        draw_ellipse(axes, (x, y), covariance, VERMILION)
        axes.set(
            aspect="equal",
            xlim=(-0.15 * reach if reach > 1 else -0.1, reach if reach > 1 else 0.16),
            ylim=(-reach, reach),
        )
        axes.set(xlabel="x (m)", ylabel="y (m)")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


@styled
def figure_corner_monte_carlo() -> Figure:
    """Errors of many refined corners beside the ellipse that each states on average."""
    figure = Figure(figsize=(7.4, 2.9), layout="constrained")
    for axes, opening in zip(figure.subplots(1, 3, sharex=True, sharey=True), (60.0, 90.0, 140.0), strict=True):
        errors, stated, _ = corners_seen(opening, 300)
        axes.plot(*1e3 * errors.T, ".", color=GREY, markersize=3)
        draw_ellipse(axes, 1e3 * errors.mean(axis=0), 1e6 * np.cov(errors.T), INK, linestyle="--")
        draw_ellipse(axes, (0.0, 0.0), 1e6 * stated.mean(axis=0), VERMILION)
        squares = np.einsum("ti,ti->t", errors, np.linalg.solve(stated, errors[:, :, None])[:, :, 0])
        axes.set_xlabel(f"x (mm)\nopens by {opening:.0f}°: mean d² {squares.mean():.2f}")
        axes.set(aspect="equal", xlim=(-34, 34), ylim=(-34, 34))
        if opening == 60.0:
            axes.set_ylabel("y (mm)")
    axes.plot([], [], color=VERMILION, label="stated, 2σ")
    axes.plot([], [], color=INK, linestyle="--", label="measured, 2σ")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


@styled
def figure_corner_error() -> Figure:
    """Error of raw and refined corners against the opening angle."""
    openings = np.arange(40.0, 146.0, 15.0)
    rows = []
    for opening in openings.tolist():
        refined, stated, raw = corners_seen(opening, 60)
        rows.append([math.sqrt((raw**2).sum(axis=1).mean()), math.sqrt((refined**2).sum(axis=1).mean()),
                     math.sqrt(np.trace(stated, axis1=1, axis2=2).mean())])  # fmt: skip
    raw, refined, stated = 1e3 * np.array(rows).T
    figure = Figure(figsize=(6.4, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(openings, raw, "s-", color=GREY, markersize=5, label="raw vertex")
    axes.plot(openings, refined, "o", color=VERMILION, markersize=6, label="refined")
    axes.plot(openings, stated, color=VERMILION, linestyle="--", label="refined, as stated")
    axes.set(xlabel="opening of the corner (degrees)", ylabel="RMS distance from the truth (mm)", ylim=(0.0, None))
    axes.legend()
    return figure


@styled
def figure_wall_monte_carlo() -> Figure:
    """Errors of a wall's direction and distance, seen from beside its middle."""
    chance = np.random.default_rng(2)
    wall = np.array([[[3.0, 2.0], [-0.5, 2.0]]])
    errors, stated = [], []
    for _ in range(400):
        turn = chance.uniform(0.0, 0.02)
        walls = extract_walls(
            trace(scan_of(wall, (0.0, 0.0, turn), sigma=SIGMA, chance=chance), NOISY), SIGMA, NOISY.landmarks
        )
        if len(walls) == 1:
            errors.append([float(wrap(walls.lines[0, 0] + turn - math.pi / 2)), walls.lines[0, 1] - 2.0])
            stated.append(walls.covariances[0])
    figure = Figure(figsize=(7.4, 3.0), layout="constrained")
    plane, cloud = figure.subplots(1, 2)
    points = trace(scan_of(wall, (0.0, 0.0, 0.0), sigma=SIGMA), NOISY).points
    plane.plot(*points.T, ".", color=BLUE, markersize=3)
    plane.plot(*points.mean(axis=0), "x", color=ORANGE, markersize=9, markeredgewidth=2.0)
    plane.annotate("centroid", points.mean(axis=0), (0, -16), textcoords="offset points", ha="center")
    plane.annotate("", (0.0, 2.0), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": INK})
    plane.annotate("n, ρ", (0.08, 1.0))
    plane.annotate("", (points[:, 0].mean(), 2.16), (0.0, 2.16), arrowprops={"arrowstyle": "<->", "color": GREY})
    plane.annotate("lever", (0.5 * points[:, 0].mean(), 2.24), ha="center", color=GREY)
    draw_robot(plane, np.zeros(3), INK)
    plane.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", ylim=(-0.3, 2.6))
    scale = np.array([math.degrees(1.0), 1e3])
    values, cov = np.array(errors) * scale, np.array(stated) * np.outer(scale, scale)
    cloud.plot(*values.T, ".", color=GREY, markersize=3)
    draw_ellipse(cloud, values.mean(axis=0), np.cov(values.T), INK, linestyle="--")
    draw_ellipse(cloud, (0.0, 0.0), cov.mean(axis=0), VERMILION)
    cloud.plot([], [], color=VERMILION, label="stated, 2σ")
    cloud.plot([], [], color=INK, linestyle="--", label="measured, 2σ")
    cloud.set(xlabel="error of the normal (degrees)", ylabel="error of the distance (mm)")
    cloud.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure
