"""What the server has acknowledged, on the disk: a file for each run, to which reports are only ever added."""

import contextlib
import os
import struct
import zlib
from collections.abc import Iterator
from io import FileIO
from pathlib import Path

from contourslam.atomic import make_folder
from contourslam.errors import JournalError, MessageError, ResultError
from contourslam.fleet.facts import Report
from contourslam.fleet.wire import LONGEST, decode, head

SUFFIX = ".facts"
BEGINNING = b"contourslam facts 1\n"
RECORD = struct.Struct("<II")  # bytes of the report, and their checksum


class Journal:
    """Reports of one run in a file; changed in place.

    A report is one record: its length, its checksum, and the bytes as they came. What a crash has left half written is
    cut off when the file is opened next, and told of.

    Parameters
    ----------
    path : Path
        Made at the first report.

    Attributes
    ----------
    path : Path
    trouble : str
        What was found wrong as it was opened; empty where nothing was.

    Raises
    ------
    JournalError
        If the file cannot be read, or is none.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.trouble = path, ""
        self._end = 0  # where what is whole ends
        if path.exists():
            self._end = self._sound()
        self._settled = self._end  # as many bytes the disk surely has

    def reports(self) -> Iterator[bytes]:
        """Read all reports, in the order in which they were added.

        Raises
        ------
        JournalError
            If the file cannot be read.
        """
        try:
            with self.path.open("rb") as file:
                file.seek(len(BEGINNING))
                while file.tell() < self._end:
                    length, _ = RECORD.unpack(file.read(RECORD.size))
                    yield file.read(length)
        except FileNotFoundError:
            return
        except OSError as error:
            raise JournalError(f"{self.path}: cannot be read ({error.strerror or error})") from error

    def add(self, report: bytes) -> None:
        """Write a report; :meth:`settle` makes sure that it stays.

        Raises
        ------
        JournalError
            If it cannot be written, as on a full disk; then the file is as it was.
        """
        record = RECORD.pack(len(report), zlib.crc32(report)) + report
        beginning = b"" if self._end else BEGINNING
        try:
            make_folder(self.path.parent)
            with self.path.open("ab", buffering=0) as file:
                _write(file, beginning + record)
        except (OSError, ResultError) as error:
            self._cut()
            reason = getattr(error, "strerror", None) or error
            raise JournalError(
                f"{self.path}: cannot be written ({reason}); free space, nothing more is acknowledged until then"
            ) from error
        self._end += len(beginning) + len(record)

    def settle(self) -> None:
        """Wait until the disk has everything that was added before; another thread may go on adding meanwhile.

        Raises
        ------
        JournalError
            If the disk fails.
        """
        until = self._end
        if self._settled == until:
            return
        try:
            with self.path.open("rb") as file:
                os.fsync(file.fileno())
            if not self._settled:
                settle_folder(self.path.parent)
        except OSError as error:
            raise JournalError(f"{self.path}: the disk fails ({error.strerror or error}); do not trust it") from error
        self._settled = until

    def _cut(self) -> None:
        """Take back what was written by half; where that fails too, the next one to open the file does it."""
        with contextlib.suppress(OSError):
            os.truncate(self.path, self._end)

    def _sound(self) -> int:
        """Find where the last whole record ends, and cut off what comes after it."""
        try:
            with self.path.open("rb") as file:
                size = os.fstat(file.fileno()).st_size
                beginning = file.read(len(BEGINNING))
                if not BEGINNING.startswith(beginning):
                    raise JournalError(f"{self.path}: is no journal of a fleet; move it elsewhere")
                end = len(beginning) if len(beginning) == len(BEGINNING) else 0
                while end and end < size:
                    begin = file.read(RECORD.size)
                    length, checksum = RECORD.unpack(begin) if len(begin) == RECORD.size else (0, 0)
                    if not 0 < length <= LONGEST or zlib.crc32(report := file.read(length)) != checksum:
                        break
                    end += RECORD.size + len(report)
            if end < size:
                self._set_aside(end, size)
        except OSError as error:
            raise JournalError(f"{self.path}: cannot be read ({error.strerror or error})") from error
        return end

    def _set_aside(self, end: int, size: int) -> None:
        """Move what is not whole into a file beside."""
        beside = self.path.with_suffix(".torn")
        with self.path.open("r+b") as file:
            file.seek(end)
            beside.write_bytes(file.read())
            file.truncate(end)
        self.trouble = (
            f"{self.path}: the last {size - end} bytes are no whole report, as after a crash; they are in "
            f"{beside.name} now, and the robot is asked for what is missing"
        )


def settle_folder(folder: Path) -> None:
    """Wait until the disk has a folder's names, else a power cut may lose a file that was made in it.

    Raises
    ------
    OSError
        If the disk fails.
    """
    if os.name == "nt":  # which opens no folders
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _write(file: FileIO, data: bytes) -> None:
    """Write all of it: a disk that fills up takes a part first, and says so only then."""
    while data:
        data = data[file.write(data) :]


def journals(folder: Path) -> Iterator[Path]:
    """Find the journals of a folder, in the order of their names."""
    yield from sorted(folder.glob(f"*{SUFFIX}"))


def read_head(path: Path, data: bytes) -> tuple[str, int, int]:
    """Give robot, run and number of a report that was kept; its facts are not looked at.

    Raises
    ------
    JournalError
        If it is none.
    """
    with _readable(path):
        return head(data)


def read_report(path: Path, data: bytes) -> Report:
    """Decode a report that was kept.

    Raises
    ------
    JournalError
        If it is none.
    """
    with _readable(path):
        message = decode(data)
    if not isinstance(message, Report):
        raise JournalError(f"{path}: holds what is no report; move it elsewhere")
    return message


@contextlib.contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        yield
    except MessageError as error:
        raise JournalError(f"{path}: holds what this program cannot read: {error}") from error
