"""Frozen classes of settings built from what a YAML file holds, with an error that names the place of what is wrong."""

import dataclasses
import difflib
import math
import types
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from contourslam.errors import ConfigError

T = TypeVar("T")


def build(kind: type[T], content: Any, place: str = "") -> T:
    """Build a dataclass from names and values; what is left out keeps its default.

    Parameters
    ----------
    kind : type
        A dataclass whose fields are numbers, texts, truth values, other such dataclasses, or one of these or None.
    content : object
        What the file holds there; None stands for nothing at all.
    place : str
        Where in the file, such as ``"base."``.

    Raises
    ------
    ConfigError
        If a name is unknown, a value is missing or of the wrong type, or the class itself refuses a value.
    """
    content = {} if content is None else content
    if not isinstance(content, dict):
        raise ConfigError(f"{place.rstrip('.') or 'the file'} must hold names and values, got {content!r}")
    fields = {field.name: field for field in dataclasses.fields(kind)}  # type: ignore[arg-type]  # any dataclass
    for name in content:
        if name not in fields:
            raise ConfigError(f"unknown setting {place}{name}{_nearest(str(name), list(fields))}")
    missing = [name for name, field in fields.items() if name not in content and not _has_default(field)]
    if missing:
        raise ConfigError(f"{place}{missing[0]} is missing")
    hints = get_type_hints(kind)
    return kind(**{name: _value(hints[name], value, f"{place}{name}") for name, value in content.items()})


def _has_default(field: "dataclasses.Field[Any]") -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


def _nearest(name: str, known: list[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f"; did you mean {near[0]}?" if near else f"; known here: {', '.join(known)}"


def _value(kind: Any, value: Any, place: str) -> Any:
    if get_origin(kind) in (types.UnionType, Union):
        choices = get_args(kind)
        if value is None and types.NoneType in choices:
            return None
        (kind,) = (choice for choice in choices if choice is not types.NoneType)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return build(kind, value, f"{place}.")
    if kind is float and type(value) in (int, float) and math.isfinite(value):
        return float(value)
    if kind is float or type(value) is not kind:  # not isinstance: True is an int, too
        wanted = {float: "a finite number", int: "a whole number", str: "a text", bool: "true or false"}[kind]
        raise ConfigError(f"{place} must be {wanted}, got {value!r}")
    return value
