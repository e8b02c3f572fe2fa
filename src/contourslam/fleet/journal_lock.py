"""One server at a time on a folder of journals: two would write into each other's files."""

import os
import sys
import weakref
from pathlib import Path

from contourslam.atomic import make_folder
from contourslam.errors import JournalError, ResultError
from contourslam.fleet.journal import settle_folder

NAME = "lock"


class Lock:
    """A folder that is held as long as this object and its process live; where there is no flock, it is not held.

    Parameters
    ----------
    folder : Path
        Made where needed.

    Raises
    ------
    JournalError
        If another one holds it, or it cannot be used.
    """

    def __init__(self, folder: Path) -> None:
        try:
            made = not folder.exists()
            make_folder(folder)
            if made:
                settle_folder(folder.parent)
            descriptor = os.open(folder / NAME, os.O_RDWR | os.O_CREAT, 0o644)
        except (OSError, ResultError) as error:
            reason = getattr(error, "strerror", None) or error
            raise JournalError(f"{folder}: cannot be written ({reason}); choose another folder") from error
        self.release = weakref.finalize(self, os.close, descriptor)
        if sys.platform == "win32":
            return
        import fcntl

        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self.release()
            taken = isinstance(error, BlockingIOError)
            why = "another server keeps its reports there" if taken else f"cannot be locked ({error.strerror or error})"
            raise JournalError(f"{folder}: {why}; end it, or choose another folder") from error
