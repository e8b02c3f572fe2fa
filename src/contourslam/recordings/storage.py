"""Where a bag's messages lie: in a file with an index, in one without, or in several in a folder."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

from rosbags.rosbag1 import Reader as Bag1Reader
from rosbags.rosbag2 import Reader as Bag2Reader

from contourslam.errors import RecordingError
from contourslam.recordings.recording import Topic
from contourslam.recordings.salvage import SCANNERS, RawMessage, bag1, sqlite
from contourslam.recordings.text import first_bytes

Read = Callable[[Collection[str]], Iterator[RawMessage]]


class Storage(ABC):
    """The raw messages of a bag.

    Attributes
    ----------
    path : Path
    ros1 : bool
        Whether messages are serialized as ROS 1 does it.
    topics : list of Topic
        By name.
    start, end : float or None
        Times at which the first and the last message were recorded, s.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.ros1 = False
        self.topics: list[Topic] = []
        self.start: float | None = None
        self.end: float | None = None

    @abstractmethod
    def session(self) -> AbstractContextManager[Read]:
        """Open the bag; gives a function from topic names to an iterator over their messages.

        That iterator raises RecordingError at damage, after what comes before it.
        """


class IndexedStorage(Storage):
    """A bag that is whole, read by rosbags in the order of recording time."""

    def __init__(self, path: Path, ros1: bool) -> None:
        super().__init__(path)
        self.ros1 = ros1
        with self._reader() as reader:
            self.topics = [
                Topic(name, info.msgtype or "several types", info.msgcount)
                for name, info in sorted(reader.topics.items())
            ]
            if reader.message_count:
                # rosbags counts the end as one nanosecond after the last message.
                self.start, self.end = reader.start_time * 1e-9, (reader.end_time - 1) * 1e-9

    def _reader(self) -> Bag1Reader | Bag2Reader:
        return Bag1Reader(self.path) if self.ros1 else Bag2Reader(self.path)

    @contextmanager
    def session(self) -> Iterator[Read]:
        """See :meth:`Storage.session`."""
        with self._reader() as reader:
            yield lambda names: self._read(reader, names)

    def _read(self, reader: Bag1Reader | Bag2Reader, names: Collection[str]) -> Iterator[RawMessage]:
        connections = [connection for connection in reader.connections if connection.topic in names]
        if not connections:
            return
        promised = sum(connection.msgcount for connection in connections)
        found = 0
        try:
            for connection, time, data in reader.messages(connections=connections):
                yield RawMessage(connection.topic, connection.msgtype, time, data)
                found += 1
            for file in storage_files(self.path):
                if first_bytes(file, 16) == sqlite.MAGIC:
                    sqlite.check_whole(file)
        except Exception as error:  # damage shows in rosbags as many kinds of exception
            raise RecordingError(
                f"{self.path}: damaged after message {found} of {promised}: {reason(error)}"
            ) from error
        if found < promised:
            raise RecordingError(f"{self.path}: damaged: only {found} of {promised} messages are there")


class SequentialStorage(Storage):
    """A file whose index is missing or damaged, read from front to back in the order of the file."""

    def __init__(self, path: Path, magic: bytes) -> None:
        super().__init__(path)
        self.ros1 = magic == bag1.MAGIC
        self._scan = SCANNERS[magic]
        counts: dict[str, int] = {}
        types: dict[str, str] = {}
        times: list[int] = []
        try:
            for raw in self._scan(path):
                counts[raw.topic] = counts.get(raw.topic, 0) + 1
                types[raw.topic] = raw.message_type
                times = [min(raw.time, *times), max(raw.time, *times)] if times else [raw.time, raw.time]
        except Exception as error:
            if not counts:
                raise RecordingError(f"{path}: damaged before its first message: {reason(error)}") from error
        self.topics = [Topic(name, types[name], count) for name, count in sorted(counts.items())]
        if times:
            self.start, self.end = times[0] * 1e-9, times[1] * 1e-9

    @contextmanager
    def session(self) -> Iterator[Read]:
        """See :meth:`Storage.session`."""
        yield self._read

    def _read(self, names: Collection[str]) -> Iterator[RawMessage]:
        found = 0
        try:
            for raw in self._scan(self.path):
                found += 1
                if raw.topic in names:
                    yield raw
        except Exception as error:
            raise RecordingError(f"{self.path}: damaged after message {found}: {reason(error)}") from error


class FolderStorage(Storage):
    """A rosbag2 folder whose metadata.yaml is missing or of no use: its files one after the other."""

    def __init__(self, path: Path, complaint: str | None) -> None:
        super().__init__(path)
        self._complaint = complaint
        self._parts: list[Storage] = []
        for file in storage_files(path):
            try:
                self._parts.append(open_storage(file))
            except RecordingError as error:
                if not self._parts:
                    raise
                self._complaint = str(error)
                break
        names = sorted({topic.name: topic for part in self._parts for topic in part.topics}.items())
        self.topics = [
            Topic(name, topic.message_type, sum(t.count for part in self._parts for t in part.topics if t.name == name))
            for name, topic in names
        ]
        self.start = min((part.start for part in self._parts if part.start is not None), default=None)
        self.end = max((part.end for part in self._parts if part.end is not None), default=None)

    @contextmanager
    def session(self) -> Iterator[Read]:
        """See :meth:`Storage.session`."""
        with ExitStack() as stack:
            readers = [stack.enter_context(part.session()) for part in self._parts]
            yield lambda names: self._read(readers, names)

    def _read(self, readers: list[Read], names: Collection[str]) -> Iterator[RawMessage]:
        for read in readers:
            yield from read(names)
        if self._complaint is not None:
            raise RecordingError(f"{self.path}: incomplete after {len(self._parts)} good files: {self._complaint}")


def open_storage(path: Path) -> Storage:
    """Open a bag: a rosbag1, MCAP or sqlite3 file, told by its content, or a rosbag2 folder.

    Raises
    ------
    RecordingError
        If it cannot be read, is no bag, or is damaged before its first message.
    """
    if path.is_dir():
        return _open_folder(path)
    head = first_bytes(path, 16)
    magic = next((magic for magic in SCANNERS if head.startswith(magic)), None)
    if magic is None:
        raise RecordingError(f"{path}: neither a rosbag1, an MCAP nor a sqlite3 file")
    try:
        return IndexedStorage(path, ros1=magic == bag1.MAGIC)
    except Exception:  # whatever is wrong with the index, and a suffix that rosbags does not know
        return SequentialStorage(path, magic)


def _open_folder(path: Path) -> Storage:
    metadata = path / "metadata.yaml"
    if metadata.exists():
        try:
            return IndexedStorage(path, ros1=False)
        except Exception as error:
            complaint: str | None = f"metadata.yaml does not fit ({reason(error)}); delete it if these are all"
    else:
        complaint = None
    if not storage_files(path):
        why = complaint or "it holds neither metadata.yaml nor a .mcap or .db3 file"
        raise RecordingError(f"{path}: the folder is no rosbag2: {why}")
    return FolderStorage(path, complaint)


def storage_files(path: Path) -> list[Path]:
    """List the files of a bag, those of a folder in the order of their numbers."""
    if not path.is_dir():
        return [path]
    files = [file for file in path.iterdir() if file.suffix in (".mcap", ".db3") and not file.name.startswith(".")]
    return sorted(files, key=lambda file: [int(n) if n.isdigit() else n for n in re.split(r"(\d+)", file.name)])


def reason(error: BaseException) -> str:
    """Say in one line what an exception tells."""
    text = " ".join(str(error).split())
    return text or type(error).__name__
