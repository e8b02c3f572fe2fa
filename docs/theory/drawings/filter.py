"""Association, a whole drive, and whether the filter knows how wrong it is."""

import math
from functools import cache

import numpy as np
from matplotlib.figure import Figure

from contourslam.config import SlamConfig
from contourslam.evaluation.consistency import average_nees, chi_square_bounds, nees
from contourslam.evaluation.errors import pose_errors
from contourslam.evaluation.false_negatives import false_negatives
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import compose_one
from contourslam.replay import replay
from contourslam.report.figures.style import BLUE, FAINT, GREEN, GREY, INK, ORANGE, VERMILION, styled
from contourslam.slam import RunResult, ekf
from contourslam.slam.association import associate
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.measurement import predict_measurements
from contourslam.slam.motion import predict
from contourslam.slam.observation import Observations, to_world

from .motion import sighting
from .scene import Floats, draw_ellipse, draw_robot, draw_room, drive, drive_config

NO_MOUNT = np.zeros(3)


@styled
def figure_association() -> Figure:
    """A heading that is wrong: the nearest landmarks are the wrong ones, and only together do pairs show it."""
    chance, noise = np.random.default_rng(4), np.diag([0.03**2, math.radians(0.5) ** 2])
    places = np.array([[4.0, y] for y in (-2.2, -1.6, -0.3, 0.3, 1.9, 2.5)])
    f = LandmarkFilter(np.zeros(3))
    for place in places:
        f.add(NO_MOUNT, sighting(np.zeros(3), NO_MOUNT, place, noise), 0)
    true = np.array([0.0, 0.0, math.radians(9.0)])
    f.covariance[:3, :3] += np.diag([0.05**2, 0.05**2, math.radians(6.0) ** 2])
    each = [sighting(true, NO_MOUNT, places[i], noise, chance) for i in (1, 2, 3, 4)]
    seen = Observations(*(np.concatenate([getattr(s, name) for s in each]) for name in ("values", "noises", "looks")))
    world = to_world(f.mean[:3], NO_MOUNT, seen.looks)
    model = predict_measurements(f.mean[:3], NO_MOUNT, f.mean, f.table, f.count, True)
    figure = Figure(figsize=(7.4, 2.9), layout="constrained")
    panes = figure.subplots(2, 1, sharex=True)
    for axes, rule in zip(panes, ("nearest", "joint"), strict=True):
        chosen = associate(seen, world, f, model, SlamConfig(association=rule, nearest_threshold=0.8))
        axes.plot(-places[:, 1], places[:, 0], "s", color=GREY, markersize=9, label="landmark")
        axes.plot(-world[:, 5], world[:, 4], "o", color=BLUE, markersize=6, label="seen, where the robot thinks")
        for point, i, right in zip(world[:, 4:6], chosen, (1, 2, 3, 4), strict=True):
            if i >= 0:
                ends = np.stack([point, places[i]])
                axes.plot(-ends[:, 1], ends[:, 0], color=GREEN if i == right else VERMILION, linewidth=2.5, zorder=6)
        axes.set(ylabel=f"ahead (m)\n{rule}", aspect="equal", ylim=(3.5, 4.5))
    axes.plot([], [], color=GREEN, linewidth=2.5, label="right pair")
    axes.plot([], [], color=VERMILION, linewidth=2.5, label="wrong pair")
    axes.set_xlabel("to the right (m)")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=4, columnspacing=1.0)
    return figure


@cache
def driven() -> RunResult:
    """The drive through the paper's filter, corners only."""
    run = drive()
    return replay(run.messages(), drive_config(), lidar_mount=run.lidar_mount)


@styled
def figure_map() -> Figure:
    """Corners of the map with their ellipses, ten times as large, over the true room."""
    result, start = driven(), drive().initial_pose
    figure = Figure(figsize=(6.4, 4.9), layout="constrained")
    axes = figure.subplots()
    draw_room(axes)
    truth = result.truth
    assert truth is not None
    axes.plot(*result.odometry[:, :2].T, color=ORANGE, linewidth=1.0, label="wheels alone")
    axes.plot(*truth[:, :2].T, color=FAINT, linewidth=5.0, label="true path")
    axes.plot(*result.poses[:, :2].T, color=BLUE, linewidth=1.2, label="estimate")
    axes.plot(*result.corner_map.positions.T, "s", color=VERMILION, markersize=3, label="corner, 20σ")
    for place, covariance in zip(result.corner_map.positions, result.corner_map.covariances, strict=True):
        draw_ellipse(axes, place, covariance, VERMILION, sigmas=20.0, linewidth=0.9)
    draw_robot(axes, start, INK)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, columnspacing=1.0)
    return figure


@styled
def figure_error_bounds() -> Figure:
    """Errors of x, y and heading with the stated two sigma, as the paper's Fig. 6."""
    result = driven()
    assert result.truth is not None
    errors = pose_errors(result.poses, result.truth) * [1e3, 1e3, math.degrees(1.0)]
    sigmas = np.sqrt(np.diagonal(result.covariances, axis1=1, axis2=2)) * [1e3, 1e3, math.degrees(1.0)]
    figure = Figure(figsize=(7.4, 4.2), layout="constrained")
    for axes, k, name in zip(
        figure.subplots(3, 1, sharex=True), range(3), ("x (mm)", "y (mm)", "heading (°)"), strict=True
    ):
        axes.fill_between(result.stamps, -2.0 * sigmas[:, k], 2.0 * sigmas[:, k], color=BLUE, alpha=0.18, linewidth=0.0)
        axes.plot(result.stamps, errors[:, k], color=INK, linewidth=0.9)
        axes.set_ylabel(name)
    axes.set_xlabel("time (s)")
    return figure


@styled
def figure_false_negatives() -> Figure:
    """How often each corner was seen, and how often it should have been and was not, as the paper's Fig. 7."""
    found = false_negatives(driven().corner_map)
    order = np.argsort(-found.observed)
    place = np.arange(found.count)
    figure = Figure(figsize=(7.4, 3.4), layout="constrained")
    counts, rates = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    counts.bar(place, found.observed[order], color=BLUE, label="seen, o")
    counts.bar(place, found.failed[order], bottom=found.observed[order], color=ORANGE, label="missed, f")
    counts.set_ylabel("scans")
    counts.legend()
    rates.bar(place, found.rates[order], color=VERMILION)
    rates.axhline(SlamConfig().max_false_negative_rate, color=GREY, linestyle="--", linewidth=0.9)
    rates.set(xlabel="corner of the map", ylabel="f / (f + o)", ylim=(0.0, 1.0))
    return figure


def circling(seed: int, *, first_estimates: bool, steps: int = 200) -> Floats:
    """NEES of the pose of a robot that drives in circles among twelve corners, shape (steps,)."""
    chance = np.random.default_rng(seed)
    around = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)
    places = (4.5 + (np.arange(12) % 3))[:, None] * np.stack([np.cos(around), np.sin(around)], axis=1)
    noise, drift = np.diag([0.1**2, math.radians(3.0) ** 2]), np.diag([0.04**2, 0.02**2, math.radians(3.0) ** 2])
    increment = np.array([0.47, 0.0, 2.0 * math.pi / 40.0])  # 40 steps a lap of 3 m radius
    true = np.array([0.0, -3.0, 0.0])
    f = LandmarkFilter(true)
    number: dict[int, int] = {}
    linearised_at, out = f.pose, np.empty(steps)
    for k in range(steps):
        true = compose_one(true, increment)
        wheels = increment + np.sqrt(np.diag(drift)) * chance.standard_normal(3)
        predict(f.mean, f.covariance, f.size, wheels, drift, linearised_at if first_estimates else f.pose)
        linearised_at = f.pose
        model = predict_measurements(f.mean[:3], NO_MOUNT, f.mean, f.table, f.count, first_estimates)
        near = [i for i in range(12) if math.hypot(*(places[i] - true[:2])) < 4.0]
        looks = {i: sighting(true, NO_MOUNT, places[i], noise, chance) for i in near}
        known = [i for i in near if i in number]
        if known:
            rows, columns = np.arange(len(known)), np.array([number[i] for i in known])
            values, noises = (np.concatenate([getattr(looks[i], name) for i in known]) for name in ("values", "noises"))
            stacked = ekf.stack(rows, columns, values, noises, f.table, *model)
            ekf.correct(f.mean, f.covariance, f.size, ekf.landmark_columns(columns), *stacked)
        for i in near:
            if i not in number:
                number[i] = f.count
                f.add(NO_MOUNT, looks[i], 0)
        error = f.pose - true
        error[2] = wrap(error[2])
        out[k] = nees(error[None], f.pose_covariance[None])[0]
    return out


@styled
def figure_consistency() -> Figure:
    """NEES of the pose over laps, with the printed Jacobians and with first-estimates ones."""
    runs = 12
    figure = Figure(figsize=(7.4, 3.0), layout="constrained")
    axes = figure.subplots()
    low, high = chi_square_bounds(3, runs)
    axes.axhspan(float(low), float(high), color="#e4ece7", label=f"95 % of the averages of {runs} runs")
    for first, shade, name in (
        (False, VERMILION, "Jacobians at the latest estimate"),
        (True, BLUE, "at the first estimate"),
    ):
        found = average_nees(np.array([circling(seed, first_estimates=first) for seed in range(runs)]))
        axes.plot(
            np.arange(len(found.average)) / 40.0,
            found.average,
            color=shade,
            label=f"{name}: {found.mean:.1f} on average",
        )
    axes.set(xlabel="laps", ylabel="NEES of the pose", ylim=(0.0, None))
    axes.legend(loc="upper left")
    return figure


@styled
def figure_nis() -> Figure:
    """NIS of each correction of the drive, per degree of freedom, and its bounds."""
    result = driven()
    used = result.nis_dof > 0
    low, high = chi_square_bounds(result.nis_dof[used])
    figure = Figure(figsize=(7.4, 2.6), layout="constrained")
    axes = figure.subplots()
    dof = result.nis_dof[used]
    axes.fill_between(result.stamps[used], low / dof, high / dof, color="#e4ece7", linewidth=0.0, label="95 % bounds")
    axes.plot(
        result.stamps[used], result.nis[used] / dof, ".", color=BLUE, markersize=3, label="NIS / degrees of freedom"
    )
    axes.axhline(1.0, color=GREY, linewidth=0.9)
    axes.set(xlabel="time (s)", ylabel="NIS per degree", ylim=(0.0, 4.0))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure
