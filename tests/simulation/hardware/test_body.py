"""What the physics of the live world must keep to, without any board or port."""

import math
from dataclasses import replace

import numpy as np
import pytest

from contourslam.geometry.poses import interpolate
from contourslam.robot.lidar.x4_packets import correction_deg
from contourslam.robot.lidar.x4_turns import TurnAssembler
from contourslam.simulation.config import YDLIDAR_X4, RobotModel
from contourslam.simulation.hardware.body import Body, Motor
from contourslam.simulation.hardware.imu import Imu
from contourslam.simulation.hardware.sight import Sight
from contourslam.simulation.hardware.x4 import X4
from contourslam.simulation.room import Room
from contourslam.simulation.rooms import ROOMS

ROOM, ROBOT = ROOMS["furnished_room"], RobotModel()
HALL = Room("hall", "", ((-20, -20), (20, -20), (20, 20), (-20, 20)), (), ((0, 0), (5, 0), (5, 5)))


def driven(duty: tuple[float, float], seconds: float, motor: Motor | None = None) -> Body:
    body = Body(HALL, ROBOT, motor or Motor(), 1)
    for _ in range(round(seconds / 0.002)):
        body.step(duty)
    return body


def test_a_motor_has_its_two_speeds_and_all_between() -> None:
    motor = Motor(0.6, 16.0)
    assert motor.torque(1.0, 0.0) == 0.6
    assert motor.torque(1.0, 16.0) == 0.0
    assert motor.torque(-0.5, 0.0) == -0.3
    assert motor.torque(0.5, 8.0) == 0.0


def test_the_wheels_settle_where_torque_and_load_are_equal() -> None:
    body = driven((0.5, 0.5), 2.0)
    _, speeds = body.wheels()
    assert speeds.min() > 0.7 * 8.0 and speeds.max() < 8.0  # below the no-load speed by what the caster drags
    strong = driven((0.5, 0.5), 2.0, Motor(6.0, 16.0)).wheels()[1]
    lag, strong_lag = 8.0 - speeds, 8.0 - strong
    assert strong_lag == pytest.approx(lag / 10.0, rel=0.35)  # the same load takes a tenth of the speed


def test_without_duty_the_motors_brake() -> None:
    body = driven((0.5, 0.5), 1.0)
    for _ in range(1000):
        body.step((0.0, 0.0))
    assert np.abs(body.wheels()[1]).max() < 0.02


def test_ticks_are_the_wheels_angles() -> None:
    body = driven((0.6, -0.4), 1.5)
    angles, _ = body.wheels()
    wanted = np.floor(angles / (2.0 * math.pi) * ROBOT.ticks_per_turn)
    assert body.ticks() == tuple(wanted.astype(int).tolist())
    assert body.ticks()[0] > 1000 and body.ticks()[1] < -500


def test_the_gyroscope_is_the_rate_of_the_heading_and_gravity_is_up() -> None:
    body = driven((0.2, 0.4), 1.0)
    rates, forces, headings = [], [], []
    for _ in range(500):
        body.step((0.2, 0.4))
        turn, force = body.felt()
        rates.append(turn[2])
        forces.append(force)
        headings.append(body.now.pose[2])
    assert np.trapezoid(rates, dx=0.002) == pytest.approx(np.unwrap(headings)[-1] - headings[0], abs=2e-3)
    assert np.mean(forces, axis=0)[2] == pytest.approx(9.81, abs=0.05)
    # In a curve to the left the force is to the left: speed by turn rate.
    speed = np.mean(body.wheels()[1]) * ROBOT.wheel_radius
    assert np.mean(forces, axis=0)[1] == pytest.approx(speed * np.mean(rates), rel=0.15, abs=0.02)


def test_the_imu_has_bias_noise_and_the_units_of_the_protocol() -> None:
    imu, still, axes = Imu(5), np.zeros(3), np.eye(3)
    read = np.array([imu.read(still, np.array([0.0, 0.0, 9.81]), axes) for _ in range(2000)])
    assert read[:, :3].mean(axis=0) / 4096 == pytest.approx(imu.bias, abs=5e-4)
    assert 2.0 < read[:, 2].std() < 12.0
    assert read[:, 5].mean() == pytest.approx(9810, abs=250)
    field = np.linalg.norm(read[:, 6:].mean(axis=0)) / 10.0
    assert 30.0 < field < 70.0  # microtesla
    turning = np.array([imu.read(np.array([0.0, 0.0, 1.0]), still, axes) for _ in range(200)])[100:, 2]
    assert turning.mean() / 4096 - imu.bias[2] == pytest.approx(1.0, rel=0.01)


def test_the_laser_beside_the_axis_is_what_the_makers_correction_undoes() -> None:
    body = Body(HALL, ROBOT, Motor(), 1)
    body.step((0.0, 0.0))
    sight = Sight(HALL, replace(YDLIDAR_X4, mount_x=0.0), body, 1)
    degrees = np.linspace(0.0, 359.0, 400)
    ranges, _ = sight.true_ranges(np.zeros(400), degrees)
    x, y, heading = body.now.pose
    bearing = heading - np.radians(degrees + correction_deg(1000.0 * ranges))
    seen = np.stack([x + ranges * np.cos(bearing), y + ranges * np.sin(bearing)])
    assert np.abs(np.abs(seen).max(axis=0) - 20.0).max() < 0.003  # all on the walls of the hall


def test_a_turn_on_a_moving_robot_fits_the_room_once_its_motion_is_undone() -> None:
    """The X4's bytes through the driver's own assembler: every beam from where the robot was at its time."""
    exact = replace(YDLIDAR_X4, sigma_range=0.0, sigma_relative=0.0, drop_rate=0.0, grazing_deg=0.0)
    body = Body(ROOM, ROBOT, Motor(), 2)
    sight = Sight(ROOM, exact, body, 2)
    lidar, assembler, truth, scans = X4(sight.measure, sight.samples), TurnAssembler(), [], []
    lidar.begin(0.0)
    for _ in range(1000):
        body.step((0.15, 0.35))
        truth.append((body.time, *body.now.pose))
        data = lidar.advance(body.time)
        scans += assembler.feed(data, body.time) if data else []
    rows, scan = np.array(truth), scans[-1]
    poses = interpolate(rows[:, 0], rows[:, 1:], scan.stamp + scan.offsets)
    assert np.ptp(poses[:, 2]) > 0.05  # else this would show nothing
    bearing = poses[:, 2] + scan.angles
    lidar_x = poses[:, 0] + exact.mount_x * np.cos(poses[:, 2])
    lidar_y = poses[:, 1] + exact.mount_x * np.sin(poses[:, 2])
    points = np.stack([lidar_x + scan.ranges * np.cos(bearing), lidar_y + scan.ranges * np.sin(bearing)], axis=1)
    sides = ROOM.segments(exact.mount_height)
    along = sides[:, 1] - sides[:, 0]
    to = points[:, None] - sides[:, 0]
    part = np.clip((to * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
    off = np.linalg.norm(to - part[:, :, None] * along, axis=2).min(axis=1)
    circles = ROOM.circles(exact.mount_height)
    round_ = np.abs(np.linalg.norm(points[:, None] - circles[:, :2], axis=2) - circles[:, 2]).min(axis=1)
    assert np.quantile(np.fmin(off, round_)[np.isfinite(scan.ranges)], 0.98) < 0.01
