"""What the server has acknowledged, on the disk: a file for each run, to which reports are only ever added."""

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from contourslam.atomic import make_folder
from contourslam.errors import JournalError, MessageError
from contourslam.fleet.facts import Report
from contourslam.fleet.wire import LONGEST, decode

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
        self._file: BinaryIO | None = None
        self._end = 0  # of what is whole
        if path.exists():
            self._end = self._sound()

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
        try:
            file = self._opened()
            file.write(record)
            file.flush()
        except OSError as error:
            self._cut()
            raise JournalError(
                f"{self.path}: cannot be written ({error.strerror or error}); free space, nothing more is acknowledged"
            ) from error
        self._end += len(record)

    def settle(self) -> None:
        """Wait until the disk has everything, and let go of the file until the next report.

        Raises
        ------
        JournalError
            If the disk fails.
        """
        file, self._file = self._file, None
        if file is None:
            return
        try:
            with file:
                os.fsync(file.fileno())
        except OSError as error:
            raise JournalError(f"{self.path}: the disk fails ({error.strerror or error}); do not trust it") from error

    def _opened(self) -> BinaryIO:
        if self._file is None:
            make_folder(self.path.parent)
            self._file = self.path.open("ab", buffering=0)
            if self._end == 0:
                self._file.write(BEGINNING)
                self._end = len(BEGINNING)
        return self._file

    def _cut(self) -> None:
        """Take back what was written by half."""
        file, self._file = self._file, None
        try:
            if file is not None:
                file.close()
            os.truncate(self.path, self._end)
        except OSError as error:
            self.trouble = f"{self.path}: half a report cannot be cut off ({error.strerror or error}); start anew"

    def _sound(self) -> int:
        """Find where the last whole record ends, and cut off what comes after it."""
        try:
            with self.path.open("rb") as file:
                size = os.fstat(file.fileno()).st_size
                head = file.read(len(BEGINNING))
                if not BEGINNING.startswith(head):
                    raise JournalError(f"{self.path}: is no journal of a fleet; move it elsewhere")
                end = len(head) if len(head) == len(BEGINNING) else 0
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


def journals(folder: Path) -> Iterator[Path]:
    """Find the journals of a folder, in the order of their names."""
    yield from sorted(folder.glob(f"*{SUFFIX}"))


def read_report(path: Path, data: bytes) -> Report:
    """Decode a report that was kept.

    Raises
    ------
    JournalError
        If it is none.
    """
    try:
        message = decode(data)
    except MessageError as error:
        raise JournalError(f"{path}: holds what this program cannot read: {error}") from error
    if not isinstance(message, Report):
        raise JournalError(f"{path}: holds what is no report; move it elsewhere")
    return message
