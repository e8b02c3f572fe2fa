"""The server of the page: its files over HTTP and the rest over a websocket, in a thread of its own."""

import asyncio
import logging
import socket
import threading
from http import HTTPStatus
from typing import Self

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.http11 import Request, Response

from contourslam.errors import ContourslamError
from contourslam.view.access import Access, is_loopback
from contourslam.view.files import load, respond
from contourslam.view.lag import Lag
from contourslam.view.show import Show
from contourslam.view.spectator import Spectator

MOST_PAGES = 32
LARGEST_REQUEST = 4096  # bytes
BUFFER = 1 << 16  # bytes that may wait in this process for one page; the system has its own, bounded too
_LOG = logging.getLogger(__name__)
_LOG.addHandler(logging.NullHandler())  # what strangers send is no news
_LOG.propagate = False


class ServeError(ContourslamError):
    """The page cannot be served at this address."""


class ViewServer:
    """Serves the page inside its context.

    Parameters
    ----------
    show : Show
    host : str
        Address to listen at.
    port : int
        0 for any that is free.
    token : str
        First part of every path; empty for none.
    lag : Lag, optional

    Attributes
    ----------
    port : int
        That which it listens at.

    Raises
    ------
    ServeError
        On entering, if it cannot listen there.
    """

    def __init__(self, show: Show, *, host: str = "127.0.0.1", port: int = 0, token: str = "", lag: Lag | None = None):
        self._show, self._host, self.port = show, host, port
        self._access = Access(is_loopback(host), token)
        self._files = load()
        self._lag = lag or Lag()
        self._ready = threading.Event()
        self._failure: Exception | None = None
        self._loop = asyncio.new_event_loop()
        self._stop = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="view server", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self._ready.wait()
        if self._failure is not None:
            self._thread.join()
            why = getattr(self._failure, "strerror", None) or self._failure
            raise ServeError(f"the page cannot be served at {self._host}, port {self.port} ({why})")
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join()

    @property
    def url(self) -> str:
        """Where the page is, for all who can reach it."""
        host = _address(self._host) if self._host in _ANY else self._host
        host = f"[{host}]" if ":" in host else host
        token = self._access.token
        return f"http://{host}:{self.port}/" + (f"{token}/" if token else "")

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()
            self._ready.set()

    async def _serve(self) -> None:
        try:
            server = await serve(
                self._meet, self._host, self.port, process_request=self._answer, compression=None, logger=_LOG,
                max_size=LARGEST_REQUEST, max_queue=16, write_limit=BUFFER, close_timeout=1.0, server_header=None,
            )  # fmt: skip
        except (OSError, ValueError) as error:  # a name that IDNA refuses is a ValueError
            self._failure = error
            return
        self.port = next(iter(server.sockets)).getsockname()[1]
        self._ready.set()
        await self._stop.wait()
        await _close(server)

    async def _meet(self, connection: ServerConnection) -> None:
        self._lag.pages += 1
        try:
            await Spectator(self._show, connection, self._lag).serve()
        finally:
            self._lag.pages -= 1

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request; None lets it become a websocket."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1 or not self._access.knows(hosts[0]):
            return respond(HTTPStatus.FORBIDDEN, b"This page is only for the machine it runs on.\n")
        path = self._access.path(request.path)
        if path == "/ws":
            if not self._access.same_origin(origins[0] if origins else None, hosts[0]):
                return respond(HTTPStatus.FORBIDDEN, b"Only the page itself may ask for this.\n")
            if self._lag.pages >= MOST_PAGES:
                return respond(HTTPStatus.SERVICE_UNAVAILABLE, b"Too many pages are open.\n")
            return None
        found = None if path is None else self._files.get(path)
        if found is None:
            return respond(HTTPStatus.NOT_FOUND, b"There is nothing here; is the link complete?\n")
        return respond(HTTPStatus.OK, found[1], found[0])


_ANY = {"0.0.0.0": (socket.AF_INET, "192.0.2.1"), "::": (socket.AF_INET6, "2001:db8::1")}
"""What stands for all addresses of a machine, and one that is nowhere (RFC 5737, RFC 3849)."""


def _address(every: str) -> str:
    """Give the address that this machine has on its way out; its name where there is no way."""
    family, nowhere = _ANY[every]
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as asked:
            asked.connect((nowhere, 9))  # chooses the way; a datagram's socket sends nothing by this
            return str(asked.getsockname()[0])
    except OSError:
        return socket.gethostname()


async def _close(server: Server) -> None:
    server.close()
    await server.wait_closed()
