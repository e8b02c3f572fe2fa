"""Contour matching as the filter's odometry: without it all is as before, with it wheels may lie or stop."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, SlamConfig
from contourslam.evaluation.consistency import nees
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose
from contourslam.matching.odometry import ContourOdometry
from contourslam.replay import replay
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.slam import ContourSlam, ScanUpdate
from contourslam.slam.motion import predict
from contourslam.slam.observation import Observations, loosened
from contourslam.slam.slam import INDEPENDENT, LOOK_EVERY

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose
Drive = Callable[..., list[Message]]

WHEELS = Config(slam=SlamConfig(walls=True))
CONTOURS = Config(slam=SlamConfig(walls=True, contour_matching=True))


def run(
    messages: list[Message], mount: Floats, config: Config = CONTOURS
) -> tuple[ContourSlam, list[ScanUpdate], Floats]:
    """Filter, what it said of each scan, and its errors."""
    truth = np.array([m.pose for m in messages if isinstance(m, TruePose)])
    slam, updates = ContourSlam(config, initial_pose=truth[0], lidar_mount=mount), []
    for message in messages:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            updates.append(slam.push_scan(message))
    errors = np.array([u.pose for u in updates]) - truth
    errors[:, 2] = wrap(errors[:, 2])
    return slam, updates, errors


def with_wheels(messages: list[Message], change: Callable[[int, Floats], Floats | None]) -> list[Message]:
    """The recording with other odometry poses, or without some of them."""
    out: list[Message] = []
    count = -1
    for message in messages:
        if isinstance(message, Odometry):
            count += 1
            pose = change(count, message.pose)
            if pose is not None:
                out.append(Odometry(message.stamp, pose))
        else:
            out.append(message)
    return out


def test_it_is_off_by_default_and_then_no_contour_is_matched(
    drive: Drive, mount: Floats, monkeypatch: pytest.MonkeyPatch
) -> None:
    def push(*_: object) -> None:
        raise AssertionError("contours were matched")

    monkeypatch.setattr(ContourOdometry, "push", push)
    _, updates, _ = run(drive(20), mount, WHEELS)
    assert all(u.quality is None for u in updates)
    assert not SlamConfig().contour_matching


def test_wheels_predict_to_the_last_bit_as_before_covariances_had_cross_terms() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        pose, increment, p = rng.normal(size=3), rng.normal(size=3), rng.normal(size=(3, 3))
        noise = np.diag(rng.uniform(1e-6, 0.1, 3))
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        mean, covariance = pose.copy(), p @ p.T
        old = covariance.copy()
        predict(mean, covariance, 3, increment, noise, pose)
        gx, gy = -(mean[1] - pose[1]), mean[0] - pose[0]
        tx, ty, tt = old[2]
        expected = [
            old[0, 0] + 2.0 * gx * tx + gx * gx * tt + (cos * cos * noise[0, 0] + sin * sin * noise[1, 1]),
            old[1, 0] + gx * ty + gy * tx + gx * gy * tt + cos * sin * (noise[0, 0] - noise[1, 1]),
            old[1, 1] + 2.0 * gy * ty + gy * gy * tt + (sin * sin * noise[0, 0] + cos * cos * noise[1, 1]),
            tx + gx * tt,
            ty + gy * tt,
            tt + noise[2, 2],
        ]
        assert covariance[np.tril_indices(3)].tolist() == expected


def test_noise_with_cross_terms_grows_the_covariance_as_its_samples_scatter() -> None:
    rng = np.random.default_rng(4)
    root = rng.normal(size=(3, 3)) * 0.01
    pose, increment = np.array([1.0, -2.0, 2.5]), np.array([0.3, 0.05, 0.2])
    covariance, mean = np.zeros((3, 3)), pose.copy()
    predict(mean, covariance, 3, increment, root @ root.T, pose)
    samples = compose(pose, increment + rng.normal(size=(200_000, 3)) @ root.T)
    full = covariance + np.tril(covariance, -1).T
    np.testing.assert_allclose(full, np.cov(samples.T), atol=0.02 * np.trace(full))


def test_the_pose_follows_the_truth_closer_than_with_the_wheels_and_says_how_well_it_knows(
    drive: Drive, mount: Floats
) -> None:
    messages = drive(160)
    _, updates, errors = run(messages, mount)
    _, _, wheels = run(messages, mount, WHEELS)
    rms, before = np.sqrt(np.mean(errors**2, axis=0)), np.sqrt(np.mean(wheels**2, axis=0))
    assert (rms < [0.010, 0.010, 0.003]).all(), rms
    assert (rms < 1.2 * before).all(), (rms, before)
    assert nees(errors[20:], np.array([u.covariance for u in updates[20:]])).mean() < 3.0


def test_without_any_wheels_the_robot_is_still_tracked(drive: Drive, mount: Floats) -> None:
    _, _, errors = run(with_wheels(drive(160), lambda i, pose: None), mount)
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.03
    assert np.abs(errors[:, 2]).max() < 0.01


def test_wheels_that_fall_silent_midway_are_not_missed(drive: Drive, mount: Floats) -> None:
    _, _, errors = run(with_wheels(drive(160), lambda i, pose: pose if i < 60 else None), mount)
    off = np.hypot(errors[:, 0], errors[:, 1])
    assert off.max() < 0.06  # for half a second they may only be late, and what they say is that the robot stands
    assert off[70:].max() < 0.01


def test_a_slip_of_the_wheels_is_survived(drive: Drive, mount: Floats) -> None:
    messages = drive(120)
    at = [m.pose for m in messages if isinstance(m, Odometry)][70]
    spun = compose(at, np.array([0.3, 0.0, 0.0]))  # 0.3 m that did not happen

    def slip(i: int, pose: Floats) -> Floats:
        return pose if i < 70 else compose(spun, between(at, pose))

    slam, _, errors = run(with_wheels(messages, slip), mount)
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.04
    assert np.abs(errors[:, 2]).max() < 0.015
    # The room was not mapped twice.
    edges = np.linalg.norm(slam.corner_map().positions - [1.2, -0.4], axis=1)
    assert np.count_nonzero(edges < 0.5) == 1


@pytest.mark.parametrize("config", [CONTOURS, replace(CONTOURS, slam=replace(CONTOURS.slam, first_estimates=False))])
def test_the_covariance_stays_positive_definite(
    drive: Drive, mount: Floats, full: Callable[..., Floats], config: Config
) -> None:
    slam, updates, _ = run(drive(160, standing_from=100), mount, config)
    assert np.linalg.eigvalsh(full(slam.filter)).min() > 0.0
    for update in updates:
        np.testing.assert_array_equal(update.covariance, update.covariance.T)
        assert np.linalg.eigvalsh(update.covariance).min() > 0.0


def test_standing_still_teaches_nothing_new(drive: Drive, mount: Floats) -> None:
    _, updates, _ = run(drive(200, standing_from=60), mount)
    first, last = (np.linalg.det(updates[i].covariance) for i in (70, 199))
    assert last > 0.5 * first  # looks that err alike do not average out, with the wheels they would a hundredfold


def test_the_quality_of_each_fit_is_reported_and_falls_where_nothing_fits(drive: Drive, mount: Floats) -> None:
    messages, blind = drive(60), []
    scans = 0
    for message in messages:
        scans += isinstance(message, LaserScan)
        if isinstance(message, LaserScan) and scans > 50:
            message = replace(message, ranges=np.full(message.ranges.size, math.nan))
        blind.append(message)
    result = replay(blind, CONTOURS, lidar_mount=mount)
    assert result.quality is not None
    assert result.quality.shape == (60,)
    assert result.quality[1:50].min() > 0.8
    assert (result.quality[50:] == 0.0).all()


def test_landmarks_are_looked_for_as_the_robot_moves_on(drive: Drive, mount: Floats) -> None:
    _, updates, _ = run(drive(120, standing_from=60), mount)
    looked = np.array([u.corners + u.walls > 0 for u in updates])
    steps = 0.06 * (1.0 + 0.8)  # arc and turn
    assert looked[:60].sum() == pytest.approx(60 * steps / LOOK_EVERY, rel=0.7)
    assert looked[62:].sum() <= 1
    assert INDEPENDENT > LOOK_EVERY


def test_the_jitter_of_a_pose_loosens_angles_and_distances_of_corners_and_walls(
    see: Callable[..., Observations], corners_at: Callable[..., object], walls_at: Callable[..., object]
) -> None:
    seen = see(corners_at([[2.0, 1.0]]), walls_at([[[1.0, -1.0], [1.0, 1.0]]]))
    more = loosened(seen).noises - seen.noises
    np.testing.assert_allclose(more[0], np.diag([0.003**2, math.radians(0.1) ** 2]), atol=1e-12)
    np.testing.assert_allclose(more[1], np.diag([math.radians(0.1) ** 2, 0.003**2]), atol=1e-12)
