"""Pictures that are kept: in a folder of files, or in a recording."""

from collections.abc import Iterator
from pathlib import Path

from contourslam.errors import RecordingError
from contourslam.recordings.bag_pictures import open_pictures
from contourslam.recordings.picture import Picture, encoding_of
from contourslam.recordings.storage import storage_files

_SUFFIXES = (".jpg", ".jpeg", ".png")


def is_folder_of_pictures(path: Path) -> bool:
    """Whether a path is a folder of picture files, and no recording."""
    return path.is_dir() and not storage_files(path) and not (path / "metadata.yaml").exists()


def kept_pictures(path: Path, *, every: float = 0.0, topic: str | None = None) -> Iterator[tuple[str, Picture]]:
    """Yield pictures with their names.

    Parameters
    ----------
    path : Path
        Folder of JPEG and PNG files, in the order of their names, or a recording.
    every : float
        Of a recording, one picture in so many seconds, s; 0 for all.
    topic : str, optional
        Of a recording, where several topics hold pictures.

    Yields
    ------
    name : str
        The file's name, or the stamp.
    Picture
        That of a file has the file's time as stamp.

    Raises
    ------
    RecordingError
        If there are none, or a file cannot be read; a file that is damaged is left out.
    """
    if is_folder_of_pictures(path):
        yield from _files(path)
        return
    last = -float("inf")
    for picture in open_pictures(path).read(topic):
        if not 0.0 <= picture.stamp - last < every:  # a clock set back starts anew
            last = picture.stamp
            yield f"at {picture.stamp:.2f} s", picture


def _files(path: Path) -> Iterator[tuple[str, Picture]]:
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in _SUFFIXES)
    if not files:
        raise RecordingError(f"{path}: holds no picture ({', '.join(_SUFFIXES)}), and is no recording")
    for file in files:
        try:
            data = file.read_bytes()
            stamp = file.stat().st_mtime
        except OSError as error:
            raise RecordingError(f"{file}: cannot be read ({error.strerror or error})") from error
        encoding = encoding_of(data)
        if encoding is None:
            continue
        try:
            picture = Picture(stamp, data, encoding)
        except RecordingError:
            continue
        yield file.name, picture
