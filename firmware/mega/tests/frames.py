"""The protocol of the base, written from docs/base_protocol.md, for these tests."""

import struct
import zlib
from dataclasses import dataclass

TO_BASE = {"DRIVE": (0x01, "<ii"), "STOP": (0x02, "<"), "TUNE": (0x03, "<ffff"), "HELLO": (0x04, "<")}
TO_HOST = {"STATE": (0x81, "<Iii3h3h3hHhhBB"), "ACK": (0x82, "<BB"), "HELLO_REPLY": (0x83, "<BBBBHHBBffff")}
FIELDS = {
    "DRIVE": ("left", "right"),
    "STOP": (),
    "TUNE": ("kp", "ki", "kd", "feed_forward"),
    "HELLO": (),
    "STATE": (
        *("time_us", "ticks_left", "ticks_right"),
        *(f"{sensor}_{axis}" for sensor in ("gyro", "accel", "compass") for axis in "xyz"),
        *("battery_mV", "duty_left", "duty_right", "last_command_sequence", "flags"),
    ),
    "ACK": ("of", "result"),
    "HELLO_REPLY": (
        *("protocol", "major", "minor", "patch", "state_period", "watchdog", "imu_kind", "reset_cause"),
        *("kp", "ki", "kd", "feed_forward"),
    ),
}


@dataclass(frozen=True, slots=True)
class Message:
    """A message as it was decoded; fields are named as in the document."""

    name: str
    sequence: int
    fields: dict[str, int | float]


def cobs(body: bytes) -> bytes:
    pieces = body.split(b"\0")
    return b"".join(bytes([len(piece) + 1]) + piece for piece in pieces)


def uncobs(code: bytes) -> bytes | None:
    pieces = []
    while code:
        count = code[0]
        if not 0 < count <= len(code):
            return None
        pieces.append(code[1:count])
        code = code[count:]
    return b"\0".join(pieces)


def body(kind: int, sequence: int, payload: bytes) -> bytes:
    start = bytes([kind, sequence]) + payload
    return start + struct.pack("<I", zlib.crc32(start))


def framed(body: bytes) -> bytes:
    return cobs(body) + b"\0"


def frame(name: str, sequence: int, *values: float) -> bytes:
    kind, layout = (TO_BASE | TO_HOST)[name]
    return framed(body(kind, sequence, struct.pack(layout, *values)))


def decode(code: bytes) -> Message | None:
    """Message of a frame without its last zero, or None."""
    whole = uncobs(code)
    if whole is None or not 6 <= len(whole) <= 64 or zlib.crc32(whole[:-4]) != struct.unpack("<I", whole[-4:])[0]:
        return None
    for name, (kind, layout) in (TO_BASE | TO_HOST).items():
        if kind == whole[0] and struct.calcsize(layout) == len(whole) - 6:
            values = struct.unpack(layout, whole[2:-4])
            return Message(name, whole[1], dict(zip(FIELDS[name], values, strict=True)))
    return None


class Receiver:
    """Bytes to messages; counts the frames that were refused."""

    def __init__(self) -> None:
        self.rest, self.refused = b"", 0

    def push(self, data: bytes) -> list[Message]:
        *codes, self.rest = (self.rest + data).split(b"\0")
        messages = [decode(code) for code in codes if code]
        self.refused += messages.count(None)
        return [message for message in messages if message is not None]
