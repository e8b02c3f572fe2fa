"""A room, and if wanted the robots in it, as a MuJoCo model."""

import math
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

from contourslam.simulation.mjcf import Element, add, import_mujoco
from contourslam.simulation.pieces import Box, Colour
from contourslam.simulation.robot import Standing, add_robot
from contourslam.simulation.room import Room

TIMESTEP = 0.002  # s
_WALL = 0.12  # m, thickness
_WALL_COLOUR: Colour = (0.86, 0.84, 0.79)


def compile_world(room: Room, robots: Sequence[Standing] = ()) -> Any:
    """Compile the MuJoCo model (``mujoco.MjModel``) of a room; parameters as :func:`world_xml`.

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    """
    return import_mujoco().MjModel.from_xml_string(world_xml(room, robots))


def world_xml(room: Room, robots: Sequence[Standing] = ()) -> str:
    """Describe a room in MuJoCo's XML: floor, walls and pieces, all fixed, and the robots that stand in it.

    Parameters
    ----------
    room : Room
    robots : sequence of Standing
        Their parts are named ``base``, ``left``, ``right``; where there are several, ``robot1_base`` and so on.

    Returns
    -------
    str
    """
    root = ElementTree.Element("mujoco", model=room.name)
    # A ratio below 1 softens friction against support: tyres creep under load, about half a per cent, as rubber does.
    option = add(root, "option", timestep=TIMESTEP, integrator="implicitfast", cone="elliptic", impratio=0.2)
    add(option, "flag", island="disable")
    _add_looks(root)
    world = add(root, "worldbody")
    _add_room(world, room)
    for number, standing in enumerate(robots, 1):
        add_robot(root, world, standing, f"robot{number}_" if len(robots) > 1 else "")
    return ElementTree.tostring(root, encoding="unicode")


def _add_looks(root: Element) -> None:
    visual, asset = add(root, "visual"), add(root, "asset")
    dim, white = [0.35, 0.35, 0.35], [1, 1, 1]
    add(visual, "headlight", ambient=dim, diffuse=dim, specular=[0, 0, 0])
    add(visual, "global", offwidth="1920", offheight="1200")
    add(visual, "quality", shadowsize="8192")
    add(visual, "rgba", haze=[1, 1, 1, 1])
    add(asset, "texture", type="skybox", builtin="flat", width="64", height="64", rgb1=white, rgb2=white)
    light, dark = [0.72, 0.69, 0.64], [0.68, 0.65, 0.60]
    size = {"width": "256", "height": "256"}
    add(asset, "texture", name="floor", type="2d", builtin="checker", rgb1=light, rgb2=dark, **size)
    add(asset, "material", name="floor", texture="floor", texrepeat=[1, 1], texuniform="true")


def _add_room(world: Element, room: Room) -> None:
    xs, ys = zip(*room.outline, strict=True)
    middle = ((min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2)
    half = ((max(xs) - min(xs)) / 2 + _WALL, (max(ys) - min(ys)) / 2 + _WALL)
    add(world, "geom", name="floor", type="plane", material="floor", pos=[*middle, 0], size=[*half, 0.1])
    high = 2.5 * max(room.wall_height, 0.4 * max(half))
    shine = {"directional": "true", "diffuse": "0.55 0.55 0.52", "specular": "0.1 0.1 0.1"}
    add(world, "light", pos=[*middle, high], dir=[0.35, 0.25, -1], **shine)
    for index, wall in enumerate(walls(room)):
        _add_box(world, wall, f"wall{index}")
    for index, piece in enumerate(room.pieces):
        if isinstance(piece, Box):
            _add_box(world, piece, f"piece{index}")
        else:
            at = [piece.x, piece.y, (piece.top + piece.bottom) / 2]
            size = [piece.radius, (piece.top - piece.bottom) / 2]
            add(world, "geom", name=f"piece{index}", type="cylinder", size=size, pos=at, rgba=[*piece.colour, 1])


def _add_box(world: Element, box: Box, name: str) -> None:
    size = [box.length / 2, box.width / 2, (box.top - box.bottom) / 2]
    at, turned = [box.x, box.y, (box.top + box.bottom) / 2], [0, 0, box.yaw_deg]
    add(world, "geom", name=name, type="box", size=size, pos=at, euler=turned, rgba=[*box.colour, 1])


def walls(room: Room) -> list[Box]:
    """Boxes outside the outline, one along each side of it; each box's negative y axis points outward."""
    found, count = [], len(room.outline)
    for index in range(count):
        before, start, end, after = (room.outline[(index + k) % count] for k in (-1, 0, 1, 2))
        dx, dy = end[0] - start[0], end[1] - start[1]
        length = math.hypot(dx, dy)
        ux, uy = dx / length, dy / length
        # Go round the outside of the room's corners, but never stick out of a wall's edge into free space.
        left = _WALL if _turns_left(before, start, end) else 0.0
        right = _WALL if _turns_left(start, end, after) else 0.0
        along, out = (length + right - left) / 2, _WALL / 2
        x, y = start[0] + ux * along + uy * out, start[1] + uy * along - ux * out
        yaw_deg = math.degrees(math.atan2(dy, dx))
        found.append(Box(x, y, length + left + right, _WALL, room.wall_height, yaw_deg, colour=_WALL_COLOUR))
    return found


def _turns_left(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    return (b[0] - a[0]) * (c[1] - b[1]) > (b[1] - a[1]) * (c[0] - b[0])
