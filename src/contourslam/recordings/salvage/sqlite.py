"""Rosbag2's sqlite3 files read row by row, not through their index."""

import sqlite3
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
    check_journal(path)


def check_journal(path: Path) -> None:
    """Raise DamagedError where SQLite keeps the newest messages beside the file, in its write-ahead log."""
    journal = path.with_name(f"{path.name}-wal")
    if journal.exists() and journal.stat().st_size > 0:
        raise DamagedError(f"its newest messages are still in {journal.name}: open it once with sqlite3 to merge them")
