"""Scans per second from raw ranges to corners and walls with covariance, at 360 beams, for each detector."""

import time
from dataclasses import replace

import numpy as np

from contourslam.config import Config
from contourslam.detectors import DETECTORS, make_detector
from contourslam.landmarks.detect import detect, find_landmarks, trace
from contourslam.scan import LaserScan, evenly_spaced
from table import Table, publish

BEAMS = 360
SCANS = 200
TURNS = 5


def furnished_scan(rng: np.random.Generator) -> LaserScan:
    """Scan of a 6 m by 5 m room with four boxes, from a random place in it, with 1 cm noise."""
    boxes = [(3.0, 2.5, 6.0, 5.0, 0.0), (2.2, 0.2, 1.0, 0.4, 0.0), (5.7, 2.6, 0.6, 1.2, 0.0), (3.6, 4.7, 1.4, 0.6, 0.0)]
    boxes.append((0.8, 2.8, 0.7, 0.6, 0.6))
    starts, ends = [], []
    for x, y, width, depth, yaw in boxes:
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        half = np.array([[-width, -depth], [width, -depth], [width, depth], [-width, depth]]) / 2.0
        corners = half @ turn.T + [x, y]
        starts.append(corners)
        ends.append(np.roll(corners, -1, axis=0))
    begin, side = np.concatenate(starts), np.concatenate(ends) - np.concatenate(starts)
    origin = np.array([rng.uniform(2.2, 3.8), rng.uniform(2.0, 3.4)])
    angles = -np.pi + 2.0 * np.pi * np.arange(BEAMS) / BEAMS
    beams = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    # beam * r = (begin - origin) + side * t, solved for r and t by Cramer's rule.
    offset = begin - origin
    determinant = beams[:, None, 0] * side[:, 1] - beams[:, None, 1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        r = (offset[:, 0] * side[:, 1] - offset[:, 1] * side[:, 0]) / determinant
        t = (offset[:, 0] * beams[:, None, 1] - offset[:, 1] * beams[:, None, 0]) / determinant
    r[(t < 0.0) | (t > 1.0) | (r <= 0.0) | ~np.isfinite(r)] = np.inf
    ranges = r.min(axis=1) + rng.normal(0.0, 0.01, BEAMS)
    increment = 2.0 * np.pi / BEAMS
    return evenly_spaced(0.0, ranges, angle_min=-np.pi, angle_increment=increment, range_min=0.1, range_max=30.0)


def main() -> None:
    rng = np.random.default_rng(1)
    scans = [furnished_scan(rng) for _ in range(SCANS)]
    rows = []
    for name in DETECTORS:
        config = replace(Config(), detector=name)
        detector = make_detector(name)
        found = [detect(scan, detector, config) for scan in scans]  # compiles the kernels
        traced = [trace(scan, config) for scan in scans]
        whole, after_contour = np.inf, np.inf
        for _ in range(TURNS):
            start = time.perf_counter()
            for scan in scans:
                detect(scan, detector, config)
            middle = time.perf_counter()
            for contours in traced:
                find_landmarks(contours, detector, config)
            whole = min(whole, middle - start)
            after_contour = min(after_contour, time.perf_counter() - middle)
        corners = float(np.mean([len(detection.corners.positions) for detection in found]))
        rows.append([name, SCANS / after_contour, SCANS / whole, corners])
    publish(
        Table(
            "detection",
            ["detector", "contour to landmarks, scans/s", "ranges to landmarks, scans/s", "corners a scan"],
            rows,
        )
    )


if __name__ == "__main__":
    main()
