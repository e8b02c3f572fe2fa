"""The configuration as a YAML file: every run writes the one it really used, and can be started from it again."""

import dataclasses
import io
import types
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from contourslam.atomic import write_text
from contourslam.config import Config
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T")


def write_config(path: Path, config: Config, *, header: str = "") -> None:
    """Write a configuration.

    Parameters
    ----------
    path : Path
        The file to write.
    config : Config
        What to write.
    header : str
        Lines that go above it as comments, such as the command.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    comments = "".join(f"# {line}\n" for line in header.splitlines())
    write_text(path, comments + config_text(config))


def config_text(config: "DataclassInstance") -> str:
    """Give a configuration, or one stage's, as YAML."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # declared None, documented as bool
    buffer = io.StringIO()
    yaml.dump(dataclasses.asdict(config), buffer)
    return buffer.getvalue()


def read_config(path: Path) -> Config:
    """Read a configuration; what the file leaves out keeps its default.

    Parameters
    ----------
    path : Path
        A YAML file, such as the ``config.yaml`` of a result folder.

    Returns
    -------
    Config

    Raises
    ------
    ConfigError
        If the file is missing or not YAML, or a name or a value in it is wrong; the message names file and place.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        content = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: is not valid YAML ({' '.join(str(error).split())})") from error
    try:
        return _build(Config, {} if content is None else content, "")
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def _build(kind: type[T], content: Any, place: str) -> T:
    if not isinstance(content, dict):
        raise ConfigError(f"{place or 'the file'} must hold names and values, got {content!r}")
    types_by_name = get_type_hints(kind)
    unknown = [str(name) for name in content if name not in types_by_name]
    if unknown:
        raise ConfigError(f"unknown setting {place}{unknown[0]}; known here: {', '.join(types_by_name)}")
    return kind(**{name: _value(types_by_name[name], value, f"{place}{name}") for name, value in content.items()})


def _value(kind: Any, value: Any, place: str) -> Any:
    """Check one value against the type its field declares."""
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return _build(kind, value, f"{place}.")
    if get_origin(kind) is Literal:
        if value not in get_args(kind):
            raise ConfigError(f"{place} must be one of {', '.join(map(str, get_args(kind)))}, got {value!r}")
        return value
    if get_origin(kind) in (types.UnionType, tuple, dict):  # left to the class's own check
        return tuple(value) if isinstance(value, list) else value
    if kind is float and type(value) is int:
        return float(value)
    if isinstance(kind, type) and type(value) is not kind:
        raise ConfigError(f"{place} must be of type {kind.__name__}, got {value!r}")
    return value
