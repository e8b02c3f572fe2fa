"""Time of one filter step (predict, associate, correct) with 400 and 1,000 landmarks, 10 of them seen."""

import time

import numpy as np

from contourslam.config import SlamConfig
from contourslam.landmarks import Corners, Walls
from contourslam.slam import ekf
from contourslam.slam.association import associate
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.measurement import predict_measurements
from contourslam.slam.motion import motion_noise, predict
from contourslam.slam.observation import observe, to_world
from table import Table, publish

MOUNT = np.array([0.1, 0.0, 0.0])
SEEN, STEPS = 10, 200


def corners_at(positions: np.ndarray) -> Corners:
    """Right-angled corners at the given places, seen with 5 mm of noise."""
    k = len(positions)
    directions = np.arctan2(positions[:, 1], positions[:, 0]) + np.pi
    covariances = np.tile(2.5e-5 * np.eye(2), (k, 1, 1))
    openings, convex = np.full(k, 0.5 * np.pi), np.zeros(k, dtype=np.bool_)
    return Corners(positions, covariances, directions, openings, convex, np.ones((k, 2)), positions)


NO_WALLS = Walls(np.empty((0, 2, 2)), np.empty((0, 2)), np.empty((0, 2, 2)), np.empty((0, 2, 2, 2)))


def step_times(landmarks: int) -> np.ndarray:
    """Seconds of each step, s; the robot turns on the spot amid a grid of corners 2 m apart."""
    rng = np.random.default_rng(1)
    side = int(np.ceil(np.sqrt(landmarks + 1)))
    grid = 2.0 * (np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) - side // 2)
    places = grid[np.linalg.norm(grid, axis=1) > 0.5][:landmarks]
    f = LandmarkFilter(np.zeros(3))
    every = observe(corners_at(places - MOUNT[:2]), NO_WALLS)
    for index in range(landmarks):
        f.add(MOUNT, every, index)
    near = places[np.argsort(np.linalg.norm(places, axis=1))[:SEEN]]
    config, increment = SlamConfig(gate_probability=0.999999), np.array([0.0, 0.0, 1e-3])
    noise = motion_noise(increment, config.motion)
    times = []
    for _ in range(STEPS + 5):
        seen = observe(corners_at(near - MOUNT[:2] + rng.normal(0.0, 0.005, near.shape)), NO_WALLS)
        f.mean[:3] = 0.0  # the observations are always taken from here
        start = time.perf_counter()
        predict(f.mean, f.covariance, f.size, increment, noise, f.pose)
        model = predict_measurements(f.mean[:3], MOUNT, f.mean, f.table, f.count, config.first_estimates)
        chosen = associate(seen, to_world(f.mean[:3], MOUNT, seen.looks), f, model, config)
        matched = np.flatnonzero(chosen >= 0)
        columns = ekf.landmark_columns(chosen[matched])
        jacobian, nu, noises = ekf.stack(matched, chosen[matched], seen.values, seen.noises, f.table, *model)
        ekf.correct(f.mean, f.covariance, f.size, columns, jacobian, nu, noises)
        times.append(time.perf_counter() - start)
        if len(matched) != SEEN:
            raise SystemExit(f"only {len(matched)} of {SEEN} were matched: this is not the step to measure")
    return np.array(times[5:])


def main() -> None:
    rows = []
    for landmarks, target in ((400, 3), (1000, 15)):
        times = 1e3 * step_times(landmarks)
        rows.append([landmarks, SEEN, float(np.median(times)), float(np.quantile(times, 0.95)), target])
    publish(Table("ekf", ["landmarks", "seen", "median, ms", "95 %, ms", "target, ms"], rows))


if __name__ == "__main__":
    main()
