"""Optional libraries, imported where they are used so that the core runs without them."""

from importlib import import_module
from typing import Any

from contourslam.errors import MissingExtraError


def require(module: str, extra: str = "report") -> Any:
    """Import a module of an extra.

    Parameters
    ----------
    module : str
        Dotted name of the module.
    extra : str
        The package's extra that installs it.

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
            f"{library} is needed for this and is not installed: pip install 'contourslam[{extra}]'"
        ) from error
