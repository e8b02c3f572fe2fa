"""The lens as a file: ``camera.yaml``, or the camera's part of a ``robot.yaml``."""

from dataclasses import dataclass
from pathlib import Path

from contourslam.errors import ConfigError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.settings_file import build, read_yaml, write_settings


@dataclass(frozen=True, slots=True)
class _CameraFile:
    """What a ``camera.yaml`` holds: as much of a robot's camera as the lens."""

    model: FisheyeModel


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
    write_settings(path, _CameraFile(model), header=header)


def load_lens(path: Path) -> FisheyeModel:
    """Read a lens from a ``camera.yaml`` or a ``robot.yaml``.

    Raises
    ------
    ConfigError
        If the file is missing, not YAML or holds no lens, or a name or a value of the lens is wrong.
    """
    content = read_yaml(path)
    part = content.get("camera", content) if isinstance(content, dict) else None
    if not isinstance(part, dict) or not isinstance(part.get("model"), dict):
        raise ConfigError(f"{path}: holds no camera model; make one with `contourslam calibrate camera`")
    try:
        return build(FisheyeModel, part["model"], "model.")
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error
