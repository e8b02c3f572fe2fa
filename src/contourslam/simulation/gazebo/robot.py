"""The paper's robot as an SDF model: two wheels and a caster, a lidar, wheel odometry, and its true pose."""

import math

from contourslam.simulation.config import LidarModel, RobotModel
from contourslam.simulation.gazebo.sdf import (
    Element,
    add,
    add_colour,
    add_cylinder,
    add_friction,
    add_inertia,
    add_pose,
    add_sphere,
    add_system,
)

NAME = "robot"
BASE, LIDAR = "base_link", "lidar_link"
SCAN_TOPIC, ODOMETRY_TOPIC, COMMAND_TOPIC, TRUTH_TOPIC, TF_TOPIC = "scan", "odom", "cmd_vel", "ground_truth", "tf"
ODOMETRY_RATE = 50  # Hz
_WHEEL_MASS, _WHEEL_WIDTH = 0.1, 0.03  # kg, m
_WHEEL_FRICTION, _CASTER_FRICTION = 0.8, 0.1  # as in the MuJoCo robot: the caster drags a little
_CASTER_RADIUS, _CASTER_X = 0.02, -0.13  # m
_DARK, _BLUE, _BLACK = (0.16, 0.17, 0.20), (0.10, 0.35, 0.70), (0.08, 0.08, 0.08)


def add_robot(world: Element, robot: RobotModel, lidar: LidarModel, start: tuple[float, float, float]) -> None:
    """Add the robot to a world.

    Its frame ``base_link`` lies on the floor under the middle of the axle, x ahead; ``lidar_link`` is the lidar's.

    Parameters
    ----------
    world : Element
    robot : RobotModel
    lidar : LidarModel
        Gazebo takes all beams of a turn at once and knows no drop-outs: turn-rate wobble and losses are left out.
    start : tuple of float
        Pose of the base in the world: x, y, m, heading, degrees.
    """
    model = add(world, "model", name=NAME)
    x, y, yaw_deg = start
    add_pose(model, x, y, 0.0, yaw_deg=yaw_deg)
    _add_base(model, robot, lidar)
    _add_lidar(model, lidar)
    for name, side in (("left", 1.0), ("right", -1.0)):
        _add_wheel(model, robot, name, side)
    _add_drive(model, robot)
    _add_truth(model)


def _add_base(model: Element, robot: RobotModel, lidar: LidarModel) -> None:
    base = add(model, "link", name=BASE)
    inertia = robot.mass * robot.body_radius**2
    # The load sits behind the axle, as in the MuJoCo robot, so that the caster stays down.
    add_inertia(base, robot.mass, [inertia / 3, inertia / 3, inertia / 2], [-0.035, 0.0, robot.wheel_radius + 0.01])
    body = (0.0, robot.wheel_radius + 0.03, robot.body_radius, 0.07)
    _add_drum(base, "body", *body)
    collision = add(base, "collision", name="body_collision")
    add_pose(collision, body[0], 0.0, body[1])
    add_cylinder(collision, *body[2:])
    foot, head = body[1] + body[3] / 2, lidar.mount_height - 0.02
    if head > foot:
        _add_drum(base, "mast", lidar.mount_x, (foot + head) / 2, 0.02, head - foot)
    collision = add(base, "collision", name="caster_collision")
    add_pose(collision, _CASTER_X, 0.0, _CASTER_RADIUS)
    add_sphere(collision, _CASTER_RADIUS)
    add_friction(collision, _CASTER_FRICTION)
    visual = add(base, "visual", name="caster_visual")
    add_pose(visual, _CASTER_X, 0.0, _CASTER_RADIUS)
    add_sphere(visual, _CASTER_RADIUS)
    add_colour(visual, _BLACK)


def _add_drum(link: Element, name: str, x: float, z: float, radius: float, height: float) -> None:
    visual = add(link, "visual", name=f"{name}_visual")
    add_pose(visual, x, 0.0, z)
    add_cylinder(visual, radius, height)
    add_colour(visual, _DARK)


def _add_lidar(model: Element, lidar: LidarModel) -> None:
    link = add(model, "link", name=LIDAR)
    add_pose(link, lidar.mount_x, 0.0, lidar.mount_height)
    add_inertia(link, 0.1, [1e-4, 1e-4, 1e-4])
    visual = add(link, "visual", name="lidar_visual")
    add_cylinder(visual, 0.035, 0.04)  # nearer than the shortest range: the lidar does not see itself
    add_colour(visual, _BLUE)
    _add_joint(model, "lidar_joint", "fixed", LIDAR)

    sensor = add(link, "sensor", name="lidar", type="gpu_lidar")
    add(sensor, "topic", SCAN_TOPIC)
    add(sensor, "gz_frame_id", LIDAR)
    add(sensor, "update_rate", lidar.turn_rate)
    add(sensor, "always_on", True)
    rays = add(sensor, "lidar")
    horizontal = add(add(rays, "scan"), "horizontal")
    beams = round(lidar.samples_per_second / lidar.turn_rate)
    add(horizontal, "samples", beams)
    add(horizontal, "resolution", 1.0)
    add(horizontal, "min_angle", -math.pi)
    add(horizontal, "max_angle", math.pi - 2.0 * math.pi / beams)  # no direction twice
    reach = add(rays, "range")
    add(reach, "min", lidar.range_min)
    add(reach, "max", lidar.range_max)
    add(reach, "resolution", 0.001)
    noise = add(rays, "noise")
    add(noise, "type", "gaussian")
    add(noise, "mean", 0.0)
    add(noise, "stddev", lidar.sigma_range)


def _add_wheel(model: Element, robot: RobotModel, name: str, side: float) -> None:
    link, radius = add(model, "link", name=f"{name}_wheel"), robot.wheel_radius
    add_pose(link, 0.0, side * robot.wheel_base / 2, radius)
    across = _WHEEL_MASS * (3 * radius**2 + _WHEEL_WIDTH**2) / 12
    add_inertia(link, _WHEEL_MASS, [across, _WHEEL_MASS * radius**2 / 2, across])
    visual = add(link, "visual", name="wheel_visual")
    add_pose(visual, 0.0, 0.0, 0.0, roll=math.pi / 2)
    add_cylinder(visual, radius, _WHEEL_WIDTH)
    add_colour(visual, _BLACK)
    # A sphere touches the floor in one point, which a flat tyre would not: the wheel base is then known.
    collision = add(link, "collision", name="wheel_collision")
    add_sphere(collision, radius)
    add_friction(collision, _WHEEL_FRICTION)
    axis = add(_add_joint(model, f"{name}_wheel_joint", "revolute", f"{name}_wheel"), "axis")
    add(axis, "xyz", [0, 1, 0])
    limit = add(axis, "limit")
    add(limit, "lower", "-inf")
    add(limit, "upper", "inf")


def _add_joint(model: Element, name: str, kind: str, child: str) -> Element:
    joint = add(model, "joint", name=name, type=kind)
    add(joint, "parent", BASE)
    add(joint, "child", child)
    return joint


def _add_drive(model: Element, robot: RobotModel) -> None:
    drive = add_system(model, "DiffDrive")
    add(drive, "left_joint", "left_wheel_joint")
    add(drive, "right_joint", "right_wheel_joint")
    add(drive, "wheel_separation", robot.wheel_base)
    add(drive, "wheel_radius", robot.wheel_radius)
    add(drive, "max_linear_acceleration", 1.0)
    add(drive, "max_angular_acceleration", 4.0)
    add(drive, "topic", COMMAND_TOPIC)
    add(drive, "odom_topic", ODOMETRY_TOPIC)
    add(drive, "tf_topic", TF_TOPIC)
    add(drive, "frame_id", "odom")
    add(drive, "child_frame_id", BASE)
    add(drive, "odom_publish_frequency", ODOMETRY_RATE)


def _add_truth(model: Element) -> None:
    truth = add_system(model, "OdometryPublisher")
    add(truth, "odom_topic", TRUTH_TOPIC)
    add(truth, "tf_topic", f"{TRUTH_TOPIC}/tf")  # apart: no second parent for the base in /tf
    add(truth, "odom_frame", "world")
    add(truth, "robot_base_frame", BASE)
    add(truth, "dimensions", 2)
    add(truth, "odom_publish_frequency", ODOMETRY_RATE)
