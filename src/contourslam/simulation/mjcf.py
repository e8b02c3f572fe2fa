"""Writing MuJoCo's XML, and importing MuJoCo itself."""

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

from contourslam.errors import MissingExtraError

Element = ElementTree.Element


def import_mujoco() -> Any:
    """Import MuJoCo, or say which extra brings it."""
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtraError("the simulation needs MuJoCo: pip install 'contourslam[simulation]'") from error
    return mujoco


def add(parent: Element, tag: str, **attributes: str | float | Sequence[float]) -> Element:
    """Add an element; numbers and vectors are written with every digit they have."""
    return ElementTree.SubElement(parent, tag, {name: _text(value) for name, value in attributes.items()})


def _text(value: str | float | Sequence[float]) -> str:
    if isinstance(value, str):
        return value
    numbers = [value] if isinstance(value, int | float) else value
    return " ".join(repr(float(number)) for number in numbers)
