"""The server: what several robots tell becomes common maps; robots that meet share one."""

import threading
from collections import deque
from collections.abc import Callable, Mapping
from time import perf_counter

from contourslam.config import Config
from contourslam.errors import JournalError
from contourslam.fleet.common import CommonMap, Joined
from contourslam.fleet.common_kept import refined
from contourslam.fleet.facts import Answer, KeyframeFact, Report
from contourslam.fleet.faults import Fault, Faults, briefly
from contourslam.fleet.inbox import Inbox, Source
from contourslam.fleet.joints_kept import Joints
from contourslam.fleet.runs import Identity, Run
from contourslam.fleet.server_answers import NOWHERE, Standing, standings
from contourslam.fleet.server_search import Search
from contourslam.fleet.shared import Shared, share
from contourslam.joining.joint import Joint

LATEST = 1.0  # s after which keyframes that wait enter the graph, however few
GROWN = 1.5  # a common map that has grown so much since it was last solved as a whole is solved again
FEWEST = 60  # keyframes of a common map that is worth it


class FleetServer:
    """Joins what several robots tell.

    Messages may come in from any thread and cost little; :meth:`tick` does the work, in one thread.

    Parameters
    ----------
    config : Config, optional
        Of the refinement of whole maps.
    inbox : Inbox, optional
        Where reports are put in order and kept; what it holds from before is taken up. One that keeps nothing by
        default.
    sites : mapping of str to str, optional
        Where each robot drives; robots of different sites are never compared, and one that is not named is at a site
        with all others that are not.
    clock : callable, optional
        Gives the time of which a round's budget is, s.

    Attributes
    ----------
    search : Search

    Raises
    ------
    JournalError
        If what the inbox holds cannot be read; the inbox is closed then.
    """

    def __init__(
        self,
        config: Config | None = None,
        *,
        inbox: Inbox | None = None,
        sites: Mapping[str, str] | None = None,
        clock: Callable[[], float] = perf_counter,
    ) -> None:
        self._config, self._inbox, self._sites = config or Config(), inbox or Inbox(), dict(sites or {})
        self._clock = clock
        self._lock = threading.Lock()  # held for moments; what follows is changed under it
        try:
            self._fresh: deque[Report] = deque(self._inbox.kept())
        except JournalError:
            self._inbox.close()  # there is no server: another one may have the folder, once it is mended
            raise
        self._faults = Faults()
        for trouble in self._inbox.troubles:
            self._faults.note(trouble)
        self._placed: dict[Source, Standing] = {}
        # All that follows is touched by the thread that ticks alone.
        self._commons: dict[int, CommonMap] = {}
        self._runs: dict[Source, Run] = {}
        self._where: dict[Run, CommonMap] = {}
        self._numbers = 0
        self._since: dict[int, float] = {}  # common maps in which keyframes wait, and since when
        self._solved: dict[int, int] = {}  # keyframes of each when it was solved as a whole
        self._joints = Joints(self._inbox.folder, self._faults)
        self._known: dict[Identity, Run] = {}  # who told of each keyframe first
        self._aside: set[Source] = set()
        self.search = Search()

    def push(self, data: bytes) -> Source:
        """Take in a report or a status as it came, in any order, any number of times.

        Parameters
        ----------
        data : bytes
            See :mod:`contourslam.fleet.wire`.

        Returns
        -------
        (str, int)
            Robot and run that it is from.

        Raises
        ------
        MessageError
            If it is no message; nothing has changed then.
        JournalError
            If it cannot be kept; it is not taken then, and the robot will send it again.
        """
        with self._lock:
            taken = self._inbox.take(data)
            self._fresh.extend(taken.reports)
        if taken.fault:
            self._faults.note(taken.fault, *taken.source)
        return taken.source

    def tick(self, now: float, budget: float | None = None) -> None:
        """Do what is to be done: place new keyframes, look for joints, solve whole maps anew.

        Parameters
        ----------
        now : float
            s, of a clock that never goes back.
        budget : float, optional
            s after which nothing more is begun but what new reports need; a view that is looked for takes some
            hundredths, a map that is solved anew about a hundredth a metre of way. All is done where left out.
        """
        until = None if budget is None else self._clock() + budget
        self._listen(now)
        for common in list(self._commons.values()):
            if common.due or now >= self._since.get(common.number, now) + LATEST:
                self._advance(common)
        self._join_again()
        while len(self.search) and (until is None or self._clock() < until):
            found = self._look()
            if found is not None:
                self._join(*found, now)
        if not len(self.search) and (until is None or self._clock() < until):
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
            if (report.robot, report.run) in self._aside:
                continue
            run = self._runs.setdefault((report.robot, report.run), Run(report.robot, report.run))
            if run not in self._where:
                self._numbers += 1
                self._where[run] = self._commons[self._numbers] = CommonMap(self._numbers, [run])
            for fact in report.facts:
                wrong = run.take(fact)
                if wrong:
                    self._tell(run, f"report {report.number}: {wrong}; it is left out")
                elif isinstance(fact, KeyframeFact):
                    self._recognise(run)
            self._since.setdefault(self._where[run].number, now)

    def _tell(self, run: Run, text: str) -> None:
        self._faults.note(text, run.robot, run.number)

    def _recognise(self, run: Run) -> None:
        """Let a run that began in a map that was kept share the common map of the run that the map is from."""
        identity, own = run.identities[-1], self._where[run]
        if identity is None:
            return
        other = self._where.get(self._known.setdefault(identity, run), own)
        if other is not own and not run.keys and len(own.runs) == 1:
            self._where[run] = other
            other.runs.append(run)
            own.runs = []
            del self._commons[own.number]
            self._since.pop(own.number, None)

    def _advance(self, common: CommonMap) -> None:
        self._since.pop(common.number, None)
        if common.waiting:
            try:
                common.advance()
            except Exception as error:  # whatever is wrong with one map, the others go on
                self._put_aside(common, error)
                return
            others = (other for other in self._commons.values() if other is not common and len(other))
            self.search.hear(common, (other for other in others if self._site(other) == self._site(common)))

    def _put_aside(self, common: CommonMap, error: Exception) -> None:
        """Give up a common map that cannot be solved; what its runs tell is kept, and not used any more."""
        for run in common.runs:
            self._tell(run, f"common map {common.number} cannot be solved ({briefly(error)}); its runs are put aside")
            self._aside.add((run.robot, run.number))
            del self._where[run]
        common.runs = []
        self._commons.pop(common.number, None)
        self._since.pop(common.number, None)
        self.search.forget(common)

    def _site(self, common: CommonMap) -> str | None:
        return self._sites.get(common.runs[0].robot)

    def _join_again(self) -> None:
        """Join what was joined before this process began."""
        if not len(self._joints):
            return
        for common in list(self._commons.values()):
            self._advance(common)
        for older, younger, joint, at in self._joints.again(self._runs, self._where):
            if self._site(older) == self._site(younger):
                self._join(older, younger, joint, at, keep=False)

    def _join(self, older: CommonMap, younger: CommonMap, joint: Joint, now: float, *, keep: bool = True) -> None:
        event = Joined(now, older.number, younger.number, older.members, younger.members, joint)
        try:
            older.absorb(younger, joint)
        except Exception as error:
            self._put_aside(older, error)
            self._put_aside(younger, error)
            return
        older.joined += (event,)
        if keep:
            self._joints.keep(now, joint, older, younger)
        del self._commons[younger.number]
        for run in younger.runs:
            self._where[run] = older
        if younger.number in self._since:
            self._since.setdefault(older.number, self._since.pop(younger.number))
        younger.runs = []
        self.search.merged(older, younger)

    def _look(self) -> tuple[CommonMap, CommonMap, Joint] | None:
        try:
            return self.search.step(self._where)
        except Exception as error:
            self._faults.note(f"a view cannot be looked for ({briefly(error)}); it is left out")
            return None

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
        self._solved[number] = len(common)
        saved, order = common.kept()
        try:
            better = refined(saved, self._config)
        except Exception as error:
            why = f"common map {number} cannot be solved as a whole ({briefly(error)}); it stays as it is"
            self._tell(common.runs[0], why)
            return share(common, saved)
        common.begin_anew(better, order)
        self.search.moved(common)
        return share(common, better)

    def _place(self) -> None:
        """Let the answers know where each run is now."""
        placed: dict[Source, Standing] = {}
        for common in list(self._commons.values()):
            try:
                placed.update(standings(common, self._placed))
            except Exception as error:
                self._put_aside(common, error)
        with self._lock:
            self._placed = placed

    def answers(self) -> tuple[Answer, ...]:
        """Give an answer for each run that was ever heard of, from any thread.

        Raises
        ------
        JournalError
            If what was received cannot be kept; nothing is acknowledged then.
        """
        self._inbox.settle()  # the disk may take its time; messages go on coming in
        with self._lock:
            placed, state = self._placed, self._inbox.state
            return tuple(placed.get(s, NOWHERE).answer(s, *state(s)) for s in self._inbox.sources)

    def joined(self) -> tuple[Joined, ...]:
        """Tell which common maps became one, the earliest first; in the thread that ticks."""
        every = (event for common in self._commons.values() for event in common.joined)
        return tuple(sorted(every, key=lambda event: event.at))

    def faults(self) -> tuple[Fault, ...]:
        """Give what could not be used, the newest last, from any thread."""
        return self._faults.all()

    def common_maps(self) -> tuple[Shared, ...]:
        """Give all common maps as they stand, the oldest first; in the thread that ticks."""
        return tuple(share(common, common.kept()[0]) for common in self._commons.values() if len(common))

    def settle(self) -> tuple[Shared, ...]:
        """Solve all common maps as a whole, and give them; in the thread that ticks."""
        return tuple(self.solve(common.number) for common in list(self._commons.values()) if len(common))
