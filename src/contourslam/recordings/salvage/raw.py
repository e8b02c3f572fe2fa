"""What reading a bag from front to back yields, and how it ends early."""

import os
from typing import BinaryIO, NamedTuple


class DamagedError(Exception):
    """A file ends too early or holds what its format forbids."""


class RawMessage(NamedTuple):
    """A message as it is stored: topic, message type, time of recording (ns) and serialized bytes."""

    topic: str
    message_type: str
    time: int
    data: bytes


def take(file: BinaryIO, length: int) -> bytes:
    """Read `length` bytes, or as many as there are: a corrupt length must not claim the memory."""
    if length > 2**16:
        here = file.tell()
        length = min(length, file.seek(0, os.SEEK_END) - here)
        file.seek(here)
    return file.read(length)
