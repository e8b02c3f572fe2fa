"""The lens as a file: ``camera.yaml``, or the camera's part of a ``robot.yaml``."""

import dataclasses
import io
from pathlib import Path
from typing import Any

from contourslam.atomic import write_text
from contourslam.errors import ConfigError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.robot.settings import build


def save_lens(path: Path, model: FisheyeModel, *, header: str = "") -> None:
    """Write a lens as ``camera.yaml``, whole or not at all.

    Parameters
    ----------
    path : Path
    model : FisheyeModel
    header : str
        Lines that go above it as comments, such as how well it was found.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # declared None, documented as bool
    buffer = io.StringIO()
    yaml.dump({"model": dataclasses.asdict(model)}, buffer)
    write_text(path, "".join(f"# {line}\n" for line in header.splitlines()) + buffer.getvalue())


def load_lens(path: Path) -> FisheyeModel:
    """Read a lens from a ``camera.yaml`` or a ``robot.yaml``.

    Raises
    ------
    ConfigError
        If the file is missing, not YAML or holds no lens, or a name or a value of the lens is wrong.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        content: Any = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: is not valid YAML ({' '.join(str(error).split())})") from error
    part = content.get("camera", content) if isinstance(content, dict) else None
    if not isinstance(part, dict) or not isinstance(part.get("model"), dict):
        raise ConfigError(f"{path}: holds no camera model; make one with `contourslam calibrate camera`")
    try:
        return build(FisheyeModel, part["model"], "model.")
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error
