"""MCAP files read without their summary (format: mcap.dev/spec)."""

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from contourslam.recordings.salvage.inflate import inflate
from contourslam.recordings.salvage.raw import DamagedError, RawMessage, take

MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x02, 0x03, 0x04, 0x05, 0x06


def mcap_messages(path: Path) -> Iterator[RawMessage]:
    """Yield the messages in the order of the file; any exception tells of damage after them."""
    channels = _Channels()
    with path.open("rb") as file:
        file.seek(len(MAGIC))
        for operation, data, complete in _records(file):
            if operation == _CHUNK:
                yield from _chunk_messages(data, channels)
            elif complete:
                yield from channels.messages(operation, data)
            if not complete:
                raise DamagedError("the file ends within a record")
            if operation == _FOOTER:
                return
    raise DamagedError("it ends without its footer: its recorder was stopped, or it is cut short")


def _records(file: BinaryIO) -> Iterator[tuple[int, bytes, bool]]:
    while head := file.read(9):
        operation, length = struct.unpack("<BQ", head)
        data = take(file, length)
        yield operation, data, len(data) == length


class _Channels:
    """What the schema and channel records read so far say about the messages."""

    def __init__(self) -> None:
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str]] = {}

    def messages(self, operation: int, data: bytes) -> Iterator[RawMessage]:
        """Yield the message that a record holds, if it holds one."""
        if operation == _MESSAGE:
            channel, _, time = struct.unpack_from("<HIQ", data)
            yield RawMessage(*self._channels[channel], time, data[22:])
        elif operation == _CHANNEL:
            channel, schema = struct.unpack_from("<HH", data)
            self._channels[channel] = (_text(BytesIO(data[4:])), self._schemas.get(schema, "unknown"))
        elif operation == _SCHEMA:
            self._schemas[struct.unpack_from("<H", data)[0]] = _text(BytesIO(data[2:]))


def _chunk_messages(data: bytes, channels: _Channels) -> Iterator[RawMessage]:
    _, _, size, checksum = struct.unpack_from("<QQQI", data)
    fields = BytesIO(data[28:])
    compression = _text(fields)
    fields.seek(8, 1)
    records, damage = inflate(compression, fields.read())
    if len(records) == size and checksum and zlib.crc32(records) != checksum:
        raise DamagedError("the checksum of a chunk is wrong")
    for operation, record, complete in _records(BytesIO(records)):
        if not complete:
            raise DamagedError("a chunk is damaged") from damage
        yield from channels.messages(operation, record)
    if damage is not None:
        raise damage


def _text(fields: BytesIO) -> str:
    (length,) = struct.unpack("<I", fields.read(4))
    return fields.read(length).decode()
