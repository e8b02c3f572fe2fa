"""Writing SDF 1.9, the scene description of Gazebo: http://sdformat.org/spec?ver=1.9."""

import math
from collections.abc import Sequence
from xml.etree import ElementTree

Element = ElementTree.Element
Value = str | int | float | bool | Sequence[float]
Colour = tuple[float, float, float]


def add(parent: Element, tag: str, value: Value | None = None, **attributes: str) -> Element:
    """Add an element with its value; numbers and vectors are written with every digit they have."""
    element = ElementTree.SubElement(parent, tag, attributes)
    if value is not None:
        element.text = _text(value)
    return element


def _text(value: Value) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    numbers = [value] if isinstance(value, float) else value
    return " ".join(repr(float(number) + 0.0) for number in numbers)  # adding 0 turns -0.0 into 0.0


def add_pose(parent: Element, x: float, y: float, z: float, *, roll: float = 0.0, yaw_deg: float = 0.0) -> None:
    """Place an element in the frame of its parent: m, roll in rad, yaw in degrees."""
    add(parent, "pose", [x, y, z, roll, 0.0, math.radians(yaw_deg)])


def add_box(parent: Element, length: float, width: float, height: float) -> None:
    """Give a visual or a collision the shape of a box, m."""
    add(add(add(parent, "geometry"), "box"), "size", [length, width, height])


def add_cylinder(parent: Element, radius: float, length: float) -> None:
    """Give a visual or a collision the shape of a cylinder along z, m."""
    shape = add(add(parent, "geometry"), "cylinder")
    add(shape, "radius", radius)
    add(shape, "length", length)


def add_sphere(parent: Element, radius: float) -> None:
    """Give a visual or a collision the shape of a sphere, m."""
    add(add(add(parent, "geometry"), "sphere"), "radius", radius)


def add_plane(parent: Element, length: float, width: float) -> None:
    """Give a visual or a collision the shape of a level plane, m."""
    shape = add(add(parent, "geometry"), "plane")
    add(shape, "normal", [0, 0, 1])
    add(shape, "size", [length, width])


def add_colour(visual: Element, colour: Colour) -> None:
    """Paint a visual."""
    material = add(visual, "material")
    for kind in ("ambient", "diffuse"):
        add(material, kind, [*colour, 1.0])


def add_friction(collision: Element, coefficient: float) -> None:
    """Give a collision a friction coefficient, the same along and across."""
    ode = add(add(add(collision, "surface"), "friction"), "ode")
    add(ode, "mu", coefficient)
    add(ode, "mu2", coefficient)


def add_inertia(link: Element, mass: float, diagonal: Sequence[float], at: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
    """Give a link its mass, kg, its moments of inertia, kg m², and the place of its centre of mass in it, m."""
    inertial = add(link, "inertial")
    add_pose(inertial, *at)
    add(inertial, "mass", mass)
    inertia = add(inertial, "inertia")
    for name, moment in zip(("ixx", "iyy", "izz"), diagonal, strict=True):
        add(inertia, name, float(moment))
    for name in ("ixy", "ixz", "iyz"):
        add(inertia, name, 0.0)


def add_system(parent: Element, name: str) -> Element:
    """Load a system of Gazebo; by the names that it has since Gazebo Garden.

    Parameters
    ----------
    parent : Element
        A world or a model.
    name : str
        Its class in ``gz::sim::systems``, such as ``"DiffDrive"``.
    """
    words = "".join(f"-{letter.lower()}" if letter.isupper() else letter for letter in name)
    return add(parent, "plugin", filename=f"gz-sim{words}-system", name=f"gz::sim::systems::{name}")
