"""Rosbag2's sqlite3 files read row by row, not through their index."""

import sqlite3
import struct
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from contourslam.recordings.salvage.raw import DamagedError, RawMessage

MAGIC = b"SQLite format 3\x00"


def sqlite_messages(path: Path) -> Iterator[RawMessage]:
    """Yield the messages in the order they were written; any exception tells of damage after them."""
    # A file name may hold what a URI reserves; "immutable" keeps SQLite from writing beside the file.
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
        # Without it, SQLite refuses at once a file that is shorter than its header says.
        database.execute("PRAGMA writable_schema = ON")
        topics = {key: (name, kind) for key, name, kind in database.execute("SELECT id, name, type FROM topics")}
        for key, time, data in database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id"):
            if not (isinstance(time, int) and isinstance(data, bytes)):
                raise DamagedError("a row does not hold a message")
            yield RawMessage(*topics[key], time, data)
    check_whole(path)


def check_whole(path: Path) -> None:
    """Raise DamagedError where rows may be missing that SQLite does not miss.

    The file may be shorter than its header says (SQLite takes what is missing of its last page as zeros), or the newest
    rows may still lie beside it, in the write-ahead log of a recorder that was killed.
    """
    with path.open("rb") as file:
        header = file.read(100)
    page_size, change, pages = struct.unpack_from(">H6xII", header, 16)
    (valid_for,) = struct.unpack_from(">I", header, 92)
    expected = pages * (65536 if page_size == 1 else page_size)
    size = path.stat().st_size
    if change == valid_for and size < expected:
        raise DamagedError(f"it is cut short: {size} of {expected} bytes")
    journal = path.with_name(f"{path.name}-wal")
    if journal.exists() and journal.stat().st_size > 0:
        raise DamagedError(f"its newest messages are still in {journal.name}: open it once with sqlite3 to merge them")
