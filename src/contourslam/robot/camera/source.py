"""What every source of pictures offers, wherever they come from."""

import time
from abc import abstractmethod
from collections.abc import Callable, Iterator

from contourslam.closing import Closing
from contourslam.recordings.picture import Picture


def never() -> bool:
    """Say that nobody wants to stop."""
    return False


class PictureSource(Closing):
    """A source of pictures; a context manager that frees it at the end.

    Attributes
    ----------
    name : str
        Of the device, the file or the folder.
    exposure : float or None
        Of the latest picture, s, where the source tells it.
    reconnections : int
        How often it was lost and found again.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.exposure: float | None = None
        self.reconnections = 0

    @abstractmethod
    def frames(self, stopped: Callable[[], bool] = never) -> Iterator[Picture]:
        """Yield pictures as they come.

        Parameters
        ----------
        stopped : callable
            Asked at each picture, and some times a second while none comes; the pictures end when it says so.

        Yields
        ------
        Picture
            Stamps are host time in the middle of the exposure, as near as the source tells it; of what is kept, the
            time at which it was taken.

        Raises
        ------
        DeviceError
            One of its kinds: not found, permission, busy, silent, unplugged.
        RecordingError
            If what is kept is damaged.
        """

    def close(self) -> None:
        """Free the source; no error, for one that has gone is closed too."""
        return


def paced(pictures: Iterator[Picture], stopped: Callable[[], bool]) -> Iterator[Picture]:
    """Hand pictures on as far apart as they were taken; a pause of more than a second is cut to one."""
    due, last = time.monotonic(), None
    for picture in pictures:
        if last is not None:
            due += min(max(picture.stamp - last, 0.0), 1.0)
        last = picture.stamp
        while (wait := due - time.monotonic()) > 0.0:
            if stopped():
                return
            time.sleep(min(wait, 0.05))
        if stopped():
            return
        yield picture
