"""The server: what several robots tell becomes common maps; robots that meet share one."""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.fleet.common import CommonMap, Joined
from contourslam.fleet.common_kept import refined
from contourslam.fleet.facts import Answer, Report, Status
from contourslam.fleet.runs import Run
from contourslam.fleet.server_search import Search
from contourslam.joining.joint import Joint
from contourslam.maps.saved_map import SavedMap

LATEST = 1.0  # s after which keyframes that wait enter the graph, however few
GROWN = 1.5  # a common map that has grown so much since it was last solved as a whole is solved again
FEWEST = 60  # keyframes of a common map that is worth it
Name = tuple[str, int]
"""Robot and run."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that a robot told and that cannot be used.

    Attributes
    ----------
    robot : str
    run : int
    text : str
        What, and what was done about it.
    """

    robot: str
    run: int
    text: str


@dataclass(frozen=True, slots=True)
class Shared:
    """A common map, as it is given away.

    Attributes
    ----------
    number : int
    members : tuple of (str, int)
        Robot and run of each drive of the map, in the order of its drives.
    saved : SavedMap
    joined : tuple of Joined
        How it came about, and on which evidence.
    """

    number: int
    members: tuple[Name, ...]
    saved: SavedMap
    joined: tuple[Joined, ...]


@dataclass(frozen=True, slots=True)
class _Placed:
    """What an answer says of a run, but for what is received."""

    common: int
    members: tuple[str, ...]
    keyframe: int
    pose: Floats
    covariance: Floats


NOWHERE = _Placed(-1, (), -1, np.zeros(3), np.zeros((3, 3)))
MOST_MISSING = 32  # numbers that an answer lists at most
MOST_FAULTS = 1000


class _Heard:
    """Reports of one run: in order as far as they go, and the later ones that wait for a missing one."""

    def __init__(self, robot: str, run: int) -> None:
        self.run = Run(robot, run)
        self.received = self.told = 0
        self.later: dict[int, Report] = {}
        self.status: Status | None = None

    def missing(self) -> tuple[int, ...]:
        until = max(self.told, max(self.later, default=-1) + 1)
        gaps = (number for number in range(self.received, until) if number not in self.later)
        return tuple(number for number, _ in zip(gaps, range(MOST_MISSING), strict=False))


class FleetServer:
    """Joins what several robots tell.

    Reports and statuses may come from any thread and cost next to nothing; :meth:`tick` does the work, in one thread.

    Parameters
    ----------
    config : Config, optional
        Of the refinement of whole maps.
    keep : callable, optional
        Called with every report that is new, before it is acknowledged, so that a server which starts again can be
        given them anew, in any order.

    Attributes
    ----------
    search : Search
    """

    def __init__(self, config: Config | None = None, *, keep: Callable[[Report], None] = lambda report: None) -> None:
        self._config, self._keep = config or Config(), keep
        self._lock = threading.Lock()
        self._heard: dict[Name, _Heard] = {}
        self._fresh: deque[Report] = deque()
        self._faults: deque[Fault] = deque(maxlen=MOST_FAULTS)
        self._placed: dict[Name, _Placed] = {}
        # All that follows is touched by the thread that ticks alone.
        self._commons: dict[int, CommonMap] = {}
        self._where: dict[Run, CommonMap] = {}
        self._numbers = 0
        self._since: dict[int, float] = {}  # common maps in which keyframes wait, and since when
        self._solved: dict[int, int] = {}  # keyframes of each when it was solved as a whole
        self.search = Search()

    def push(self, report: Report) -> None:
        """Take in a report, in any order, any number of times.

        Parameters
        ----------
        report : Report
        """
        with self._lock:
            heard = self._heard_of(report.robot, report.run)
            if report.number < heard.received or report.number in heard.later:
                return
            self._keep(report)
            heard.later[report.number] = report
            heard.told = max(heard.told, report.number + 1)
            while heard.received in heard.later:
                self._fresh.append(heard.later.pop(heard.received))
                heard.received += 1

    def push_status(self, status: Status) -> None:
        """Take in a status, which tells how many reports there should be.

        Parameters
        ----------
        status : Status
        """
        with self._lock:
            heard = self._heard_of(status.robot, status.run)
            heard.told = max(heard.told, status.reports)
            if heard.status is None or status.stamp >= heard.status.stamp:
                heard.status = status

    def _heard_of(self, robot: str, run: int) -> _Heard:
        return self._heard.setdefault((robot, run), _Heard(robot, run))

    def tick(self, now: float, budget: float | None = None) -> None:
        """Do what is to be done: place new keyframes, look for joints, solve whole maps anew.

        Parameters
        ----------
        now : float
            s, of a clock that never goes back.
        budget : float, optional
            s of this thread's time after which nothing more is begun but what new reports need; a view that is looked
            for takes some hundredths, a map that is solved anew some hundredths a metre of way. All is done where left
            out, but for the solving.
        """
        until = None if budget is None else perf_counter() + budget
        self._listen(now)
        for common in list(self._commons.values()):
            if common.due or now >= self._since.get(common.number, now) + LATEST:
                self._advance(common)
        while len(self.search) and (until is None or perf_counter() < until):
            found = self.search.step(self._where)
            if found is not None:
                self._join(*found, now)
        if until is not None and not len(self.search) and perf_counter() < until:
            self._solve_one()
        self._place()

    def flush(self, now: float) -> None:
        """Place all keyframes that wait, and look for all views, however long it takes.

        Parameters
        ----------
        now : float
            As of :meth:`tick`.
        """
        self._listen(now)
        for common in list(self._commons.values()):
            self._advance(common)
        self.tick(now)

    def _listen(self, now: float) -> None:
        """Take the new facts, and let what is needed for each common map be known."""
        while True:
            with self._lock:
                if not self._fresh:
                    return
                report = self._fresh.popleft()
                run = self._heard[report.robot, report.run].run
            if run not in self._where:
                self._numbers += 1
                self._where[run] = self._commons[self._numbers] = CommonMap(self._numbers, [run])
            for fact in report.facts:
                wrong = run.take(fact)
                if wrong:
                    self._complain(run, f"report {report.number}: {wrong}; it is left out")
            self._since.setdefault(self._where[run].number, now)

    def _complain(self, run: Run, text: str) -> None:
        with self._lock:
            self._faults.append(Fault(run.robot, run.number, text))

    def _advance(self, common: CommonMap) -> None:
        self._since.pop(common.number, None)
        if common.waiting:
            common.advance()
            self.search.hear(common, (other for other in self._commons.values() if other is not common))

    def _join(self, older: CommonMap, younger: CommonMap, joint: Joint, now: float) -> None:
        event = Joined(now, older.number, younger.number, older.members, younger.members, joint)
        older.absorb(younger, joint)
        older.joined += (event,)
        del self._commons[younger.number]
        for run in younger.runs:
            self._where[run] = older
        if younger.number in self._since:
            self._since.setdefault(older.number, self._since.pop(younger.number))
        younger.runs = []
        self.search.merged(older, younger)

    def _solve_one(self) -> None:
        """Solve one common map as a whole, if one has grown by so much."""
        for common in self._commons.values():
            if len(common) > max(GROWN * self._solved.get(common.number, 0), FEWEST) and len(common.runs) > 1:
                self.solve(common.number)
                return

    def solve(self, number: int) -> Shared:
        """Solve a common map as a whole and go on from there.

        Parameters
        ----------
        number : int

        Returns
        -------
        Shared
        """
        common = self._commons[number]
        saved, order = common.kept()
        saved = refined(saved, self._config)
        common.begin_anew(saved, order)
        self._solved[number] = len(common)
        self.search.moved(common)
        return _shared(common, saved)

    def _place(self) -> None:
        """Let the answers know where each run is now."""
        placed = {}
        for common in self._commons.values():
            members = common.members
            for run in common.runs:
                last = len(run.keys) - 1
                if last < 0:
                    continue
                before = self._placed.get((run.robot, run.number), NOWHERE)
                pose = common.pose(run, last)
                same = before.keyframe == last and before.common == common.number
                covariance = before.covariance if same else common.covariance(run, last)
                placed[run.robot, run.number] = _Placed(common.number, members, last, pose, covariance)
        with self._lock:
            self._placed = placed

    def answers(self) -> tuple[Answer, ...]:
        """Give an answer for each run that was ever heard of, from any thread."""
        with self._lock:
            return tuple(self._answers())

    def _answers(self) -> Iterator[Answer]:
        for (robot, run), heard in self._heard.items():
            at = self._placed.get((robot, run), NOWHERE)
            yield Answer(
                robot, run, heard.received, heard.missing(), at.common, at.members or (robot,), at.keyframe, at.pose,
                at.covariance,
            )  # fmt: skip

    def faults(self) -> tuple[Fault, ...]:
        """Give what could not be used, the newest last, from any thread."""
        with self._lock:
            return tuple(self._faults)

    def common_maps(self) -> tuple[Shared, ...]:
        """Give all common maps as they stand, the oldest first; in the thread that ticks."""
        return tuple(_shared(common, common.kept()[0]) for common in self._commons.values() if len(common))

    def settle(self) -> tuple[Shared, ...]:
        """Solve all common maps as a whole, and give them; in the thread that ticks."""
        return tuple(self.solve(common.number) for common in list(self._commons.values()) if len(common))


def _shared(common: CommonMap, saved: SavedMap) -> Shared:
    members = tuple((run.robot, run.number) for run in common.runs if run.keys)
    return Shared(common.number, members, saved, common.joined)
