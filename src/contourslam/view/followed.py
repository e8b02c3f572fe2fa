"""A robot that maps as a show: what a live session gives, and how all parts are."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.detectors import make_detector
from contourslam.live.diagnostics import Diagnostic
from contourslam.live.processed import Processed
from contourslam.live.session import Session
from contourslam.localization.follow import Localizer
from contourslam.slam.mapper import Mapper
from contourslam.view.health import Health
from contourslam.view.keeper import Keeper
from contourslam.view.lag import Lag
from contourslam.view.lane import Lane
from contourslam.view.memory import Memory
from contourslam.view.painter import Painter
from contourslam.view.show import Show

MOMENTS, MAPS = 64 << 20, 24 << 20  # bytes: a robot's computer has other uses for its memory


class Followed:
    """A live session that is watched; a :class:`contourslam.live.worker.Onlooker`.

    It works in the mapping's thread: it keeps each scan once its pose has been handed on, and draws the map while no
    scan waits. Pages are served by another thread, out of what is kept. Whatever goes wrong in here ends the page's
    news and nothing else.

    Parameters
    ----------
    config : Config
        That of the mapping.
    title : str
        What the page calls the robot.
    back_end : str, optional
        What the page calls the mapping; by default that of the configuration.
    health : callable, optional
        Gives what is to be said of the robot beside the session's own diagnostics; it must not wait.
    memory : Memory, optional
    clock : callable
        That of the session, s.

    Attributes
    ----------
    show : Show
    lag : Lag
    error : Exception or None
        What nobody foresaw; the page has no news since.
    """

    def __init__(
        self,
        config: Config,
        *,
        title: str,
        back_end: str | None = None,
        health: Callable[[], Sequence[Diagnostic]] = tuple,
        memory: Memory | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._config, self._more_health, self._clock = config, health, clock
        self.lag = Lag()
        self.error: Exception | None = None
        self._memory = memory or Memory(1, moments=MOMENTS, maps=MAPS)
        self._health = Health(self._diagnose, self._tell, clock)
        self._session: Session | None = None
        self._mount: Floats = np.array(config.lidar.mount)
        self._lane: Lane | None = None
        self._keeper: Keeper | None = None
        self._scans, self._began = 0, clock()
        self._about: dict[str, Any] = {
            "title": title,
            "lanes": (config.detector,),
            "back_end": back_end or config.back_end,
            "duration": None,
            "mount": self._mount,
            "live": True,
            "map": 0,  # counts them: what was chosen in one means nothing in the next
            "max_false_negative_rate": config.slam.max_false_negative_rate,
        }
        painter = Painter(config, [make_detector(config.detector, adapted=config.adapted)])
        self.show = Show(self._about, self._memory, painter, None, self._status, self._story)

    def follow(self, session: Session, mount: Floats) -> Self:
        """Begin to follow a session; before its first scan.

        Parameters
        ----------
        session : Session
        mount : ndarray, shape (3,)
            ``T_base_lidar``: m, m, rad.
        """
        self._mount = np.asarray(mount, dtype=np.float64)
        self._about["mount"] = self._mount
        self._forget()
        self._session = session
        return self

    # In the mapping's thread.

    def take(self, processed: Processed) -> None:
        """Keep what a scan gave."""
        if self._session is None or self.error is not None:
            return
        try:
            self._session.inspect(lambda mapper: self._keep(mapper, processed))
        except Exception as error:  # a page must not end the mapping
            self._fail(error)

    def rest(self) -> None:
        """Draw the map where it is due, and see how all is."""
        if self._session is None or self.error is not None:
            return
        try:
            self._health.look()
            if self._keeper is not None:
                draughtsman, elapsed = self._keeper.draughtsman, self._elapsed()
                self._session.inspect(lambda mapper: draughtsman.work(elapsed, idle=False))
        except Exception as error:  # a page must not end the mapping
            self._fail(error)

    def _keep(self, mapper: Mapper, processed: Processed) -> None:
        assert self._session is not None
        if processed.map_version != self._session.map_version:
            return  # the mapper that said this is no more
        if self._lane is None or self._lane.mapper is not mapper:
            self._begin(mapper)
        assert self._lane is not None and self._keeper is not None
        self._scans += 1
        elapsed = self._elapsed()
        done = self._lane.take(processed.update, processed.seconds, elapsed, localized=processed.localized)
        self._keeper.keep(processed.scan, elapsed, (done,))

    def _begin(self, mapper: Mapper) -> None:
        """Go on with another mapper, whose map is another one or goes on from where the robot was found."""
        if self._lane is not None:
            self._forget()
            if isinstance(mapper, Localizer):
                text = "the robot is looked for in the map"
            elif isinstance(self._lane.mapper, Localizer):
                text = "mapping goes on from where the robot was found"
            else:
                text = "another map is begun"
            self._memory.add_event(self._elapsed(), "begun", text)
        self._lane = Lane(mapper, self._config, self._mount)
        self._keeper = Keeper((self._lane,), self._memory, self._clock)

    def _forget(self) -> None:
        """Go on with another map, and have the pages told of it."""
        self._about["map"] += 1
        self._memory.clear()

    def _elapsed(self) -> float:
        """Time since all began, s, on a clock that nobody sets."""
        return self._clock() - self._began

    def _fail(self, error: Exception) -> None:
        self.error = error
        self._memory.add_event(self._elapsed(), "trouble", f"the page has no more news: {error!r}")

    # In any thread.

    def _diagnose(self) -> Sequence[Diagnostic]:
        session = self._session
        own = () if session is None else session.diagnostics(self._clock())
        return (*own, *self._more_health())

    def _tell(self, what: str, text: str) -> None:
        self._memory.add_event(self._elapsed(), what, text)

    def _status(self) -> Mapping[str, Any]:
        newest, keeper = self._memory.newest, self._keeper
        rows = self._health.rows()
        state = "starting" if newest is None else "live" if newest.lanes[0].localized else "lost"
        failed = "" if self.error is None else f"the page has no more news: {self.error!r}"
        return {
            "state": "failed" if failed else state,
            "trouble": failed or self._health.trouble,
            "hurries_to": None,
            "head": 0.0 if newest is None else self._elapsed(),
            "scans": self._scans,
            "beams": 0 if keeper is None else keeper.beams,
            "returned": 0 if keeper is None else keeper.returned,
            "health": rows,
            "lag": self.lag.summary(),
            "pages": self.lag.pages,
        }

    def _story(self, lane: int, number: int) -> Mapping[str, Any]:
        known = self._lane
        return {} if known is None else known.stories.story(number)
