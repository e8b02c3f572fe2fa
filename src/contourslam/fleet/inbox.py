"""The server's side: reports in any order, late, repeated or not at all, made into facts in order, each once; kept."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from contourslam.errors import JournalError
from contourslam.fleet.facts import Answer, KeyframeFact, Report, Status
from contourslam.fleet.journal import SUFFIX, Journal, journals, read_report
from contourslam.fleet.wire import checksum, decode

Source = tuple[str, int]  # robot and run

AHEAD, AHEAD_BYTES = 256, 1 << 20  # reports of a run, and bytes of them, that are held beyond a gap
ASKED = 32  # missing reports that an answer names
ALIVE = 3  # news of a run after another one of the same name began, from which on two robots share the name


@dataclass(frozen=True, slots=True)
class Taken:
    """What a message brought.

    Attributes
    ----------
    source : (str, int)
        Robot and run.
    reports : tuple of Report
        Those that follow on what has been given so far, in order: now each once.
    status : Status or None
        Where the message was one.
    fault : str
        What is wrong with who sent it, for people; empty where nothing is.
    """

    source: Source
    reports: tuple[Report, ...] = ()
    status: Status | None = None
    fault: str = ""


@dataclass(slots=True)
class _Shelf:
    """Reports of one run."""

    journal: Journal | None
    checksums: list[int] = field(default_factory=list)  # of what is kept, by number
    settled: int = 0  # as many are surely on the disk
    ahead: dict[int, tuple[Report, bytes]] = field(default_factory=dict)
    ahead_bytes: int = 0
    told: int = 0  # as many there are, as far as the robot said
    alive: int = 0  # news since a younger run of the same name began


class Inbox:
    """What robots tell, put in order; changed in place. For one thread at a time.

    Parameters
    ----------
    folder : Path, optional
        Where reports are kept; without it they are lost with the process, and acknowledged all the same.

    Attributes
    ----------
    troubles : list of str
        What was wrong with the files that were found.

    Raises
    ------
    JournalError
        If a file of the folder cannot be read, or is none.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._shelves: dict[Source, _Shelf] = {}
        self._youngest: dict[str, tuple[int, float]] = {}  # run of each robot that began last, and the stamp at which
        self.troubles: list[str] = []
        self._journals = 0  # numbers given to files
        if folder is not None and folder.exists():
            for path in journals(folder):
                self._recall(path)

    @property
    def sources(self) -> tuple[Source, ...]:
        """Robots and runs that have been heard of."""
        return tuple(self._shelves)

    def kept(self) -> Iterator[Report]:
        """Read all reports that were kept before this process began, run by run, in order.

        Raises
        ------
        JournalError
            If they cannot be read.
        """
        for shelf in self._shelves.values():
            if shelf.journal is not None:
                for number, data in enumerate(shelf.journal.reports()):
                    if number < len(shelf.checksums):
                        yield read_report(shelf.journal.path, data)

    def take(self, data: bytes) -> Taken:
        """Take in a report or a status.

        Parameters
        ----------
        data : bytes
            As they came.

        Returns
        -------
        Taken

        Raises
        ------
        MessageError
            If they are no message; nothing has changed then.
        JournalError
            If it cannot be kept; it is not taken then, and the robot will send it again.
        """
        message = decode(data)
        source = message.robot, message.run
        if isinstance(message, Status):
            return Taken(source, status=message, fault=self._hear(source, message.reports, message.stamp))
        if not isinstance(message, Report):
            return Taken(source, fault="an answer, which only a server sends; are there two?")
        shelf = self._shelf(source)
        number = message.number
        before = self._checksum(shelf, number)
        if before is not None:
            return Taken(source, fault="" if before == checksum(data) else _doubled(message))
        stamp = max((fact.stamp for fact in message.facts if isinstance(fact, KeyframeFact)), default=-math.inf)
        if number > len(shelf.checksums):
            if number < len(shelf.checksums) + AHEAD and shelf.ahead_bytes + len(data) <= AHEAD_BYTES:
                shelf.ahead[number] = message, data
                shelf.ahead_bytes += len(data)
            return Taken(source, fault=self._hear(source, number + 1, stamp))
        return Taken(source, self._follow(shelf, message, data), fault=self._hear(source, number + 1, stamp))

    def settle(self) -> None:
        """Make sure that what was taken is on the disk; only that is acknowledged.

        Raises
        ------
        JournalError
            If the disk fails.
        """
        for shelf in self._shelves.values():
            if shelf.settled < len(shelf.checksums):
                if shelf.journal is not None:
                    shelf.journal.settle()
                shelf.settled = len(shelf.checksums)

    def state(self, source: Source) -> tuple[int, tuple[int, ...]]:
        """Tell what to answer a run.

        Returns
        -------
        received : int
            Reports 0 to `received` - 1 are here and kept.
        missing : tuple of int
            The first ones that are not here, of all those that there are as far as is known.
        """
        shelf = self._shelves.get(source)
        if shelf is None:
            return 0, ()
        first, until = len(shelf.checksums), max(shelf.told, max(shelf.ahead, default=-1) + 1)
        missing = (n for n in range(first, min(until, first + AHEAD)) if n not in shelf.ahead)
        return shelf.settled, tuple(itertools.islice(missing, ASKED))

    def amend(self, answer: Answer) -> Answer:
        """Give an answer with what of the run's reports is kept, and what is missing."""
        received, missing = self.state((answer.robot, answer.run))
        return replace(answer, received=received, missing=missing)

    def _follow(self, shelf: _Shelf, report: Report, data: bytes) -> tuple[Report, ...]:
        """Keep the next report, and those that have waited for it."""
        if self._folder is not None and shelf.journal is None:
            # Numbered, so that runs are taken up in the order in which they came, and common maps keep their frames.
            name = f"{self._journals:06d}-{report.robot}-{report.run:016x}{SUFFIX}"
            shelf.journal = Journal(self._folder / name)
            self._journals += 1
        self._keep(shelf, data)
        out = [report]
        while (waiting := shelf.ahead.get(len(shelf.checksums))) is not None:
            report, data = waiting
            try:
                self._keep(shelf, data)
            except JournalError:  # the first one is kept; this one goes on waiting
                break
            shelf.ahead.pop(report.number)
            shelf.ahead_bytes -= len(data)
            out.append(report)
        return tuple(out)

    def _keep(self, shelf: _Shelf, data: bytes) -> None:
        if shelf.journal is not None:
            shelf.journal.add(data)
        shelf.checksums.append(checksum(data))

    def _checksum(self, shelf: _Shelf, number: int) -> int | None:
        """Checksum of a report that is here."""
        if number < len(shelf.checksums):
            return shelf.checksums[number]
        waiting = shelf.ahead.get(number)
        return None if waiting is None else checksum(waiting[1])

    def _shelf(self, source: Source) -> _Shelf:
        shelf = self._shelves.get(source)
        if shelf is None:
            shelf = self._shelves[source] = _Shelf(None)
            self._youngest[source[0]] = source[1], math.inf
        return shelf

    def _hear(self, source: Source, reports: int, stamp: float) -> str:
        """Take in how many reports a run has; tell of two robots that share a name."""
        shelf, (robot, run) = self._shelf(source), source
        news, shelf.told = reports > shelf.told, max(shelf.told, reports)
        youngest, began = self._youngest.setdefault(robot, (run, math.inf))
        if run == youngest:
            self._youngest[robot] = run, min(began, stamp if stamp > -math.inf else began)
        if run == youngest or not news or stamp <= began:  # what an older run saw before that may come late
            return ""
        shelf.alive += 1
        if shelf.alive < ALIVE:
            return ""
        return f"{source[0]} tells of two drives at once: two robots have this name; give one of them another"

    def _recall(self, path: Path) -> None:
        """Take in what was kept of one run."""
        journal = Journal(path)
        given = path.name.partition("-")[0]
        self._journals = max(self._journals, int(given) + 1 if given.isdecimal() else 0)
        if journal.trouble:
            self.troubles.append(journal.trouble)
        shelf, source = _Shelf(journal), None
        for number, data in enumerate(journal.reports()):
            report = read_report(path, data)
            if report.number != number or source not in (None, (report.robot, report.run)):
                raise JournalError(f"{path}: report {number} is not in its place; move the file elsewhere")
            source = report.robot, report.run
            shelf.checksums.append(checksum(data))
        if source is not None:
            shelf.settled = shelf.told = len(shelf.checksums)
            self._shelves[source] = shelf


def _doubled(report: Report) -> str:
    return (
        f"{report.robot} told something else in its report {report.number} before, which is kept: "
        f"two robots have this name; give one of them another"
    )
