"""Is a Dask scheduler at an address? Asked before a client is made: one that fails to connect lives on and on."""

import asyncio
import logging
import threading
import time
from collections.abc import Callable
from typing import Any

from contourslam.errors import ContourslamError
from contourslam.evaluation.extras import require

_POLL = 0.2  # s


def reach(address: str, limit: float, stopped: Callable[[], bool] = lambda: False) -> bool:
    """Make sure that a Dask scheduler answers.

    Parameters
    ----------
    address : str
    limit : float
        s: how long to wait at most, whatever it is that answers.
    stopped : callable
        Asked meanwhile whether to give up.

    Returns
    -------
    bool
        False where it was given up.

    Raises
    ------
    ContourslamError
        If there is none.
    MissingExtraError
        If Dask is not installed.
    """
    comm = require("distributed.comm", "sweep")
    try:
        comm.get_address_host_port(address)
    except Exception as error:
        raise no_scheduler(address, error) from error
    for name in ("asyncio", "tornado", "tornado.application", "distributed"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    found: list[Any] = []

    def ask() -> None:
        try:
            found.append(asyncio.run(_kind(address, limit)))
        except BaseException as error:
            found.append(error)

    # A thread that the process does not wait for: what answers may be no Dask, and take for ever.
    asking = threading.Thread(target=ask, daemon=True)
    asking.start()
    until = time.monotonic() + limit
    while asking.is_alive() and time.monotonic() < until:
        asking.join(_POLL)
        if stopped():
            return False
    answer = found[0] if found else TimeoutError(f"nothing after {limit:g} s")
    if answer != "Scheduler":
        why = answer if isinstance(answer, BaseException) else ValueError(f"it is a {answer}")
        raise no_scheduler(address, why) from why
    return True


def no_scheduler(address: str, error: BaseException) -> ContourslamError:
    """Say in one line that there is no scheduler."""
    why = " ".join(str(error).split()) or type(error).__name__
    return ContourslamError(f"no Dask scheduler answers at {address} ({why}); start one with `dask scheduler`")


async def _kind(address: str, limit: float) -> object:
    """What the Dask server at an address calls itself."""
    async with asyncio.timeout(limit):
        connection = await require("distributed.core", "sweep").connect(address, timeout=limit)
        try:
            await connection.write({"op": "identity", "reply": True})
            return (await connection.read())["type"]
        finally:
            connection.abort()
