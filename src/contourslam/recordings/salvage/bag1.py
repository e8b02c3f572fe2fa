"""Rosbag1 files, version 2.0, read without their index (format: wiki.ros.org/Bags/Format/2.0)."""

import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from contourslam.recordings.salvage.inflate import inflate
from contourslam.recordings.salvage.raw import DamagedError, RawMessage, take

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _HEADER, _CHUNK, _CONNECTION = 2, 3, 5, 7

Fields = dict[bytes, bytes]
Connections = dict[int, tuple[str, str]]


def bag1_messages(path: Path) -> Iterator[RawMessage]:
    """Yield the messages in the order of the file; any exception tells of damage after them."""
    connections: Connections = {}
    index_at = 0
    with path.open("rb") as file:
        file.seek(len(MAGIC))
        for header, data, complete in _records(file):
            operation = header[b"op"][0]
            if operation == _HEADER:
                (index_at,) = struct.unpack("<Q", header[b"index_pos"])
            elif operation == _CHUNK:
                yield from _chunk_messages(header[b"compression"].decode(), data, connections)
            elif complete:
                yield from _record_messages(operation, header, data, connections)
            if not complete:
                raise DamagedError("the file ends within a record")
        if index_at == 0 or file.tell() < index_at:
            raise DamagedError("its recorder did not close it, or it is cut short (rosbag reindex may mend it)")


def _records(file: BinaryIO) -> Iterator[tuple[Fields, bytes, bool]]:
    while size := file.read(4):
        header = _fields(take(file, *struct.unpack("<I", size)))
        (length,) = struct.unpack("<I", file.read(4))
        data = take(file, length)
        yield header, data, len(data) == length


def _fields(data: bytes) -> Fields:
    source, fields = BytesIO(data), {}
    while size := source.read(4):
        name, equals, value = source.read(*struct.unpack("<I", size)).partition(b"=")
        if not equals:
            raise DamagedError("a record's header is malformed")
        fields[name] = value
    return fields


def _chunk_messages(compression: str, packed: bytes, connections: Connections) -> Iterator[RawMessage]:
    data, damage = inflate("" if compression == "none" else compression, packed)
    for header, record, complete in _records(BytesIO(data)):
        if not complete:
            raise DamagedError("a chunk is damaged") from damage
        yield from _record_messages(header[b"op"][0], header, record, connections)
    if damage is not None:
        raise damage


def _record_messages(operation: int, header: Fields, data: bytes, connections: Connections) -> Iterator[RawMessage]:
    if operation == _CONNECTION:
        package, _, name = _fields(data)[b"type"].decode().rpartition("/")
        topic = "/".join(part for part in header[b"topic"].decode().split("/") if part)
        slash = "/" if header[b"topic"].startswith(b"/") else ""
        connections[struct.unpack("<I", header[b"conn"])[0]] = (slash + topic, f"{package}/msg/{name}")
    elif operation == _MESSAGE:
        seconds, nanoseconds = struct.unpack("<II", header[b"time"])
        yield RawMessage(*connections[struct.unpack("<I", header[b"conn"])[0]], seconds * 10**9 + nanoseconds, data)
