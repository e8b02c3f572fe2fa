"""Messages between robots and the server as bytes: versioned, with a checksum, and lossy by less than what is known.

`docs/fleet_messages.md` tells the format to other programs.
"""

import re
import struct
import zlib
from collections.abc import Callable

import numpy as np

from contourslam.contour.contours import Ints
from contourslam.errors import MessageError
from contourslam.fleet.compact import Reader, Writer
from contourslam.fleet.facts import Answer, Report, Status
from contourslam.fleet.wire_facts import (
    APART,
    SIZES,
    STAMP,
    TURN,
    bounded,
    in_steps,
    put_facts,
    put_matrix,
    put_pose,
    take_facts,
    take_matrix,
    take_pose,
)

Message = Report | Status | Answer

MAGIC, VERSION = b"CF", 1
HEAD = struct.Struct("<2sBcI")  # magic, version, kind, checksum of all that follows
LONGEST = 1 << 20  # bytes of one message
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
RUN_BITS, STAMP_BITS, NUMBER_BITS = 63, 56, 40
MOST_MISSING, MOST_ROBOTS = 1000, 1000

# Contexts of statuses and answers, and about how many bits their numbers have.
_NUMBER, _KEYFRAME, _POSE, _MATRIX, _MISSING, _ROBOTS = 0, 1, 2, 5, 11, 12
_SMALL = np.array([8, 8, 12, 12, 12, 11, 11, 11, 4, 4, 4, 2, 2])
_LARGE = np.array(SIZES)
_NONE = np.zeros(0, np.int64)


def check_name(robot: str) -> str:
    """Give a robot's name back, where it may be one.

    Raises
    ------
    MessageError
        If it is not 1 to 64 letters, digits, dots, dashes and underscores that begin with a letter or a digit.
    """
    if NAME.fullmatch(robot) is None:
        raise MessageError(
            f"{robot[:80]!r} cannot be a robot's name; choose 1 to 64 letters, digits, dots, dashes or underscores"
        )
    return robot


def encode(message: Message) -> bytes:
    """Give a message as bytes.

    Raises
    ------
    MessageError
        If it holds what cannot be sent: a name that is none, numbers that are not finite, too much for one message.
    """
    writer = Writer(_LARGE if isinstance(message, Report) else _SMALL)
    if isinstance(message, Report):
        kind = b"R"
        _check_number(message.number)
        writer.put(-NUMBER_BITS, message.number)
        put_facts(writer, message.facts)
    elif isinstance(message, Status):
        kind = b"S"
        _put_status(writer, message)
    else:
        kind = b"A"
        _put_answer(writer, message)
    if not 0 <= message.run < 1 << RUN_BITS:
        raise MessageError(f"{message.run} cannot be the number of a run; it has {RUN_BITS} bits")
    name = check_name(message.robot).encode()
    body = bytes([len(name)]) + name + message.run.to_bytes(8, "little") + writer.packed()
    if len(body) + HEAD.size > LONGEST:
        raise MessageError(f"a message of {len(body) + HEAD.size} bytes is too long to send; send it in several")
    return HEAD.pack(MAGIC, VERSION, kind, zlib.crc32(kind + body)) + body


def decode(data: bytes) -> Message:
    """Give the message that some bytes are.

    No more memory is taken than an undamaged message of this size could need.

    Raises
    ------
    MessageError
        If they are damaged, foreign, of another version or too long; it says which.
    """
    kind, robot, run, rest = _opened(data)
    reader = Reader(rest, _LARGE if kind == b"R" else _SMALL)
    readers: dict[bytes, Callable[[Reader, str, int], Message]]
    readers = {b"R": _take_report, b"S": _take_status, b"A": _take_answer}
    if kind not in readers:
        raise MessageError(f"a message of an unknown kind ({kind!r}); it is foreign")
    message = readers[kind](reader, robot, run)
    reader.end()
    return message


def head(data: bytes) -> tuple[str, int, int]:
    """Give robot, run and number of a report, without looking at its facts, which take all the time.

    Raises
    ------
    MessageError
        If it is no report, or one that is damaged, foreign or of another version; its facts may still be.
    """
    kind, robot, run, rest = _opened(data)
    if kind != b"R":
        raise MessageError("a message that is no report")
    return robot, run, Reader(rest, _NONE).take(-NUMBER_BITS)


def _opened(data: bytes) -> tuple[bytes, str, int, bytes]:
    """Give kind, robot, run and packed numbers of a message that came undamaged."""
    if len(data) > LONGEST:
        raise MessageError(f"a message of {len(data)} bytes is longer than any; it is damaged or foreign")
    if len(data) < HEAD.size + 10 or not data.startswith(MAGIC):
        raise MessageError(f"{len(data)} bytes that are no message of a fleet; who else publishes here?")
    _, version, kind, checksum = HEAD.unpack_from(data)
    if version != VERSION:
        raise MessageError(f"a message of version {version}, and this program knows {VERSION}; update the older side")
    body = data[HEAD.size :]
    if zlib.crc32(kind + body) != checksum:
        raise MessageError("a message whose checksum is wrong; it was damaged on its way")
    until = 1 + body[0]
    robot, run = body[1:until].decode("latin-1"), int.from_bytes(body[until : until + 8], "little")
    if len(body) < until + 8 or run >> RUN_BITS or NAME.fullmatch(robot) is None:
        raise MessageError("a message of nobody: its name or run is none; it is damaged or foreign")
    return kind, robot, run, body[until + 8 :]


def checksum(data: bytes) -> int:
    """Give the checksum of an encoded message, by which two can be told apart."""
    return int(HEAD.unpack_from(data)[3])


def _check_number(value: int, least: int = 0) -> None:
    if not least <= value < 1 << NUMBER_BITS:
        raise MessageError(f"{value} cannot be sent as a number of something")


def _put_number(writer: Writer, value: int, *, least: int = 0) -> None:
    _check_number(value, least)
    writer.put(_NUMBER, value - least)


def _take_number(reader: Reader, *, least: int = 0) -> int:
    value = reader.take(_NUMBER) + least
    if not least <= value < 1 << NUMBER_BITS:
        raise MessageError(f"it speaks of number {value}; it is damaged or foreign")
    return value


def _take_report(reader: Reader, robot: str, run: int) -> Report:
    return Report(robot, run, reader.take(-NUMBER_BITS), take_facts(reader))


def _put_status(writer: Writer, status: Status) -> None:
    _put_number(writer, status.reports)
    _put_number(writer, status.keyframe, least=-1)
    put_pose(writer, _POSE, status.pose, APART, TURN, _zeros())
    writer.put(-STAMP_BITS, in_steps(status.stamp, STAMP) + (1 << STAMP_BITS - 1))


def _take_status(reader: Reader, robot: str, run: int) -> Status:
    reports, keyframe = _take_number(reader), _take_number(reader, least=-1)
    pose = take_pose(reader, _POSE, APART, TURN, _zeros())
    return Status(
        robot, run, reports, keyframe, pose, bounded(reader.take(-STAMP_BITS) - (1 << STAMP_BITS - 1)) * STAMP
    )


def _put_answer(writer: Writer, answer: Answer) -> None:
    _put_number(writer, answer.received)
    for number in (answer.common, answer.keyframe):
        _put_number(writer, number, least=-1)
    writer.count(_MISSING, len(answer.missing), MOST_MISSING)
    last = answer.received
    for number in answer.missing:
        writer.put(_MISSING, number - last)
        last = number
    writer.count(_ROBOTS, len(answer.members), MOST_ROBOTS)
    for name in answer.members:
        letters = check_name(name).encode()
        writer.put(_ROBOTS, len(letters))
        for letter in letters:
            writer.put(-7, letter)
    put_pose(writer, _POSE, answer.pose, APART, TURN, _zeros())
    put_matrix(writer, _MATRIX, answer.covariance, _zeros())


def _take_answer(reader: Reader, robot: str, run: int) -> Answer:
    received, common, keyframe = _take_number(reader), _take_number(reader, least=-1), _take_number(reader, least=-1)
    missing, last = [], received
    for _ in range(reader.count(_MISSING, MOST_MISSING)):
        last = bounded(last + reader.take(_MISSING))
        missing.append(last)
    members = []
    for _ in range(reader.count(_ROBOTS, MOST_ROBOTS)):
        letters = [reader.take(-7) for _ in range(reader.count(_ROBOTS, 64))]
        members.append(check_name(bytes(letters).decode("ascii")))
    pose = take_pose(reader, _POSE, APART, TURN, _zeros())
    covariance = take_matrix(reader, _MATRIX, _zeros())
    return Answer(robot, run, received, tuple(missing), common, tuple(members), keyframe, pose, covariance)


def _zeros() -> Ints:
    return np.zeros(3, np.int64)
