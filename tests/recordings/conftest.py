"""Recordings to test with: the real logs, and small bags of every format with the same messages in each."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_typestore

from contourslam.errors import RecordingError
from contourslam.recordings import Message
from contourslam.recordings.ros_encoding import Encoder
from contourslam.recordings.ros_messages import OLD_TRANSFORMS, TRANSFORMS
from contourslam.scan import LaserScan, Odometry, TruePose, evenly_spaced

# topic, time of recording (s), message
Entry = tuple[str, float, Any]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    folder = Path(__file__).parents[3] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the real logs (../shared/data) are not here")
    return folder


@pytest.fixture(scope="session")
def encoder() -> Encoder:
    return Encoder()


def _make_messages(steps: int = 40) -> list[Message]:
    """A run with odometry, truth, and scans whose number of beams changes; single precision holds every range."""
    rng = np.random.default_rng(3)
    messages: list[Message] = []
    for step in range(steps):
        stamp = 100.0 + 0.125 * step
        pose = np.array([0.1 * step, -0.05 * step, 0.3 * step % 6.0 - 3.0])
        messages.append(Odometry(stamp, pose))
        messages.append(TruePose(stamp, pose + 0.01))
        if step % 2:
            count = 50 + step % 7
            ranges = np.round(rng.uniform(0.2, 9.0, count) * 256) / 256
            ranges[:3] = np.nan, np.inf, 0.0
            messages.append(
                evenly_spaced(
                    stamp,
                    ranges,
                    angle_min=-3.0,
                    angle_increment=6.0 / count,
                    range_min=0.125,
                    range_max=12.0,
                    time_increment=0.0625 / count,
                )
            )
    return messages


@pytest.fixture(scope="session")
def messages() -> list[Message]:
    return _make_messages()


@pytest.fixture(scope="session")
def make_messages() -> Callable[[int], list[Message]]:
    """Make a run of so many odometry readings, as many true poses and half as many scans."""
    return _make_messages


def as_entries(encoder: Encoder, messages: list[Message]) -> Iterator[Entry]:
    """The messages as a plain driver records them, with the lidar's place in /tf_static."""
    mount = encoder.transform(100.0, np.array([0.25, -0.125, 0.5]), "base_link", "laser")
    yield "/tf_static", 100.0, mount
    for message in messages:
        if isinstance(message, LaserScan):
            yield "/scan", message.stamp, encoder.scan(message, "laser")
        else:
            topic, frame = ("/odom", "odom") if isinstance(message, Odometry) else ("/ground_truth", "map")
            yield topic, message.stamp, encoder.odometry(message.stamp, message.pose, frame, "base_link")


def write_bag1(path: Path, encoder: Encoder, entries: Iterator[Entry], *, compression: str = "none") -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    definition = encoder.store.fielddefs[TRANSFORMS]
    store.register({TRANSFORMS: definition, OLD_TRANSFORMS: definition})
    writer = Bag1Writer(path)
    if compression != "none":
        writer.set_compression(Bag1Writer.CompressionFormat[compression.upper()])
    connections: dict[str, Any] = {}
    with writer:
        for topic, time, message in entries:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            data = encoder.store.cdr_to_ros1(encoder.serialize(message), kind)
            writer.write(connections[topic], round(time * 1e9), data)
    return path


def write_bag2(path: Path, encoder: Encoder, entries: Iterator[Entry], *, storage: str) -> Path:
    connections: dict[str, Any] = {}
    with Bag2Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()]) as writer:
        for topic, time, message in entries:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=encoder.store)
            writer.write(connections[topic], round(time * 1e9), encoder.serialize(message))
    return path


BagMaker = Callable[[str, Path, Iterator[Entry]], Path]
FORMATS = ("bag1", "bag1_bz2", "bag1_lz4", "mcap", "sqlite3", "lone_mcap", "lone_db3")


@pytest.fixture(scope="session")
def make_bag(encoder: Encoder) -> BagMaker:
    """Write entries in one of FORMATS into a folder; gives the path to open."""

    def make(kind: str, folder: Path, entries: Iterator[Entry]) -> Path:
        if kind.startswith("bag1"):
            return write_bag1(
                folder / "run.bag", encoder, entries, compression=kind.removeprefix("bag1").strip("_") or "none"
            )
        storage = "mcap" if "mcap" in kind else "sqlite3"
        path = write_bag2(folder / "run", encoder, entries, storage=storage)
        if kind.startswith("lone"):
            (file,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
            return file.rename(folder / file.name)
        return path

    return make


@pytest.fixture(scope="session")
def drain() -> Callable[[Iterator[Any]], tuple[list[Any], RecordingError | None]]:
    """Take all that an iterator yields, and the RecordingError that ends it, if one does."""

    def take_all(iterator: Iterator[Any]) -> tuple[list[Any], RecordingError | None]:
        taken: list[Any] = []
        while True:
            try:
                taken.append(next(iterator))
            except StopIteration:
                return taken, None
            except RecordingError as error:
                assert "\n" not in str(error)
                return taken, error

    return take_all


@pytest.fixture(scope="session")
def same() -> Callable[[Message, Message], bool]:
    """Compare two messages as far as a bag's single precision goes."""
    return _same


@pytest.fixture(scope="session")
def entries(encoder: Encoder) -> Callable[[list[Message]], Iterator[Entry]]:
    """Messages as a plain driver records them, with the lidar's place in /tf_static."""
    return lambda messages: as_entries(encoder, messages)


def _same(first: Message, second: Message) -> bool:
    """Whether two messages say the same, as far as a bag's single precision goes."""
    if type(first) is not type(second) or abs(first.stamp - second.stamp) > 1e-9:
        return False
    if isinstance(first, LaserScan) and isinstance(second, LaserScan):
        return (
            first.ranges.shape == second.ranges.shape
            and np.array_equal(first.ranges, second.ranges, equal_nan=True)
            and bool(np.abs(first.angles - second.angles).max(initial=0.0) < 1e-5)
            and bool(np.abs(first.offsets - second.offsets).max(initial=0.0) < 1e-6)
            and abs(first.range_min - second.range_min) < 1e-6
            and abs(first.range_max - second.range_max) < 1e-5
        )
    assert not isinstance(first, LaserScan) and not isinstance(second, LaserScan)
    return bool(np.abs(first.pose - second.pose).max() < 1e-9)


@pytest.fixture(scope="session")
def carmen_lines() -> list[bytes]:
    """A small CARMEN log: odometry and scans of 180 beams in turn."""
    rng = np.random.default_rng(5)
    lines = [b"# a comment\n", b"PARAM robot_frontlaser_offset 0.14 nohost 0.0\n"]
    for step in range(60):
        stamp = 1000.0 + 0.25 * step
        pose = f"{0.1 * step:.6f} {-0.02 * step:.6f} {0.01 * step:.6f}"
        lines.append(f"ODOM {pose} 0 0 0 {stamp:.6f} host {0.25 * step:.6f}\n".encode())
        ranges = " ".join(f"{value:.2f}" for value in rng.uniform(0.2, 9.0, 180))
        lines.append(f"FLASER 180 {ranges} {pose} {pose} {stamp + 0.01:.6f} host {0.25 * step:.6f}\n".encode())
    return lines
