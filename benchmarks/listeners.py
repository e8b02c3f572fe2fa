"""Pages without a browser: they read all that the live page's server sends, and draw nothing.

What is left is what a page costs the robot where the browser runs on another computer.
"""

import contextlib
import json
import threading
from types import TracebackType
from typing import Self

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect


class Listeners:
    """Open links to a server, each read in a thread of its own.

    Parameters
    ----------
    url : str
        Of the page.
    reading : int
        How many read, and say at once of each frame that it is drawn.
    halted : int
        How many never read.
    """

    def __init__(self, url: str, reading: int, halted: int = 0) -> None:
        self._url = url.replace("http:", "ws:") + "ws"
        self._halted = [self._open() for _ in range(halted)]
        self._read: list[ClientConnection] = []
        self.frames = 0
        for _ in range(reading):
            self._begin()

    def _open(self) -> ClientConnection:
        return connect(self._url, max_size=None, compression=None)

    def _begin(self) -> None:
        link = self._open()
        self._read.append(link)
        threading.Thread(target=self._listen, args=(link,), daemon=True).start()

    def _listen(self, link: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            for message in link:
                assert isinstance(message, bytes)
                header = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
                if header["kind"] == "frame":
                    self.frames += 1
                    link.send(json.dumps({"do": "drawn", "value": header["index"]}))

    def reconnect(self) -> None:
        """Close the first link that reads, and open another."""
        self._read.pop(0).close()
        self._begin()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for link in (*self._read, *self._halted):
            link.close()
