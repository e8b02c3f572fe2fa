"""The server's side: reports in any order, late, repeated or not at all, made into facts in order, each once; kept."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from contourslam.errors import JournalError
from contourslam.fleet.facts import Report, Status
from contourslam.fleet.journal import SUFFIX, Journal, journals, read_head, read_report
from contourslam.fleet.journal_lock import Lock
from contourslam.fleet.wire import checksum, decode

Source = tuple[str, int]  # robot and run

AHEAD, AHEAD_BYTES = 256, 1 << 20  # reports of a run, and bytes of them, that are held beyond a gap
ASKED = 32  # missing reports that an answer names
MOST_SILENT = 1000  # runs that say that they are there, and of which no report has come
TURNS = 8  # times that runs of one name went on after each other, from which on two robots share the name


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
    told: int = 0  # as many there are, as far as is known
    said: int = 0  # as many there are by its statuses


class Inbox:
    """What robots tell, put in order; changed in place. For one thread at a time, but for :meth:`settle`.

    Parameters
    ----------
    folder : Path, optional
        Where reports are kept, by no other inbox at the same time; made where needed. Without it they are lost with the
        process, and acknowledged all the same.

    Attributes
    ----------
    folder : Path or None
    troubles : list of str
        What was wrong with the files that were found.

    Raises
    ------
    JournalError
        If a file of the folder cannot be read, or is none, two are of one run, or another server has the folder.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self._shelves: dict[Source, _Shelf] = {}
        self._silent: set[Source] = set()  # of which no report has come
        self._turns: dict[str, tuple[int, int]] = {}  # run of each robot that went on last, and how often others did
        self.troubles: list[str] = []
        self._journals = 0  # numbers given to files
        self._lock = None if folder is None else Lock(folder)
        if folder is not None:
            try:
                for path in journals(folder):
                    self._recall(path)
            except JournalError:
                self.close()
                raise

    def close(self) -> None:
        """Let another inbox have the folder, as the end of the process does; this one is not to be used again."""
        if self._lock is not None:
            self._lock.release()

    @property
    def sources(self) -> tuple[Source, ...]:
        """Robots and runs that have been heard of."""
        return tuple(self._shelves)

    def kept(self) -> Iterator[Report]:
        """Read all reports that were kept before this process began, run by run, in order.

        Raises
        ------
        JournalError
            If they cannot be read, or hold facts that are none.
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
            if source not in self._shelves and len(self._silent) >= MOST_SILENT:
                return Taken(source, fault=f"more than {MOST_SILENT} runs have told nothing; this one is not heard")
            return Taken(source, status=message, fault=self._hear(message))
        if not isinstance(message, Report):
            return Taken(source, fault="an answer, which only a server sends; are there two?")
        shelf = self._shelf(source)
        self._silent.discard(source)
        number = message.number
        before = self._checksum(shelf, number)
        if before is not None:
            return Taken(source, fault="" if before == checksum(data) else _doubled(message))
        shelf.told = max(shelf.told, number + 1)
        if number > len(shelf.checksums):
            if number < len(shelf.checksums) + AHEAD and shelf.ahead_bytes + len(data) <= AHEAD_BYTES:
                shelf.ahead[number] = message, data
                shelf.ahead_bytes += len(data)
            return Taken(source)
        return Taken(source, self._follow(shelf, message, data))

    def settle(self) -> None:
        """Make sure that what was taken before is on the disk; only that is acknowledged.

        The disk may take its time: another thread may go on with all else meanwhile.

        Raises
        ------
        JournalError
            If the disk fails.
        """
        for shelf in list(self._shelves.values()):
            until = len(shelf.checksums)
            if shelf.settled < until:
                if shelf.journal is not None:
                    shelf.journal.settle()
                shelf.settled = max(shelf.settled, until)

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

    def _follow(self, shelf: _Shelf, report: Report, data: bytes) -> tuple[Report, ...]:
        """Keep the next report, and those that have waited for it."""
        if self.folder is not None and shelf.journal is None:
            # Numbered, so that runs are taken up in the order in which they came, and common maps keep their frames.
            name = f"{self._journals:06d}-{report.robot}-{report.run:016x}{SUFFIX}"
            shelf.journal = Journal(self.folder / name)
            self._journals += 1
        self._keep(shelf, data)
        out = [report]
        while (waiting := shelf.ahead.get(len(shelf.checksums))) is not None:
            report, data = waiting
            del shelf.ahead[report.number]
            shelf.ahead_bytes -= len(data)
            try:
                self._keep(shelf, data)
            except JournalError:  # the first one is kept; this one is missing, and so will be asked for
                break
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
            self._silent.add(source)
        return shelf

    def _hear(self, status: Status) -> str:
        """Take in how many reports a run has; tell of two robots that share a name.

        Of one robot's runs only the last one goes on; what is still to be sent of those before it does not make them
        longer, and statuses that overtake each other do so a few times. The robot's clock says nothing: it may have
        been set back.
        """
        robot, run = status.robot, status.run
        shelf = self._shelf((robot, run))
        before, shelf.said = shelf.said, max(shelf.said, status.reports)
        shelf.told = max(shelf.told, status.reports)
        if shelf.said == before:
            return ""
        last, turns = self._turns.get(robot, (run, 0))
        turns += last != run and before > 0
        self._turns[robot] = run, turns
        if turns < TURNS:
            return ""
        return f"{robot} tells of two drives at once: two robots have this name; give one of them another"

    def _recall(self, path: Path) -> None:
        """Take in what was kept of one run."""
        journal = Journal(path)
        counted = path.name.partition("-")[0]
        self._journals = max(self._journals, int(counted) + 1 if counted.isdecimal() else 0)
        if journal.trouble:
            self.troubles.append(journal.trouble)
        shelf, source = _Shelf(journal), None
        for number, data in enumerate(journal.reports()):
            robot, run, own = read_head(path, data)
            if own != number or source not in (None, (robot, run)):
                raise JournalError(f"{path}: report {number} is not in its place; move the file elsewhere")
            source = robot, run
            shelf.checksums.append(checksum(data))
        if source is not None:
            if (other := self._shelves.get(source)) is not None and other.journal is not None:
                raise JournalError(f"{path}: is of the same run as {other.journal.path.name}; move one elsewhere")
            shelf.settled = shelf.told = len(shelf.checksums)
            self._shelves[source] = shelf


def _doubled(report: Report) -> str:
    return (
        f"{report.robot} told something else in its report {report.number} before, which is kept: "
        f"two robots have this name; give one of them another"
    )
