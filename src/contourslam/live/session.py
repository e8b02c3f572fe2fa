"""The streaming object of live use: messages go in as they come, poses with a covariance come out."""

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from contourslam.config import LiveConfig
from contourslam.contour.contours import Floats
from contourslam.errors import ContourslamError
from contourslam.live.backing import Backing
from contourslam.live.course import Course, Step
from contourslam.live.diagnostics import Condition, Diagnostic, Sensor, diagnose
from contourslam.live.events import Reason, Released, Source, TimeJump
from contourslam.live.figures import MappedScans, Rate
from contourslam.live.leisure import Leisure
from contourslam.live.outlines import Outlines
from contourslam.live.processed import Drawn, Processed
from contourslam.live.smoothing import Smoother
from contourslam.live.synchroniser import Synchroniser
from contourslam.maps.saved_map import SavedMap
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.mapper import Finished, Mapper

__all__ = ["Drawn", "Processed", "Session"]
T = TypeVar("T")


class Session:
    """Odometry and scans in any order, poses and a map out; over any mapper.

    :meth:`push_odometry` and :meth:`push_scan` only take in and may be called from any thread at any time; :meth:`poll`
    does the work. The others wait for a :meth:`poll` in another thread to end, but for :meth:`map_to_odom`,
    :meth:`latest_map` and :meth:`diagnostics`, which do not wait.

    No clock is read: `now` is the caller's, s, and should be one that nobody sets (``time.monotonic``), also where the
    stamps are of simulated time.

    Where time runs back, the odometry tells what happened. Where it goes on from where it was, a clock was set, and the
    map is continued. Else, and without odometry, the robot may be anywhere now: a recording or a simulation began
    again, and the session goes on as after :meth:`lost`.

    Parameters
    ----------
    backing : Backing
    config : LiveConfig
    odometry_lag : float
        The odometry that belongs to a scan is stamped this much earlier, s; as in ``SlamConfig``.
    autosave : Path, optional
        Where the map is saved by itself; nowhere by default.
    clock : callable, optional
        What `now` comes from. It is asked when a scan is done, so that latencies hold the work too.
    topics : mapping, optional
        From "scan" and "odometry" to what people call them, for the diagnostics.
    expects_odometry : bool
        False where there is none: then no scan waits for it, and its absence is no fault.
    """

    def __init__(
        self,
        backing: Backing,
        config: LiveConfig,
        *,
        odometry_lag: float = 0.0,
        autosave: Path | None = None,
        clock: Callable[[], float] | None = None,
        topics: Mapping[Source, str] | None = None,
        expects_odometry: bool = True,
    ) -> None:
        self._backing, self._config, self._clock = backing, config, clock
        self._topics: dict[Source, str] = {"scan": "scan", "odometry": "odometry", **(topics or {})}
        self._expects_odometry = expects_odometry
        self._work = threading.RLock()  # held while the mapper works
        self._course = Course(backing, config, odometry_lag)
        self._jump: TimeJump | None = None  # of which it is not yet known what it was
        self._leisure = Leisure(backing, config, autosave, clock)
        self._inbox = threading.Lock()  # held for moments; all below is changed under it
        waits = config if expects_odometry else replace(config, wait=math.ulp(0.0))
        self._synchroniser = Synchroniser(waits, odometry_lag=odometry_lag)
        self._smoother = Smoother(config)
        self._rates: dict[Source, Rate] = {"scan": Rate(config.remember), "odometry": Rate(config.remember)}
        self._mapped = MappedScans(config.remember)
        self._step: Step | None = None  # that of the last scan
        self._paused, self._version = False, 0
        self._now, self._began = -math.inf, math.nan
        self._notes: dict[str, tuple[float, str]] = {}  # what happened last, and when

    # Messages in: short, from any thread.

    def push_odometry(self, odometry: Odometry, now: float) -> None:
        """Take in one odometry reading."""
        with self._inbox:
            self._count("odometry", odometry.stamp, now)
            self._synchroniser.push_odometry(odometry, now)

    def push_scan(self, scan: LaserScan, now: float) -> None:
        """Take in one scan."""
        with self._inbox:
            self._count("scan", scan.stamp, now)
            if self._paused:
                self._synchroniser.drop("scan", Reason.PAUSED, scan.stamp, now)
            else:
                self._synchroniser.push_scan(scan, now)

    def refuse(self, source: Source, stamp: float, why: str, now: float) -> None:
        """Count a message that could not be made into a scan or a reading, so that the diagnostics tell of it."""
        with self._inbox:
            self._count(source, stamp, now)
            self._synchroniser.drop(source, Reason.REFUSED, stamp, now, why)

    def _count(self, source: Source, stamp: float, now: float) -> None:
        self._tick(now)
        self._rates[source].count(stamp, self._now)

    def _tick(self, now: float) -> None:
        self._now = max(self._now, now)
        if math.isnan(self._began):
            self._began = now

    # The work.

    def poll(self, now: float, *, at_most: int | None = None) -> list[Processed]:
        """Map every scan whose turn it is; to be called after each push and at least every :meth:`due` seconds.

        Parameters
        ----------
        now : float
            s.
        at_most : int, optional
            Give so many results, and leave the others for the next call; all by default.
        """
        done: list[Processed] = []
        with self._work:
            while at_most is None or len(done) < at_most:
                with self._inbox:
                    self._tick(now if self._clock is None else max(now, self._clock()))
                    item = self._synchroniser.take(self._now)
                if item is None:
                    break
                if isinstance(item, TimeJump):
                    self._jump = item
                    continue
                processed = self._map(item)
                if processed is not None:
                    done.append(processed)
            if not done:
                self._leisure.use(self._course.mapper, self._kept, self._version, self._now)
        return done

    def due(self, now: float) -> float | None:
        """Give the time until :meth:`poll` has work even if no message comes, s; None where it never will."""
        with self._inbox:
            return 0.0 if self._leisure.waited_for(self._version) else self._synchroniser.due(now)

    def _map(self, item: Released) -> Processed | None:
        if self._jump is not None:
            jump, self._jump = self._jump, None
            self._explain(jump, item)
        try:
            step = self._course.step(item)
        except ContourslamError as error:
            with self._inbox:
                self._synchroniser.drop("scan", Reason.FAILED, item.scan.stamp, self._now, str(error))
            return None
        if self._course.leap:
            self._note(
                "leap",
                f"the odometry leapt by {self._course.leap:.1f} m, which is taken for no motion: was the base driver "
                f"started again, or do two publish on {self._topics['odometry']}?",
            )
        update = step.update
        with self._inbox:
            before, self._step = self._step, step
            if before is None or step.blind or before.blind or not before.localized:
                self._smoother.reset()  # motion without odometry is no correction, nor is being found
            # What is smoothed is the pose, which goes on where the odometry's own frame leaps.
            smooth = correction = step.correction
            if step.localized:
                smooth = self._smoother.correct(correction, step.T_own_base, update.stamp)
            if not self._backing.fixed and (update.matched or update.born or update.dropped):
                self._version += 1
            self._tick(self._now if self._clock is None else self._clock())
            latency = self._now - item.arrived
            self._mapped.add(update, latency, self._now)
            return Processed(
                update.stamp, update.pose, update.covariance, step.raw_odometry, step.to_odom(correction),
                step.to_odom(smooth), step.localized, update, self._version, self._synchroniser.tally.new(), item.scan,
                latency, step.seconds,
            )  # fmt: skip

    def _explain(self, jump: TimeJump, item: Released) -> None:
        """Tell a clock that was set from a robot that is elsewhere now, and go on accordingly."""
        back = jump.before - jump.after
        if self._course.was_only_the_clock(item):
            self._note("jump", f"stamps ran back by {back:.1f} s, the odometry did not: a clock was set; all goes on")
            return
        self._go_on_as_lost(None, jump)
        self._note(
            "jump",
            f"time ran back by {back:.1f} s, as where a recording or a simulation begins again: "
            + ("a new map is begun" if self._course.localized else "the robot is looked for in the map"),
        )

    def _note(self, what: str, text: str) -> None:
        with self._inbox:
            self._notes[what] = self._now, text

    # The map.

    @property
    def map_version(self) -> int:
        """A number that grows whenever the map may have changed."""
        return self._version

    def latest_map(self) -> Drawn | None:
        """Give the map as it was drawn up last, and have it drawn up anew as soon as no scan waits. Never waits itself.

        To draw up a large map takes tens of milliseconds, which :meth:`corner_map` and :meth:`wall_map` take from the
        next scan's time.
        """
        self._leisure.want_map()
        return self._leisure.drawn

    def latest_outlines(self) -> Outlines | None:
        """Give the keyframes' contours as they were drawn up last, and have them drawn up anew. Never waits itself."""
        self._leisure.want_outlines()
        return self._leisure.outlines

    def inspect(self, look: Callable[[Mapper], T]) -> T:
        """Let somebody look at the mapper while it rests, and give what he found; he must change nothing.

        Parameters
        ----------
        look : callable
            Given the mapper; that of a map that goes on, once it does.
        """
        with self._work:
            return look(self._backing.standing(self._course.mapper)[0])

    def corner_map(self) -> CornerMap:
        """Corners of the map as they stand now."""
        with self._work:
            return self._course.mapper.corner_map()

    def wall_map(self) -> WallMap:
        """Walls of the map as they stand now."""
        with self._work:
            return self._course.mapper.wall_map()

    def map_to_odom(self, time: float) -> Floats | None:
        """Give the smooth ``T_map_odom`` at a time of the stamps' clock, s; None before the first scan. Never waits."""
        with self._inbox:
            smooth, step = self._smoother.at(time), self._step
            return None if smooth is None or step is None else step.to_odom(smooth)

    # What people ask for.

    @property
    def paused(self) -> bool:
        """Whether scans are left out."""
        return self._paused

    def pause(self) -> None:
        """Leave out scans, and count them; odometry goes on."""
        with self._inbox:
            self._paused = True

    def resume(self) -> None:
        """Take in scans again."""
        with self._inbox:
            self._paused = False

    def reset(self) -> None:
        """Begin anew; where there is an autosave, the map until now is first saved beside it as ``previous-NAME``."""
        with self._work:
            self._leisure.set_aside(self._kept, self._version)
            self._swap(self._backing.begin())

    def lost(self, pose: Floats | None = None) -> None:
        """Say that the robot was carried away: it is looked for in the map, or a new map begun where it cannot be.

        Where there is an autosave, the map until now is first saved beside it as ``previous-NAME``.

        Parameters
        ----------
        pose : ndarray, shape (3,), optional
            About where it is now in the map: m, m, rad.
        """
        with self._work:
            self._go_on_as_lost(pose)

    def save(self, path: Path) -> None:
        """Save the map.

        Raises
        ------
        ContourslamError
            If it cannot be made or written; the file that stood there is as it was.
        """
        with self._work:
            saved = self._kept()
        if self._backing.write is None:
            raise ContourslamError("this session cannot write maps; start it with a way to")
        self._backing.write(path, saved)

    def load(self, path: Path) -> None:
        """Continue a saved map, or localise in it.

        Raises
        ------
        ContourslamError
            If it cannot be read; the session is then as it was.
        """
        if self._backing.read is None or self._backing.open is None:
            raise ContourslamError("this kind of map cannot be continued; use --back-end graph, or localise in it")
        saved = self._backing.read(path)
        with self._work:
            mapper = self._backing.open(saved)
            self._leisure.set_aside(self._kept, self._version)
            self._swap(mapper)

    def finish(self) -> Finished | None:
        """Revise the whole drive as at the end of a recording, where the back end can; no scan may come after that."""
        with self._work:
            return self._course.mapper.finish()

    def close(self) -> None:
        """Save what has not been saved by itself yet, where there is a place for it, and end."""
        with self._work:
            self._leisure.close(self._kept, self._version, self._now)

    def _kept(self) -> SavedMap:
        if self._backing.keep is None:
            raise ContourslamError("the map of this session cannot be saved")
        return self._backing.keep(self._course.mapper)

    def _go_on_as_lost(self, pose: Floats | None, jump: TimeJump | None = None) -> None:
        self._leisure.set_aside(self._kept, self._version)
        self._swap(self._backing.lost(self._course.mapper, pose), jump)

    def _swap(self, mapper: Mapper, jump: TimeJump | None = None) -> None:
        with self._inbox:
            self._course.go_on_with(mapper, jump)
            self._version += 1
            self._smoother.reset()
            self._step = None

    # How all is.

    def diagnostics(self, now: float) -> tuple[Diagnostic, ...]:
        """Say how all is. Never waits."""
        with self._inbox:
            self._tick(now)
            then = self._now - self._config.remember
            notes = {what: text for what, (when, text) in self._notes.items() if when >= then}
            condition = Condition(
                scans=self._sensor("scan", True),
                odometry=self._sensor("odometry", self._expects_odometry),
                incidents=self._synchroniser.tally.since(then),
                totals=dict(self._synchroniser.tally.counts),
                mapped=self._mapped.summary(self._now),
                paused=self._paused,
                localized=self._course.localized if self._step is None else self._step.localized,
                jump=notes.get("jump", ""),
                leap=notes.get("leap", ""),
                map_version=self._version,
                saved=self._now - self._leisure.saved_at,
                autosave=self._leisure.saving_to,
                trouble=self._leisure.trouble,
            )
        return diagnose(condition, self._config)

    def _sensor(self, source: Source, expected: bool) -> Sensor:
        rate, now = self._rates[source], self._now
        silent = now - max(rate.last, self._began)
        return Sensor(self._topics[source], expected, rate.number, silent, rate.by_arrival(now), rate.by_stamps(now))
