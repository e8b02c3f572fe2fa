"""Motion and measurement of the filter, equations (23) to (31)."""

import math

import numpy as np
from matplotlib.figure import Figure

from contourslam.config import MotionConfig
from contourslam.detectors import make_detector
from contourslam.geometry.motion import unicycle_step
from contourslam.geometry.poses import compose
from contourslam.landmarks import find_landmarks, trace
from contourslam.landmarks.detect import NO_WALLS
from contourslam.report.figures.style import BLUE, FAINT, GREEN, GREY, INK, ORANGE, VERMILION, styled
from contourslam.simulation.gliding import arc
from contourslam.slam import ekf
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.measurement import CORNER, measure_corner, predict_measurements
from contourslam.slam.motion import motion_noise, predict
from contourslam.slam.observation import Observations, observe

from .scene import Floats, draw_ellipse, draw_robot, drive, drive_config


def sighting(
    pose: Floats, mount: Floats, place: Floats, noise: Floats, chance: np.random.Generator | None = None
) -> Observations:
    """A concave right-angled corner at a place in the world, as the filter is told of it."""
    seen = np.array(measure_corner(pose, mount, *place))
    if chance is not None:
        seen += np.linalg.cholesky(noise) @ chance.standard_normal(2)
    x, y = seen[0] * math.cos(seen[1]), seen[0] * math.sin(seen[1])
    look = [CORNER, math.pi - pose[2] - mount[2], math.pi / 2, 0.0, x, y, 1.0, 1.0]
    return Observations(seen[None], noise[None], np.array([look]))


@styled
def figure_motion() -> Figure:
    """The printed step against an arc, and a cloud of end poses against the ellipse of the prediction."""
    figure = Figure(figsize=(7.4, 3.3), layout="constrained")
    steps, cloud = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    way = np.array([arc(0.5 * t, 0.8 * t) for t in np.linspace(0.0, 2.0, 50)])
    steps.plot(*way[:, :2].T, color=FAINT, linewidth=6.0, label="arc of a circle")
    for dt, shade in ((1.0, VERMILION), (0.5, ORANGE), (0.1, BLUE)):
        poses = [np.zeros(3)]
        for _ in range(round(2.0 / dt)):
            poses.append(unicycle_step(poses[-1], 0.5, 0.8, dt))
        steps.plot(*np.array(poses)[:, :2].T, ".-", color=shade, label=f"(28), dt = {dt} s")
    steps.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    steps.legend(loc="lower left", bbox_to_anchor=(-0.2, 1.0), ncols=2, columnspacing=0.8)
    chance, config, increment = np.random.default_rng(0), MotionConfig(), np.array([0.2, 0.0, 0.04])
    noise = motion_noise(increment, config)
    mean, covariance = np.zeros(3), 1e-10 * np.eye(3)
    ends, middles = np.zeros((1500, 3)), [mean.copy()]
    for _ in range(25):
        predict(mean, covariance, 3, increment, noise, mean.copy())
        ends = compose(ends, increment + chance.standard_normal((1500, 3)) * np.sqrt(np.diag(noise)))
        middles.append(mean.copy())
    cloud.plot(*ends[:, :2].T, ".", color=GREY, markersize=2, label="1,500 drawn motions")
    cloud.plot(*np.array(middles)[:, :2].T, color=BLUE, label="predicted")
    draw_ellipse(cloud, mean[:2], ekf.symmetric(covariance, 3)[:2, :2], VERMILION)
    cloud.plot([], [], color=VERMILION, label="stated, 2σ")
    cloud.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    cloud.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, columnspacing=0.8, markerscale=4.0)
    return figure


@styled
def figure_measurement() -> Figure:
    """Range and bearing of a corner from a lidar ahead of the axle, and how well corners are measured."""
    figure = Figure(figsize=(7.4, 3.2), layout="constrained")
    sketch, spread = figure.subplots(1, 2)
    pose, mount, corner = np.array([0.5, 0.4, 0.5]), np.array([0.6, 0.0, 0.0]), np.array([2.2, 2.3])
    lidar = compose(pose, mount)
    alpha = measure_corner(pose, mount, *corner)[1]
    ahead = np.array([math.cos(pose[2]), math.sin(pose[2])])
    sketch.plot(*np.stack([pose[:2], lidar[:2] + 1.4 * ahead]).T, color=GREY, linestyle="--", linewidth=1.0)
    sketch.plot(*np.stack([lidar[:2], corner]).T, color=BLUE)
    sketch.plot([pose[0], pose[0] + 0.9], [pose[1], pose[1]], color=GREY, linestyle=":")
    turn = pose[2] + alpha * np.linspace(0.0, 1.0, 20)
    sketch.plot(lidar[0] + 0.8 * np.cos(turn), lidar[1] + 0.8 * np.sin(turn), color=VERMILION)
    sketch.annotate("α", lidar[:2] + 0.93 * np.array([math.cos(turn[10]), math.sin(turn[10])]), color=VERMILION)
    turn = pose[2] * np.linspace(0.0, 1.0, 20)
    sketch.plot(pose[0] + 0.5 * np.cos(turn), pose[1] + 0.5 * np.sin(turn), color=GREY)
    sketch.annotate("θ", (pose[0] + 0.56, pose[1] + 0.06), color=GREY)
    sketch.annotate("d", 0.5 * (pose[:2] + lidar[:2]), (-6, 7), textcoords="offset points")
    sketch.annotate("r", 0.5 * (corner + lidar[:2]), (-12, 4), textcoords="offset points", color=BLUE)
    draw_robot(sketch, pose, INK, markersize=14)
    sketch.plot(*lidar[:2], "o", color=BLUE)
    sketch.plot(*corner, "s", color=VERMILION, markersize=8)
    for text, at, shift in (
        ("$x, y$", pose, (-4, -17)),
        ("$x_l, y_l$", lidar, (9, -9)),
        ("$x_m, y_m$", corner, (9, -4)),
    ):
        sketch.annotate(text, at[:2], shift, textcoords="offset points")
    sketch.set(aspect="equal", xlim=(0.3, 2.9), ylim=(0.0, 2.6))
    sketch.axis("off")
    run, config = drive(), drive_config()
    detector = make_detector("matched_filter")
    rows = [
        (value[0], math.sqrt(noise[0, 0]), value[0] * math.sqrt(noise[1, 1]))
        for scan in run.scans[::6]
        for seen in [observe(find_landmarks(trace(scan, config), detector, config, walls=False).corners, NO_WALLS)]
        for value, noise in zip(seen.values, seen.noises, strict=True)
    ]
    distance, along, across = np.array(rows).T
    spread.semilogy(distance, 1e3 * along, ".", color=BLUE, markersize=3, label="along the beam")
    spread.semilogy(distance, 1e3 * across, ".", color=ORANGE, markersize=3, label="across the beam")
    spread.axhline(10.0, color=GREEN, linestyle="--", label="σ of one range")
    spread.set(
        xlabel="range of the corner (m)",
        ylabel="stated σ (mm)",
        yticks=[2, 5, 10, 20, 50],
        yticklabels=["2", "5", "10", "20", "50"],
    )
    spread.minorticks_off()
    spread.legend(
        loc="upper left", markerscale=3.0, bbox_to_anchor=(0.0, 1.16), ncols=3, columnspacing=0.8, handletextpad=0.3
    )
    return figure


@styled
def figure_correction() -> Figure:
    """What seeing one old corner does to the pose and to the corners seen in between."""
    mount, noise = np.zeros(3), np.diag([0.03**2, math.radians(0.6) ** 2])
    places = np.array([[0.6, 1.4], [2.4, 1.5], [4.2, 1.3]])
    f = LandmarkFilter(np.zeros(3))
    increment = np.array([0.2, 0.0, 0.0])
    drift = motion_noise(increment, MotionConfig(forward_per_sqrt_m=0.1, turn_per_sqrt_m_deg=7.0))
    for k in range(21):
        for i, when in enumerate((2, 11, 20)):
            if k == when:
                f.add(mount, sighting(f.pose, mount, places[i], noise), 0)
        if k < 20:
            predict(f.mean, f.covariance, f.size, increment, drift, f.pose)
    figure = Figure(figsize=(7.4, 3.0), layout="constrained")
    panes = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, name in zip(panes, ("before", "after the first corner is seen again"), strict=True):
        if name != "before":
            true = f.pose + np.array([0.12, 0.2, 0.06])
            seen = np.array(measure_corner(true, mount, *places[0]))
            expected, by_pose, by_landmark = predict_measurements(f.mean[:3], mount, f.mean, f.table, f.count, True)
            one, first = np.array([0]), np.array([0])
            stacked = ekf.stack(one, first, seen[None], noise[None], f.table, expected, by_pose, by_landmark)
            ekf.correct(f.mean, f.covariance, f.size, ekf.landmark_columns(first), *stacked)
            axes.plot(*np.stack([f.mean[:2], places[0]]).T, color=GREEN, linewidth=1.0)
        draw_robot(axes, f.pose, BLUE)
        draw_ellipse(axes, f.mean[:2], f.pose_covariance[:2, :2], BLUE)
        for i in range(3):
            axes.plot(*f.mean[3 + 2 * i : 5 + 2 * i], "s", color=VERMILION, markersize=4)
            draw_ellipse(axes, f.mean[3 + 2 * i : 5 + 2 * i], f.block(i), VERMILION)
        axes.set(xlabel=f"x (m), {name}", aspect="equal", xlim=(0.0, 5.4), ylim=(-1.3, 2.7))
    panes[0].set_ylabel("y (m)")
    return figure
