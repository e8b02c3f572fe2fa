"""The simulated robot: its body, and what is a little wrong about this one copy of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.chance import FLAWS, stream
from contourslam.simulation.config import RobotModel
from contourslam.simulation.mjcf import Element, add


@dataclass(frozen=True, slots=True)
class Flaws:
    """What the driver of a real robot would not know about it.

    Attributes
    ----------
    friction : ndarray, shape (2,)
        Friction coefficient of the left and the right wheel.
    load : ndarray, shape (2,)
        Centre of mass of the body, m in the base frame.
    """

    friction: NDArray[np.float64]
    load: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Standing:
    """A robot that stands in a world.

    Attributes
    ----------
    robot : RobotModel
    flaws : Flaws
    pose : ndarray, shape (3,)
        Of the base in the world frame: x (m), y (m), heading (rad).
    """

    robot: RobotModel
    flaws: Flaws
    pose: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Drum:
    """An upright round part of the robot, m.

    Attributes
    ----------
    x : float
        Of its axis, ahead of the axle.
    z : float
        Of its middle, above the axle.
    radius, half : float
        Half of its width and of its height.
    """

    x: float
    z: float
    radius: float
    half: float


_COLOURS = ((0.16, 0.17, 0.20), (0.20, 0.20, 0.20), (0.10, 0.35, 0.70))


def drums(robot: RobotModel) -> tuple[Drum, Drum, Drum]:
    """Body, neck and lidar of the robot: what the lidars of others can see of it."""
    return (
        Drum(0.0, 0.03, robot.body_radius, 0.035),
        Drum(0.1, 0.15 - robot.wheel_radius, 0.02, 0.03),
        Drum(0.1, 0.20 - robot.wheel_radius, 0.035, 0.02),
    )


def draw_flaws(seed: int) -> Flaws:
    """Draw the flaws of the robot in one run: friction within 15 %, load about a centimetre off."""
    chance = stream(seed, FLAWS)
    return Flaws(0.8 * chance.uniform(0.85, 1.15, 2), np.array([-0.035, 0.0]) + chance.uniform(-0.01, 0.01, 2))


def add_robot(root: Element, world: Element, standing: Standing, prefix: str = "") -> None:
    """Add the robot to a world, its motors to the model.

    Parameters
    ----------
    root, world : Element
        ``mujoco`` and ``worldbody``.
    standing : Standing
    prefix : str
        Before the name of each of its parts, where there are several robots.
    """
    robot, flaws, start = standing.robot, standing.flaws, standing.pose
    radius = robot.wheel_radius
    body = add(world, "body", name=f"{prefix}base", pos=[*start[:2], radius], euler=[0, 0, np.degrees(start[2])])
    add(body, "freejoint", name=f"{prefix}base")
    inertia = robot.mass * robot.body_radius**2
    add(body, "inertial", pos=[*flaws.load, 0.01], mass=robot.mass, diaginertia=[inertia / 3, inertia / 3, inertia / 2])
    for drum, colour in zip(drums(robot), _COLOURS, strict=True):
        size = [drum.radius, drum.half]
        add(body, "geom", type="cylinder", pos=[drum.x, 0, drum.z], size=size, rgba=[*colour, 1])
    # The friction of the wheels and the caster, not the floor's, decides (priority); the caster drags a little.
    touch = {"condim": "3", "priority": "1"}
    add(body, "geom", type="sphere", size=0.02, pos=[-0.13, 0, 0.02 - radius], friction=[0.1, 0.005, 0.0001], **touch)
    found = root.find("actuator")
    motors = add(root, "actuator") if found is None else found
    for name, side, friction in zip(("left", "right"), (1, -1), flaws.friction.tolist(), strict=True):
        wheel = add(body, "body", name=f"{prefix}{name}", pos=[0, side * robot.wheel_base / 2, 0])
        add(wheel, "joint", name=f"{prefix}{name}", axis=[0, 1, 0], damping=0.002, armature=0.0005)
        # An ellipsoid touches the floor in one point, which a flat tyre would not: the wheel base is then known.
        size, grip = [radius, 0.3 * radius, radius], [friction, 0.005, 0.0001]
        add(wheel, "geom", type="ellipsoid", mass=0.1, size=size, friction=grip, rgba=[0.08, 0.08, 0.08, 1], **touch)
        add(motors, "velocity", name=f"{prefix}{name}", joint=f"{prefix}{name}", kv=0.3, forcerange=[-1, 1])
