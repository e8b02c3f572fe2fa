"""A landmark detector of one's own, without touching the package.

A detector says how much each point of a contour looks like a corner. Suppression, refinement to a corner with its
covariance, and the filter are shared. This one asks by how much the contour turns within half a metre.

    python examples/03_a_fifth_detector.py
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np

from contourslam.config import Config
from contourslam.contour import Contours
from contourslam.detectors import make_detector
from contourslam.evaluation.errors import rmse
from contourslam.experiments.known_room import told
from contourslam.landmarks import detect
from contourslam.replay import replay
from contourslam.scan import LaserScan
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import simulate


@dataclass(frozen=True)
class TurningAngle:
    """Turn of the contour between the chords before and after each point, in half turns."""

    adapted: bool = True  # whether to use adaptations to range noise; this one has none
    equalized: bool = True  # hand me contours of equal steps, not the raw points
    threshold: float = 0.2  # 36 degrees
    side: float = 0.25  # length of the two chords, m

    def reach(self, contours: Contours) -> int:
        return max(round(self.side / contours.spacing), 2)

    def respond(self, contours: Contours) -> np.ndarray:
        k = self.reach(contours)
        response = np.zeros(len(contours.points))
        for i in range(len(contours)):
            points = contours[i] @ [1.0, 1.0j]  # as complex numbers, a difference is a vector and an angle
            if len(points) > 2 * k:
                before, after = points[k:-k] - points[: -2 * k], points[2 * k :] - points[k:-k]
                start = contours.starts[i]
                response[start + k : start + len(points) - k] = np.abs(np.angle(after / before)) / np.pi
        return response


SHOWN = 200  # the scan whose picture is drawn


def main() -> None:
    run = simulate(ROOMS["furnished_room"], SimulationConfig(duration=40.0), seed=1)
    config = told(Config(), run.lidar)
    scan = [message for message in run.messages() if isinstance(message, LaserScan)][SHOWN]
    _, columns = plt.subplots(1, 2, figsize=(9.0, 4.0), sharey=True, layout="constrained")
    detectors = {"matched filter": make_detector("matched_filter"), "turning angle": TurningAngle()}
    for axes, (name, detector) in zip(columns, detectors.items(), strict=True):
        result = replay(run.messages(), config, detector, lidar_mount=run.lidar_mount)
        assert result.truth is not None
        error = rmse(result.poses, result.truth)
        print(f"{name:15s} RMSE x {error.x:.4f} m, y {error.y:.4f} m, heading {error.theta:.4f} rad", end="; ")
        print(f"{len(result.corner_map.ids)} corners")

        found = detect(scan, detector, config)
        points = axes.scatter(*found.curve.points.T, c=found.response, s=9, vmin=0.0)
        axes.scatter(*found.corners.positions.T, marker="s", s=90, facecolor="none", edgecolor="tab:red")
        axes.set(title=f"{name}, scan {SHOWN}", aspect="equal")
        plt.colorbar(points, ax=axes, label="response", shrink=0.8)
    plt.show()


if __name__ == "__main__":  # a sweep takes the detector from this file, and nothing else
    main()
