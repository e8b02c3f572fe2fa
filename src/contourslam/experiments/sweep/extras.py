"""The libraries of the extra `sweep`, imported where they are used."""

from importlib import import_module
from typing import Any

from contourslam.errors import MissingExtraError


def require(module: str) -> Any:
    """Import a module of the `sweep` extra.

    Parameters
    ----------
    module : str
        Dotted name of the module.

    Raises
    ------
    MissingExtraError
        If its library is not installed.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        library = module.partition(".")[0]
        raise MissingExtraError(
            f"{library} is needed for sweeps and is not installed: pip install 'contourslam[sweep]'"
        ) from error
