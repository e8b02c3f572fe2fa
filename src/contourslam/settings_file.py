"""Settings as YAML files: frozen classes written and read back, with an error that names the place of what is wrong."""

import dataclasses
import io
import sys
import types
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from contourslam.atomic import write_text
from contourslam.errors import ConfigError
from contourslam.nearest import perhaps, unreadable

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T")
_WANTED = {float: "a finite number", int: "a whole number", str: "a text", bool: "true or false"}


def write_settings(path: Path, settings: "DataclassInstance", *, header: str = "") -> None:
    """Write settings, whole or not at all.

    Parameters
    ----------
    path : Path
        The file to write.
    settings : dataclass
        What to write.
    header : str
        Lines that go above it as comments, such as the command.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    comments = "".join(f"# {line}\n" for line in header.splitlines())
    write_text(path, comments + settings_text(settings))


def settings_text(settings: "DataclassInstance") -> str:
    """Give settings as YAML."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # declared None, documented as bool
    buffer = io.StringIO()
    yaml.dump(dataclasses.asdict(settings), buffer)
    return buffer.getvalue()


def read_settings(path: Path, kind: type[T]) -> T:
    """Read settings; what the file leaves out keeps its default.

    Parameters
    ----------
    path : Path
        A YAML file, such as the ``config.yaml`` of a result folder.
    kind : type
        As :func:`build` takes it.

    Raises
    ------
    ConfigError
        If the file is missing or not YAML, or a name or a value in it is wrong; the message names file and place, and
        the nearest name that is known.
    """
    content = read_yaml(path)
    try:
        return build(kind, content)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def read_yaml(path: Path) -> Any:
    """Read what a YAML file holds: names, numbers and texts, nothing that could run.

    Raises
    ------
    ConfigError
        If the file is missing or not YAML.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        return YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(unreadable(path, error)) from error
    except (YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: is not valid YAML ({' '.join(str(error).split())})") from error


def build(kind: type[T], content: Any, place: str = "") -> T:
    """Build a dataclass from names and values; what is left out keeps its default.

    Parameters
    ----------
    kind : type
        A dataclass whose fields are numbers, texts, one of some texts, truth values, other such dataclasses, or one of
        these or None.
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
            known = f"; known here: {', '.join(fields)}"
            raise ConfigError(f"unknown setting {place}{name}{perhaps(str(name), fields, place) or known}")
    missing = [name for name, field in fields.items() if name not in content and not _has_default(field)]
    if missing:
        raise ConfigError(f"{place}{missing[0]} is missing")
    hints = get_type_hints(kind)
    return kind(**{name: _value(hints[name], value, f"{place}{name}") for name, value in content.items()})


def _has_default(field: "dataclasses.Field[Any]") -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


def _value(kind: Any, value: Any, place: str) -> Any:
    """Check one value against the type its field declares."""
    if get_origin(kind) in (types.UnionType, Union):
        if value is None and types.NoneType in get_args(kind):
            return None
        (kind,) = (choice for choice in get_args(kind) if choice is not types.NoneType)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return build(kind, value, f"{place}.")
    if get_origin(kind) is Literal:
        if value not in get_args(kind):
            raise ConfigError(f"{place} must be one of {', '.join(map(str, get_args(kind)))}, got {value!r}")
        return value
    if kind is float and type(value) in (int, float) and abs(value) <= sys.float_info.max:
        return float(value)
    if kind is float or type(value) is not kind:  # not isinstance: True is an int, too
        raise ConfigError(f"{place} must be {_WANTED[kind]}, got {value!r}")
    return value
