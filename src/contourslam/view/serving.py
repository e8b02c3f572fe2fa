"""A server for a show: whether it can be had, and with a secret in its link where others can reach it."""

from typing import TYPE_CHECKING

from contourslam.errors import MissingExtraError
from contourslam.view.access import is_loopback, new_token
from contourslam.view.lag import Lag
from contourslam.view.show import Show

if TYPE_CHECKING:
    from contourslam.view.server import ViewServer


def check_servable() -> None:
    """Refuse where the library that serves the page is not installed.

    Raises
    ------
    MissingExtraError
    """
    try:
        import websockets  # noqa: F401, whether it is there
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            "websockets serves the page and is not installed: pip install 'contourslam[view]'"
        ) from error


def page_server(show: Show, lag: Lag, *, host: str, port: int) -> "ViewServer":
    """Give the server of a page, not yet entered; beyond this machine nobody is answered who has not the whole link.

    Parameters
    ----------
    show : Show
    lag : Lag
    host : str
        Address to listen at.
    port : int
        0 for any that is free.

    Raises
    ------
    MissingExtraError
        If the library that serves it is not installed.
    """
    check_servable()
    from contourslam.view.server import ViewServer

    return ViewServer(show, host=host, port=port, token="" if is_loopback(host) else new_token(), lag=lag)
