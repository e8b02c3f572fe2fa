"""Maps saved to files and loaded again, to the bit."""

import io
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from contourslam.atomic import replacing
from contourslam.errors import MapError
from contourslam.maps.consistency import problems
from contourslam.maps.layout import VERSION, Array, layouts, misshapen, to_arrays, to_map
from contourslam.maps.saved_map import SavedMap
from contourslam.maps.table import HEADER_AT, MOST_HEADER, Section, beginning, damaged, header_text, read_table
from contourslam.nearest import unreadable

SUFFIX = ".cmap"
PIECE = 1 << 18  # bytes that are packed at a time
SAMPLE, PAYS = 1 << 15, 0.8  # an array whose first bytes shrink to less than this part is packed
LONGEST = (1 << 53, 0xFFFFFFFF)  # numbers as long as they may get in the table


def save_map(path: Path, saved: SavedMap) -> None:
    """Write a map to a file, whole or not at all: a reader finds the map of before or this one at any moment.

    Parameters
    ----------
    path : Path
        What stands there is replaced once all of the new file is on the disk; its folder is made where needed.
    saved : SavedMap

    Raises
    ------
    MapError
        If the map contradicts itself, so that it could not be loaded again.
    ResultError
        If the file cannot be written.
    """
    arrays = _sound(path, saved)
    length, checksum = LONGEST
    blank = [Section(n, a.dtype.str, a.shape, length, length, "zlib", checksum) for n, a in arrays.items()]
    room = len(header_text(saved.about, blank))  # the true numbers are known only when all is written, and are shorter
    if room > MOST_HEADER:
        raise MapError(f"{path}: not saved, what is said about the map takes {room} bytes; leave some of it out")
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.seek(HEADER_AT + room)
        sections = [_write(file, name, array) for name, array in arrays.items()]
        file.seek(0)
        file.write(beginning(VERSION, header_text(saved.about, sections).ljust(room)))


def load_map(path: Path) -> SavedMap:
    """Read a map from a file of today's version or an older one.

    Parameters
    ----------
    path : Path

    Returns
    -------
    SavedMap
        Parts that an older version does not know are None; keyframes of version 1 count as one drive.

    Raises
    ------
    MapError
        If the file cannot be read, is no map, is damaged or of a newer version; it names the place. No more memory is
        taken than an undamaged file of this size could need.
    """
    try:
        with path.open("rb") as file:
            about, sections = read_table(path, file)
            arrays = {section.name: _read(path, file, section) for section in sections}
    except OSError as error:
        raise MapError(f"{unreadable(path, error)}; `contourslam run RECORDING -o DIR` writes maps") from error
    saved = to_map(arrays, about)
    places = {section.name: section.offset for section in sections}
    for name, problem in problems(saved):
        raise damaged(path, name, places.get(name, HEADER_AT), problem)
    return saved


def _sound(path: Path, saved: SavedMap) -> dict[str, Array]:
    """Arrays of a map that can be loaded again, in the byte order of the file."""
    arrays, wanted = to_arrays(saved), layouts(VERSION)
    for name, array in arrays.items():
        dtype = np.dtype(wanted[name][0])
        if not np.can_cast(array.dtype, dtype, "safe"):
            raise MapError(f"{path}: not saved, {name} holds {array.dtype}, which does not fit into {dtype.name}")
        arrays[name] = np.ascontiguousarray(array, dtype)
    shapes = {name: array.shape for name, array in arrays.items()}
    for check in (misshapen(shapes, VERSION), problems(saved)):
        for name, problem in check:
            raise MapError(f"{path}: not saved, for the map contradicts itself: {name} {problem}")
    return arrays


def _write(file: BinaryIO, name: str, array: Array) -> Section:
    """Write an array where the file stands."""
    offset, checksum = file.tell(), 0
    content = array.reshape(-1).view(np.uint8).data
    pays = len(zlib.compress(content[:SAMPLE], 1)) < PAYS * min(len(content), SAMPLE)
    for piece in _packed(content) if pays else (content,):
        checksum = zlib.crc32(piece, checksum)
        file.write(piece)
    stored = file.tell() - offset
    return Section(name, array.dtype.str, array.shape, offset, stored, "zlib" if pays else "none", checksum)


def _packed(content: memoryview) -> Iterator[bytes]:
    packer = zlib.compressobj(1)
    for at in range(0, len(content), PIECE):
        yield packer.compress(content[at : at + PIECE])
    yield packer.flush()


def _read(path: Path, file: io.BufferedReader, section: Section) -> Array:
    """Read one array, writable and in the machine's byte order."""
    content = np.empty(section.stored, np.uint8)
    if file.readinto(content.data) != section.stored or zlib.crc32(content.data) != section.checksum:
        raise damaged(path, section.name, section.offset, "its checksum is wrong")
    if section.packing == "zlib":
        content = _unpacked(path, section, content.data)
    if section.dtype == "|b1" and (content > 1).any():
        raise damaged(path, section.name, section.offset, "a truth value is neither 0 nor 1")
    array = content.view(section.dtype).reshape(section.shape)
    return array.astype(array.dtype.newbyteorder("="), copy=False)


def _unpacked(path: Path, section: Section, content: memoryview) -> Array:
    unpacker = zlib.decompressobj()
    try:
        out = unpacker.decompress(content, section.size + 1)  # never more than it should be, and one byte to tell
    except zlib.error as error:
        raise damaged(path, section.name, section.offset, f"it cannot be unpacked ({error})") from error
    if len(out) != section.size or not unpacker.eof or unpacker.unused_data:
        raise damaged(path, section.name, section.offset, f"it does not unpack to {section.size} bytes")
    return np.frombuffer(bytearray(out), np.uint8)
