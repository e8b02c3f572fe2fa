# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
#   # ruff: noqa: B018, D100, E402, T201
# ---

# %% [markdown]
# # From a scan to a map
#
# A lidar turns and measures how far the walls are. Out of such scans, and the counts of its wheels, a robot can draw
# a map of the building and say where in it it stands. This notebook goes that way step by step: one scan, its
# contours, the corners in them, the map, and whether the map can be believed.
#
# It needs `pip install '.[simulation,report]'` in a clone of the repository, and nothing else: the recording is made
# here.
#
# ## A recording
#
# A robot drives for half a minute through a furnished room. The lidar measures while it moves, with 1 cm of noise;
# the wheels slip a little. The recording is a rosbag 2, as a real robot would write it.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from contourslam.recordings import open_recording, write_recording
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import simulate

drive = simulate(ROOMS["furnished_room"], SimulationConfig(duration=30.0), seed=2)
path = Path(tempfile.mkdtemp()) / "drive"
write_recording(path, drive.messages(), lidar_mount=tuple(drive.lidar_mount.tolist()))

recording = open_recording(path)
recording

# %% [markdown]
# Results show themselves. For a recording of your own, give its path to `open_recording`: a rosbag 1, a rosbag 2 or a
# CARMEN log.
#
# ## One scan
#
# A recording is read message by message. A scan is two arrays above all: `angles` and `ranges`.

# %%
from contourslam.scan import LaserScan

scans = [message for message in recording.messages() if isinstance(message, LaserScan)]
scan = scans[70]
scan

# %% [markdown]
# ## Contours
#
# Neighbouring points belong to one surface, until the range leaps: there the scan is cut into *contours*. Their
# points lie densely where a wall is near and thinly where it is far, so a contour is *equalized*: laid out anew in
# steps of one length. What a detector then sees is a chain of equal vectors, and a corner is a place where the chain
# turns.

# %%
from contourslam.config import Config
from contourslam.contour import equalize
from contourslam.landmarks import trace

config = Config()
contours = trace(scan, config)
curve = equalize(contours, config.contour.spacing)
print(f"{len(contours.points)} points measured, {len(curve.points)} after the equalization")
contours

# %% [markdown]
# ## Four detectors
#
# A detector gives each point of the curve a *response*: how much it looks like a corner. The four ask in different
# ways.
#
# - **matched filter**: how well do two straight sides with an angle between them fit here?
# - **Teh and Chin**: how sharp is the angle between the chords to either side, whose length the curve itself decides?
# - **Wu**: the same, as a mean over chords of several lengths, up to the one where the angle is sharpest.
# - **curvature scale space**: how strongly is the smoothed curve bent, where it is bent most?
#
# A point is a *candidate* where its response reaches the detector's threshold and is the largest around. All of that
# is NumPy: a response is an array, one number a point.

# %%
from contourslam.detectors import DETECTORS, make_detector
from contourslam.landmarks import find_landmarks

shape = {"figsize": (11, 15), "width_ratios": [1.0, 1.2], "layout": "constrained"}
figure, axes = plt.subplots(len(DETECTORS), 2, **shape)
for (left, right), name in zip(axes, DETECTORS, strict=True):
    detector = make_detector(name)
    seen = find_landmarks(contours, detector, config)
    share = seen.response / detector.threshold

    left.scatter(*seen.curve.points.T, c=share, s=5, cmap="plasma", vmin=0.0, vmax=1.2)
    left.plot(*seen.corners.positions.T, "o", markersize=10, markerfacecolor="none", color="C2")
    left.plot(0.0, 0.0, "k^")
    left.set(aspect="equal", title=f"{name}: {len(seen.corners)} corners", ylabel="y (m)")

    right.semilogy(share, linewidth=0.9)
    right.plot(seen.candidates, share[seen.candidates], "o", color="C3", markersize=5)
    right.axhline(1.0, color="grey", linestyle="--", linewidth=0.9)
    right.set(ylabel="response / threshold", ylim=(0.02, 50.0))
left.set_xlabel("x (m)")
right.set_xlabel("point along the contours")
plt.show()

# %% [markdown]
# On the left the response colours the curve, and a ring is a corner that stayed; on the right the same response along
# the curve, with its candidates. Between a candidate and a corner lies the *refinement*: a line is fitted to either
# side, and the corner is where they meet, with a covariance that follows from the noise of the ranges. A candidate
# whose sides are not straight, such as a chair's leg, is dropped there.

# %%
seen = find_landmarks(contours, make_detector("matched_filter"), config)
corners = seen.corners
rows = zip(corners.positions, corners.covariances, corners.convex, strict=True)
for (x, y), covariance, convex in rows:
    least, most = 1e3 * np.sqrt(np.linalg.eigvalsh(covariance))
    kind = "convex " if convex else "concave"
    print(f"{kind} corner at {x:5.2f} {y:5.2f} m, σ {least:.1f} by {most:.1f} mm")
seen

# %% [markdown]
# Whoever has two arrays and wants corners, and nothing of the rest, asks for them so:

# %%
from contourslam.landmarks import find_corners

positions, beams = find_corners(scan.ranges, scan.angles)
beams, positions.round(3)

# %% [markdown]
# ## A map
#
# `replay` maps the whole recording: each scan moves the robot by what its wheels say, looks for the corners and walls
# that are known already, and corrects the robot and all of them by where they were seen. This is the paper's extended
# Kalman filter, with walls beside the corners.

# %%
from contourslam.config import SlamConfig
from contourslam.replay import replay

filter_config = Config(back_end="ekf", slam=SlamConfig(walls=True))
result = replay(recording.messages(), filter_config, lidar_mount=recording.lidar_mount)
result

# %% [markdown]
# The wheels alone drift away from the truth. The map holds the robot.
#
# ## How far is it off, and does it know?
#
# In a simulation the truth is known. Two questions then, and the second is the harder one: how large is the *error*,
# and is it as large as the filter *says*? The filter states a covariance with each pose; an honest one is wrong by
# more than 2σ in one scan out of twenty, and no oftener.

# %%
from contourslam.geometry.angles import wrap


def errors_of(run):
    """Error of each pose: x, y (m) and heading (rad)."""
    off = run.poses - run.truth
    off[:, 2] = wrap(off[:, 2])
    return off


def draw_errors(run):
    """Draw the errors over time, inside the bounds that the filter states."""
    sigmas = np.sqrt(np.diagonal(run.covariances, axis1=1, axis2=2))
    units = {"x (mm)": 1e3, "y (mm)": 1e3, "heading (°)": np.degrees(1.0)}
    _, axes = plt.subplots(3, 1, figsize=(9, 6), sharex=True, layout="constrained")
    for column, (axis, (label, unit)) in enumerate(zip(axes, units.items(), strict=True)):
        bound = 2.0 * unit * sigmas[:, column]
        axis.fill_between(run.stamps, -bound, bound, alpha=0.2, label="2σ, as stated")
        axis.plot(run.stamps, unit * errors_of(run)[:, column], label="error")
        axis.set_ylabel(label)
    axes[0].legend(loc="upper left", ncols=2)
    axes[-1].set_xlabel("time (s)")
    plt.show()


draw_errors(result)

# %% [markdown]
# The errors are a few millimetres. The bounds are ten times as wide: this filter knows its place far better than it
# says. It has been told nothing of this robot and expects wheels as bad as those of the worst robot it may meet. Our
# robot has a data sheet. Told what stands in it, the same filter maps the same recording again.

# %%
from contourslam.experiments.known_room import told

informed_config = told(filter_config, drive.lidar)
informed = replay(recording.messages(), informed_config, lidar_mount=recording.lidar_mount)
draw_errors(informed)

# %% [markdown]
# All three coordinates at once are weighed by the *normalised estimation error squared*, NEES: eᵀ P⁻¹ e, with the
# error e and the stated covariance P. For an honest filter it is χ² distributed with three degrees of freedom, so its
# mean is 3. Far above, the filter believes itself too much; far below, it could have said more. One drive is one
# sample, and its errors go together from scan to scan: a verdict needs many drives (`contourslam compare --seeds
# 10`).

# %%
from contourslam.evaluation.consistency import average_nees, nees

figure, axis = plt.subplots(figsize=(9, 3.4), layout="constrained")
for name, run in {"told nothing": result, "told of its wheels": informed}.items():
    values = nees(errors_of(run), run.covariances)
    honest = average_nees(values[None])
    axis.semilogy(run.stamps, values, linewidth=0.9, label=f"{name}: mean {honest.mean:.2f}")
axis.axhspan(honest.lower, honest.upper, color="C2", alpha=0.15, label="95 % if honest")
axis.axhline(3.0, color="C2", linewidth=0.9)
axis.set(xlabel="time (s)", ylabel="NEES", ylim=(1e-3, 50.0))
axis.legend(loc="lower right", ncols=3)
plt.show()

# %% [markdown]
# ## The map in the room
#
# The true room is known as well, at the height of the lidar. Grey is what stands there; black and red is what was
# mapped. With every corner comes its 3σ ellipse, fifty times enlarged, for at true size none could be seen.

# %%
from matplotlib.collections import LineCollection
from matplotlib.patches import Ellipse

corners = informed.corner_map
figure, axis = plt.subplots(figsize=(8.5, 7), layout="constrained")
room = drive.room.segments(drive.lidar.mount_height)
axis.add_collection(LineCollection(room, colors="silver", linewidths=5))
axis.add_collection(LineCollection(informed.wall_map.end_points, colors="black", linewidths=1.4))
for position, covariance in zip(corners.positions, corners.covariances, strict=True):
    variances, directions = np.linalg.eigh(covariance)
    width, height = 50.0 * 2.0 * 3.0 * np.sqrt(variances)
    turn = np.degrees(np.arctan2(directions[1, 0], directions[0, 0]))
    axis.add_patch(Ellipse(position, width, height, angle=turn, color="C3", alpha=0.2))
axis.plot(*corners.positions.T, "s", color="C3", markersize=4, label="corners")
axis.plot(*informed.truth[:, :2].T, color="C2", linewidth=5, alpha=0.4, label="true way")
axis.plot(*informed.poses[:, :2].T, color="C0", linewidth=1.2, label="estimated way")
axis.plot(*informed.odometry[:, :2].T, "--", color="C1", linewidth=1.0, label="wheels alone")
axis.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
plt.show()

off = np.hypot(*errors_of(informed)[:, :2].T)
wheels = np.hypot(*(informed.odometry - informed.truth)[:, :2].T)
print(f"RMS error of the position: {1e3 * np.sqrt(np.mean(off**2)):.1f} mm")
print(f"of the wheels alone: {1e3 * np.sqrt(np.mean(wheels**2)):.1f} mm")

# %% [markdown]
# ## Further on
#
# - Another detector: `replay(recording.messages(), Config(detector="wu", slam=SlamConfig(walls=True)))`. Is it worse
#   here, and would you have expected it from the responses above?
# - A detector of your own is a class with two methods: [how to](how_to/own_detector.md).
# - Large buildings and loops: `Config(back_end="graph")`, with the extra `graph`: [how it works](graph.md).
# - The same from the command line, with a report: [the tutorial](tutorial.md).
