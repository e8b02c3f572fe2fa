"""The YDLidar X4's packets: found in a stream of bytes, checked, decoded; and made, for a simulated one.

The format is in docs/ydlidar_x4.md (YDLIDAR X4 development manual, "scan command").
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

HEADER = b"\xaa\x55"
HEAD = 10  # bytes before the samples
LONGEST = HEAD + 2 * 255
_FULL_TURN = 360 * 64  # an angle's highest value once its check bit is shifted out


@dataclass(frozen=True, slots=True)
class Packets:
    """Packets in the order of the stream.

    Attributes
    ----------
    sound : ndarray of bool, shape (k,)
        Its checksum is right.
    starts : ndarray of bool, shape (k,)
        A turn starts with this packet.
    first_deg, last_deg : ndarray, shape (k,)
        Uncorrected direction of the first and last sample, degrees, clockwise.
    counts : ndarray of int, shape (k,)
        Samples of each packet.
    raw : ndarray of uint16, shape (m,)
        Distances of all samples one after the other, quarters of a millimetre; 0 is no return.
    begins, ends : ndarray of int, shape (k,)
        Place of the packet's first byte and of the one after its last, counted from the stream's beginning.
    """

    sound: NDArray[np.bool_]
    starts: NDArray[np.bool_]
    first_deg: Floats
    last_deg: Floats
    counts: NDArray[np.int64]
    raw: NDArray[np.uint16]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.counts)


class PacketParser:
    """Finds packets in a stream that comes in pieces of any size and may be damaged anywhere.

    What is no packet is passed over; after damage the search goes on two bytes behind the header that failed, so
    that a damaged length never costs a sound packet. At most one packet's length of bytes is kept between calls.

    Attributes
    ----------
    good, bad : int
        Packets that passed their checksum, and headers behind which none did.
    received : int
        Bytes until now.
    skipped : int
        Bytes among them that belong to no good packet.
    """

    def __init__(self, *, salvage: bool = False) -> None:
        self._salvage = salvage
        self.good = self.bad = self.received = self.skipped = 0
        self._rest = b""

    def reset(self) -> None:
        """Forget a packet that has begun, as after the port was opened anew."""
        self.skipped += len(self._rest)
        self._rest = b""

    def feed(self, data: bytes) -> Packets:
        """Take the next bytes.

        Parameters
        ----------
        data : bytes
            As they were read; any number of them.

        Returns
        -------
        Packets
            Those that these bytes complete, perhaps none.
        """
        buffer = self._rest + data if self._rest else data
        origin = self.received - len(self._rest)
        self.received += len(data)
        found: list[tuple[int, bool, NDArray[np.uint16]]] = []
        at, useful, good = 0, 0, 0
        while True:
            begin = buffer.find(HEADER, at)
            if begin < 0:
                at = len(buffer) - buffer.endswith(HEADER[:1])
                break
            at = begin
            if len(buffer) - begin < HEAD:
                break
            if not _sound_head(buffer, begin):
                self.bad += 1
                at = begin + 2
                continue
            size = HEAD + 2 * buffer[begin + 3]
            if len(buffer) - begin < size:
                break
            words = np.frombuffer(buffer, "<u2", size // 2, begin)
            end = begin + size
            if np.bitwise_xor.reduce(words):  # the checksum is the XOR of all other words
                if self._salvage and len(buffer) < end + len(HEADER):
                    break
                self.bad += 1
                # A header inside would be a sound packet's, behind a damaged length: the X4's samples never look so.
                framed = self._salvage and buffer.find(HEADER, begin + 2, end + len(HEADER)) == end
                if framed:
                    found.append((origin + begin, False, words))
                at = end if framed else begin + 2
                continue
            found.append((origin + begin, True, words))
            useful, good, at = useful + size, good + 1, end
        self._rest = bytes(buffer[at:])
        self.skipped += at - useful
        self.good += good
        return _decoded(found)


def _sound_head(buffer: bytes, at: int) -> bool:
    """Whether a head could be one: samples in it, check bits of both angles set, angles below a full turn."""
    count, first, last = buffer[at + 3], buffer[at + 4] | buffer[at + 5] << 8, buffer[at + 6] | buffer[at + 7] << 8
    sound = count > 0 and first & last & 1 == 1 and first >> 1 <= _FULL_TURN and last >> 1 <= _FULL_TURN
    return sound and (count > 1 or first == last)


def _decoded(found: Sequence[tuple[int, bool, NDArray[np.uint16]]]) -> Packets:
    heads = np.array([words[:5] for _, _, words in found], dtype=np.int64).reshape(-1, 5)
    samples = [words[5:] for _, _, words in found]
    begins = np.array([begin for begin, _, _ in found], dtype=np.int64)
    counts = heads[:, 1] >> 8
    return Packets(
        np.array([sound for _, sound, _ in found], dtype=np.bool_),
        (heads[:, 1] & 1).astype(np.bool_),
        angle_deg(heads[:, 2]),
        angle_deg(heads[:, 3]),
        counts,
        np.concatenate(samples) if samples else np.empty(0, dtype=np.uint16),
        begins,
        begins + HEAD + 2 * counts,
    )


def angle_deg(raw: ArrayLike) -> Floats:
    """Angle of a packet's head, degrees, clockwise: the lowest bit is a check bit, the rest 64ths of a degree."""
    return (np.asarray(raw, dtype=np.int64) >> 1) / 64.0


def distance_mm(raw: ArrayLike) -> Floats:
    """Distance of a sample, mm."""
    return np.asarray(raw, dtype=np.float64) / 4.0


def correction_deg(mm: ArrayLike) -> Floats:
    """What is added to a sample's angle, for the laser sits beside the axis it turns about.

    Parameters
    ----------
    mm : array_like, shape (n,)
        Distances, mm.

    Returns
    -------
    ndarray, shape (n,)
        Degrees; 0 where there is no return (YDLIDAR X4 development manual, "second-level analysis").
    """
    d = np.asarray(mm, dtype=np.float64)
    safe = np.where(d > 0.0, d, 1.0)
    return np.where(d > 0.0, np.degrees(np.arctan(21.8 * (155.3 - safe) / (155.3 * safe))), 0.0)


def spans_deg(packets: Packets) -> Floats:
    """Angle from the first to the last sample of each packet, degrees; a head that stands still may shake backwards."""
    span = (packets.last_deg - packets.first_deg) % 360.0
    return np.where(span > 300.0, span - 360.0, span)


def encode_packet(first_deg: float, last_deg: float, mm: ArrayLike, *, start: bool = False) -> bytes:
    """Make a packet, as the lidar does.

    Parameters
    ----------
    first_deg, last_deg : float
        Uncorrected direction of the first and last sample, degrees, clockwise.
    mm : array_like, shape (n,)
        Distances, mm; 0 is no return. From 1 to 255 of them.
    start : bool
        A turn starts with this packet.

    Returns
    -------
    bytes
    """
    raw = np.rint(np.asarray(mm, dtype=np.float64)).astype(np.uint16) * 4  # the lidar has whole millimetres
    if not 0 < raw.size < 256:
        raise ValueError(f"a packet has 1 to 255 samples, not {raw.size}")
    angles = [round(angle % 360.0 * 64.0) % _FULL_TURN << 1 | 1 for angle in (first_deg, last_deg)]
    words = np.concatenate([[0x55AA, start | raw.size << 8, *angles, 0], raw]).astype("<u2")
    words[4] = np.bitwise_xor.reduce(words)
    return words.tobytes()
