"""Corners and walls of one scan: a lidar stands in an L-shaped room, and all four detectors look."""

import math

import matplotlib.pyplot as plt
import numpy as np

from contourslam.config import Config
from contourslam.detectors import DETECTORS, make_detector
from contourslam.landmarks import detect
from contourslam.scan import evenly_spaced

# The room's outline, m; the lidar stands at the origin.
ROOM = np.array([[-2.0, -1.5], [4.0, -1.5], [4.0, 1.0], [1.5, 1.0], [1.5, 3.0], [-2.0, 3.0]])
BEAMS = 360


def measured_ranges() -> np.ndarray:
    """Distance to the nearest wall along each beam, with 1 cm of noise."""
    angles = -math.pi + 2.0 * math.pi * np.arange(BEAMS) / BEAMS
    beams = np.stack([np.cos(angles), np.sin(angles)], axis=-1)[:, None]
    sides = np.roll(ROOM, -1, axis=0) - ROOM
    with np.errstate(divide="ignore"):
        determinant = beams[..., 0] * sides[:, 1] - beams[..., 1] * sides[:, 0]
        ranges = (ROOM[:, 0] * sides[:, 1] - ROOM[:, 1] * sides[:, 0]) / determinant
        along = (ROOM[:, 0] * beams[..., 1] - ROOM[:, 1] * beams[..., 0]) / determinant
    ranges[(along < 0.0) | (along > 1.0) | (ranges <= 0.0)] = np.inf
    return np.asarray(ranges.min(axis=1) + np.random.default_rng(1).normal(0.0, 0.01, BEAMS))


def main() -> None:
    scan = evenly_spaced(
        0.0,
        measured_ranges(),
        angle_min=-math.pi,
        angle_increment=2.0 * math.pi / BEAMS,
        range_min=0.1,
        range_max=10.0,
    )
    _, grid = plt.subplots(2, 2, figsize=(8.0, 6.4), sharex=True, sharey=True, layout="constrained")
    for name, axes in zip(DETECTORS, grid.flat, strict=True):
        found = detect(scan, make_detector(name), Config())
        corners = found.corners
        print(f"{name}: {len(corners.positions)} corners, {len(found.walls.end_points)} walls")
        rows = zip(corners.positions, corners.covariances, corners.openings, corners.convex, strict=True)
        for (x, y), covariance, opening, convex in rows:
            sigma = 1e3 * math.sqrt(np.trace(covariance) / 2.0)
            kind = "convex" if convex else "concave"
            print(f"  at {x:6.3f} {y:6.3f} m, sigma {sigma:.1f} mm, opens {math.degrees(opening):5.1f}°, {kind}")
        axes.set(title=name.replace("_", " "), aspect="equal")
        points = axes.scatter(*found.curve.points.T, c=found.response, s=14, cmap="viridis", vmin=0.0)
        axes.scatter(*corners.positions.T, marker="s", s=140, facecolor="none", edgecolor="tab:red")
        axes.plot(0.0, 0.0, "^k")
        plt.colorbar(points, ax=axes, label="response")
    plt.show()


if __name__ == "__main__":
    main()
