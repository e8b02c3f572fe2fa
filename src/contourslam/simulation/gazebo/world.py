"""A room as a world of Gazebo: floor, light, walls, furniture, and the robot at the start of its way."""

import math
from xml.etree import ElementTree

from contourslam.simulation.config import LidarModel, RobotModel
from contourslam.simulation.gazebo.robot import add_robot
from contourslam.simulation.gazebo.sdf import (
    Element,
    add,
    add_box,
    add_colour,
    add_cylinder,
    add_plane,
    add_pose,
    add_system,
)
from contourslam.simulation.pieces import Box, Piece
from contourslam.simulation.room import Room
from contourslam.simulation.world import TIMESTEP, walls

VERSION = "1.9"
_MARGIN = 2.0  # m of floor beyond the walls
_FLOOR = (0.72, 0.69, 0.64)


def gazebo_world(room: Room, lidar: LidarModel, robot: RobotModel | None = None) -> str:
    """Describe a room in SDF 1.9, for Gazebo Garden and later.

    Parameters
    ----------
    room : Room
    lidar : LidarModel
        On the robot.
    robot : RobotModel, optional
        Stands at the room's start; without one the room is empty, for a robot of one's own.

    Returns
    -------
    str
        The same for the same room, whenever it is made.
    """
    root = ElementTree.Element("sdf", version=VERSION)
    world = add(root, "world", name=room.name)
    physics = add(world, "physics", name="steps", type="ignored")  # "ignored": the engine that Gazebo is started with
    add(physics, "max_step_size", TIMESTEP)
    add(physics, "real_time_factor", 1.0)
    for system in ("Physics", "UserCommands", "SceneBroadcaster"):
        add_system(world, system)
    add(add_system(world, "Sensors"), "render_engine", "ogre2")
    add(world, "gravity", [0.0, 0.0, -9.81])
    _add_light(world, room)
    _add_floor(world, room)
    _add_pieces(world, room)
    if robot is not None:
        x, y, heading = room.start.tolist()
        add_robot(world, robot, lidar, (x, y, math.degrees(heading)))
    ElementTree.indent(root)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'


def _add_light(world: Element, room: Room) -> None:
    scene = add(world, "scene")
    add(scene, "ambient", [0.45, 0.45, 0.45, 1.0])
    add(scene, "background", [0.9, 0.9, 0.9, 1.0])
    add(scene, "shadows", True)
    sun = add(world, "light", name="sun", type="directional")
    add_pose(sun, *_middle(room), 10.0 + room.wall_height)
    add(sun, "cast_shadows", True)
    add(sun, "diffuse", [0.6, 0.6, 0.58, 1.0])
    add(sun, "specular", [0.1, 0.1, 0.1, 1.0])
    add(sun, "direction", [0.35, 0.25, -1.0])


def _middle(room: Room) -> tuple[float, float]:
    xs, ys = zip(*room.outline, strict=True)
    return (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2


def _add_floor(world: Element, room: Room) -> None:
    xs, ys = zip(*room.outline, strict=True)
    model = add(world, "model", name="floor")
    add(model, "static", True)
    add_pose(model, *_middle(room), 0.0)
    link = add(model, "link", name="floor")
    for kind in ("collision", "visual"):
        part = add(link, kind, name=f"floor_{kind}")
        add_plane(part, max(xs) - min(xs) + 2 * _MARGIN, max(ys) - min(ys) + 2 * _MARGIN)
        if kind == "visual":
            add_colour(part, _FLOOR)


def _add_pieces(world: Element, room: Room) -> None:
    """All that stands still is one link, for a building has more than a thousand pieces."""
    model = add(world, "model", name="room")
    add(model, "static", True)
    link = add(model, "link", name="room")
    named = [("wall", list[Piece](walls(room))), ("piece", list(room.pieces))]
    for name, piece in ((f"{kind}{index}", piece) for kind, pieces in named for index, piece in enumerate(pieces)):
        for part in ("collision", "visual"):
            element = add(link, part, name=f"{name}_{part}")
            middle, height = (piece.top + piece.bottom) / 2, piece.top - piece.bottom
            if isinstance(piece, Box):
                add_pose(element, piece.x, piece.y, middle, yaw_deg=piece.yaw_deg)
                add_box(element, piece.length, piece.width, height)
            else:
                add_pose(element, piece.x, piece.y, middle)
                add_cylinder(element, piece.radius, height)
            if part == "visual":
                add_colour(element, piece.colour)
