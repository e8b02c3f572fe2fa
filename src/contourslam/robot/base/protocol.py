"""The base's protocol, both ends: frames found in a stream of bytes, checked, decoded; and made.

The format is in docs/base_protocol.md. A frame is a body with its zeros taken out by COBS (Cheshire and Baker,
Consistent Overhead Byte Stuffing, IEEE/ACM Transactions on Networking 7, 1999) and a zero behind it; the body ends in
its CRC-32.
"""

import struct
import zlib
from collections import Counter
from dataclasses import dataclass

from contourslam.robot.base.messages import LAYOUTS, TO_HOST, HelloReply, Message, allowed, made, numbers

VERSION = 1
"""Of the protocol spoken here."""
BAUD = 115200
SHORTEST, LONGEST = 6, 64
"""Bytes of a body."""
_LONGEST_FRAME = LONGEST + 1  # without the zero behind it


class RefusedError(Exception):
    """A frame that must not be obeyed; `reason` as in docs/base_protocol.md, `sequence` where that can be trusted."""

    def __init__(self, reason: str, sequence: int | None = None) -> None:
        super().__init__(reason)
        self.reason, self.sequence = reason, sequence


@dataclass(frozen=True, slots=True)
class Received:
    """A frame that passed every check.

    Attributes
    ----------
    message : Message
    sequence : int
    begin, end : int
        Place of the frame's first byte and of the one behind its last, counted from the stream's beginning.
    """

    message: Message
    sequence: int
    begin: int
    end: int


def cobs_encode(body: bytes) -> bytes:
    """Take the zeros out of up to 254 bytes: each piece between them is written behind one more than its length."""
    if len(body) >= 255:
        raise ValueError(f"a body has at most 254 bytes here, not {len(body)}")
    return b"".join(bytes([len(piece) + 1]) + piece for piece in body.split(b"\0"))


def cobs_decode(coded: bytes) -> bytes | None:
    """Put the zeros back; None where a count reaches beyond the end, or a zero is in it."""
    pieces, at = [], 0
    while at < len(coded):
        step = coded[at]
        if step == 0 or at + step > len(coded):
            return None
        pieces.append(coded[at + 1 : at + step])
        at += step
    return b"\0".join(pieces) if pieces and b"\0" not in b"".join(pieces) else None


def encode(message: Message, sequence: int) -> bytes:
    """Make a frame, the zero behind it included.

    Raises
    ------
    ValueError
        If a value is out of its range.
    """
    code, layout = LAYOUTS[type(message)]
    if not allowed(message):
        raise ValueError(f"{message} has a value that the base would refuse")
    try:
        body = bytes([code, sequence % 256]) + layout.pack(*numbers(message))
    except struct.error as error:
        raise ValueError(f"{message} has a value that no frame can hold ({error})") from error
    return cobs_encode(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0"


def decode(coded: bytes, accepted: tuple[type[Message], ...] = TO_HOST) -> tuple[Message, int]:
    """Check and decode one frame.

    Parameters
    ----------
    coded : bytes
        Without the zero behind it.
    accepted : tuple of type
        Messages that are understood: ``TO_HOST`` or ``TO_BASE`` of :mod:`.messages`.

    Returns
    -------
    message : Message
    sequence : int

    Raises
    ------
    RefusedError
        If anything at all is wrong with it.
    """
    body = cobs_decode(coded)
    if body is None:
        raise RefusedError("cobs")
    if not SHORTEST <= len(body) <= LONGEST:
        raise RefusedError("short" if len(body) < SHORTEST else "long")
    if zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
        raise RefusedError("crc")
    code, sequence, payload = body[0], body[1], body[2:-4]
    kind = next((kind for kind in accepted if LAYOUTS[kind][0] == code), None)
    if kind is None:
        raise RefusedError("type", sequence)
    layout = LAYOUTS[kind][1]
    if len(payload) != layout.size:
        raise RefusedError("length", sequence)
    message = made(kind, layout.unpack(payload))
    if not allowed(message):
        raise RefusedError("value", sequence)
    return message, sequence


class Decoder:
    """Finds frames in a stream that comes in pieces of any size and may be damaged anywhere.

    A zero ends every frame, so that damage costs the frames it touches and no other.

    Parameters
    ----------
    accepted : tuple of type
        ``TO_HOST`` or ``TO_BASE`` of :mod:`.messages`.

    Attributes
    ----------
    good : int
        Frames that passed every check.
    refused : Counter
        Others, by reason.
    lost : int
        Frames that the sequence says are missing; refused ones are among them.
    received : int
        Bytes until now.
    """

    def __init__(self, accepted: tuple[type[Message], ...] = TO_HOST) -> None:
        self._accepted = accepted
        self.good = self.lost = self.received = 0
        self.refused: Counter[str] = Counter()
        self._rest, self._flooded = b"", False
        self._sequence: int | None = None

    def reset(self) -> None:
        """Forget a frame that has begun and the sequence, as after the port was opened anew."""
        self._rest, self._flooded, self._sequence = b"", False, None

    def feed(self, data: bytes) -> list[Received]:
        """Take the next bytes; give the frames that they complete.

        Parameters
        ----------
        data : bytes
            As they were read; any number of them.
        """
        end = self.received - len(self._rest)
        self.received += len(data)
        found: list[Received] = []
        *frames, self._rest = (self._rest + data).split(b"\0")
        for coded in frames:
            end += len(coded) + 1
            flooded, self._flooded = self._flooded, False
            if flooded or not coded:
                continue
            try:
                message, sequence = decode(coded, self._accepted)
            except RefusedError as refusal:
                self.refused[refusal.reason] += 1
                continue
            self.good += 1
            self._follow(message, sequence)
            found.append(Received(message, sequence, end - len(coded) - 1, end))
        if len(self._rest) > _LONGEST_FRAME:  # no frame any more; what comes up to the next zero belongs to it
            self.refused["long"] += not self._flooded
            self._rest, self._flooded = b"", True
        return found

    def _follow(self, message: Message, sequence: int) -> None:
        """Count what is missing; a base that greets has begun anew."""
        if self._sequence is not None and not isinstance(message, HelloReply):
            self.lost += (sequence - self._sequence - 1) % 256
        self._sequence = sequence
