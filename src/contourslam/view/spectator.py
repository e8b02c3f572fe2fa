"""One page that is open: it gets what it has not got yet, always the newest, and never more than it can draw."""

import asyncio
import math
import time
from collections import deque

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from contourslam.view.cursor import Cursor
from contourslam.view.knots import UNIT
from contourslam.view.knots_message import knots_message
from contourslam.view.lag import Lag
from contourslam.view.moment import Moment
from contourslam.view.own_time import counted
from contourslam.view.requests import Request, RequestError, parse
from contourslam.view.show import Show
from contourslam.view.wire import pack

PERIOD, LONGEST = 1.0 / 30.0, 1.0  # s between two frames, at least, and at most where the page draws them
STATUS, STORY = 0.25, 1.0  # s
# Frames that may be on their way, to a page that draws fast and to one that does not; further ones wait, and only the
# newest of them is ever sent.
UNDRAWN, UNDRAWN_SLOW = 2, 1
SLOW = 0.08  # s from sending to drawing
SHARE = 0.02  # of one processor, no more, goes into all pages while the mapping has no time to spare
CHUNK = 300  # knots in one message


class Spectator:
    """Serves one page until its connection ends.

    Nothing is queued for it: each time it can take more, what it lacks is made of the memory as it is then.

    Parameters
    ----------
    show : Show
    connection : ServerConnection
    lag : Lag
        Learns how far the page is behind.
    """

    def __init__(self, show: Show, connection: ServerConnection, lag: Lag) -> None:
        self._show, self._connection, self._lag = show, connection, lag
        self._cursor = Cursor(show.memory, show.pace)
        self._asked = asyncio.Event()
        self._undrawn: deque[tuple[int, float, float | None]] = deque()  # frame, when sent, when its scan was done
        self._epoch, self._knots, self._events = -1, 0, 0
        self._maps: list[int] = []
        self._turn = 0.0  # s from sending to drawing, of late
        self._index, self._began = -1, time.monotonic()
        self._status_at = self._story_at = 0.0
        self._frame_at = 0.0  # when the next may be sent
        self._spent = 0.0  # s of CPU time that the last frame took, with all that was sent before it
        self._story: tuple[int, int] | None = None

    async def serve(self) -> None:
        """Send and listen until the connection ends."""
        listening = asyncio.ensure_future(self._listen())
        listening.add_done_callback(lambda _: self._asked.set())
        last = time.monotonic()
        try:
            while not listening.done():
                now = time.monotonic()
                self._cursor.advance(now - last)
                last = now
                self._asked.clear()
                await self._send_news(now)
                if now >= self._frame_at:
                    self._spent = 0.0
                    await counted(self._send(now), self._count)
                    self._frame_at = now + self._period
                left = min(self._frame_at, self._status_at + STATUS) - time.monotonic()
                try:
                    await asyncio.wait_for(self._asked.wait(), max(left, 0.001))
                except TimeoutError:
                    continue
        except ConnectionClosed:
            return
        finally:
            listening.cancel()

    def _count(self, seconds: float) -> None:
        self._spent += seconds

    @property
    def _period(self) -> float:
        """Time between two frames, s; bounded, for the first sending may be large and the next ones are not."""
        pressed = self._show.pace is None or self._show.pace.pressed
        return min(max(PERIOD, self._lag.pages * self._spent / SHARE), LONGEST) if pressed else PERIOD

    async def _listen(self) -> None:
        try:
            async for text in self._connection:
                self._obey(parse(text))
        except RequestError as error:
            await self._connection.close(1008, str(error))
        except ConnectionClosed:
            return

    def _obey(self, request: Request) -> None:
        if request.do == "drawn":
            self._drawn(int(request.value))
            return  # the next frame comes in its time
        if request.do == "story":
            number = int(request.value)
            self._story = (request.lane, number) if number >= 0 and request.lane < self._lanes else None
            self._story_at = 0.0
        else:
            self._cursor.obey(request, ended=self._show.status()["state"] == "finished")
            self._status_at = 0.0
        self._frame_at = 0.0
        self._asked.set()

    @property
    def _lanes(self) -> int:
        return len(self._show.about["lanes"])

    def _drawn(self, index: int) -> None:
        if all(frame != index for frame, _, _ in self._undrawn):
            return  # one from before the last hello
        now = time.monotonic()
        while self._undrawn:
            frame, sent, made = self._undrawn.popleft()
            self._turn += 0.2 * (now - sent - self._turn)
            if made is not None:
                self._lag.count(now - sent, sent - made)
            if frame == index:
                return

    async def _send_news(self, now: float) -> None:
        """Say that all begins anew where it does, and now and then how all is."""
        if self._epoch != self._show.memory.epoch:
            self._epoch, self._knots, self._index = self._show.memory.epoch, 0, -1
            self._maps, self._events, self._status_at = [0] * self._lanes, 0, 0.0  # the page forgets all at a hello
            self._undrawn.clear()  # also that a frame has come, so that it would never say that it has drawn it
            self._frame_at = 0.0
            await self._connection.send(pack("hello", {"about": self._show.about, "unit": UNIT}))
        if now >= self._status_at + STATUS:
            self._status_at = now
            await self._send_status()

    async def _send(self, now: float) -> None:
        """Send the frame, and before it what else the page lacks."""
        send, memory = self._connection.send, self._show.memory
        if len(self._undrawn) >= (UNDRAWN if self._turn < SLOW else UNDRAWN_SLOW):
            return
        moment = self._cursor.moment()
        if moment is None:
            return
        while knots := memory.knots(self._knots, self._knots + CHUNK):
            if self._epoch != memory.epoch:
                return
            await send(knots_message(self._knots, knots))
            self._knots += len(knots)
        for lane in range(self._lanes):
            drawn = memory.map_at(lane, moment.elapsed)
            if drawn is not None and drawn.number != self._maps[lane]:
                self._maps[lane] = drawn.number
                await send(drawn.message)
        if moment.index != self._index:
            await self._send_frame(moment)
        if self._story is not None and now >= self._story_at + STORY:
            self._story_at = now
            lane, number = self._story
            await send(pack("story", {"lane": lane, "id": number, **self._show.story(lane, number)}))

    async def _send_frame(self, moment: Moment) -> None:
        show = self._show
        knots = show.memory.knots_until(moment.index)
        message = show.painter.paint(moment, knots)
        self._index = moment.index
        fresh = self._cursor.at is None and moment.made >= self._began  # else it has waited for the page to be opened
        self._undrawn.append((moment.index, time.monotonic(), moment.made if fresh else None))
        await self._connection.send(message)

    async def _send_status(self) -> None:
        show = self._show
        next_event, events = show.memory.events(self._events)
        self._events = next_event
        pace = self._cursor.pace
        own = {
            "at": self._cursor.at,
            "paused": pace.paused,
            "speed": None if math.isinf(pace.speed) else pace.speed,
            "events": events,
        }
        status = {**show.status(), **own}
        await self._connection.send(pack("status", status))
