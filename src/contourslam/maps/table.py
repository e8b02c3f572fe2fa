"""How a map file begins: what it is, and which arrays lie where. docs/map_file.md tells it to other programs."""

import io
import json
import math
import struct
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contourslam.errors import MapError
from contourslam.maps.layout import VERSION, layouts, misshapen, missing

MAGIC = b"\x8fCMAP\r\n\x1a"  # not text, and damaged by whatever takes it for text
PREAMBLE = struct.Struct("<8sII")  # magic, version, length of the header; the checksum of both follows
CHECKSUM = struct.Struct("<I")
HEADER_AT = PREAMBLE.size + CHECKSUM.size
MOST_HEADER = 1 << 20  # bytes
MOST_PACKED = 1032  # zlib makes nothing smaller than this part


@dataclass(frozen=True, slots=True)
class Section:
    """One array in the file: a line of the header's table.

    Attributes
    ----------
    name : str
        Part of the map and array, such as "corners.ids".
    dtype : str
        As NumPy writes it, little-endian.
    shape : tuple of int
    offset, stored : int
        First byte in the file, and how many.
    packing : str
        "none" or "zlib".
    checksum : int
        CRC-32 of the stored bytes.
    """

    name: str
    dtype: str
    shape: tuple[int, ...]
    offset: int
    stored: int
    packing: str
    checksum: int

    @property
    def size(self) -> int:
        """Bytes of the array."""
        return math.prod(self.shape) * np.dtype(self.dtype).itemsize


def damaged(path: Path, section: str, place: int, problem: str) -> MapError:
    """Give the error that names the file, the section and the byte."""
    return MapError(
        f"{path}: damaged in its section {section} at byte {place}: {problem}; take an older copy, or map anew"
    )


def header_text(about: dict[str, str], sections: list[Section]) -> bytes:
    """Give the header as it stands in the file."""
    table = [asdict(section) for section in sections]
    return json.dumps({"about": about, "sections": table}, separators=(",", ":")).encode()


def beginning(version: int, header: bytes) -> bytes:
    """Give everything that stands before the first array."""
    preamble = PREAMBLE.pack(MAGIC, version, len(header))
    return preamble + CHECKSUM.pack(zlib.crc32(header, zlib.crc32(preamble))) + header


def read_table(path: Path, file: io.BufferedReader) -> tuple[dict[str, str], list[Section]]:
    """Read what is said about the map and where its arrays lie, all of it checked; the file then stands at the first.

    Raises
    ------
    MapError
        If it is no map, damaged or of a newer version, or if its arrays are not those of its version.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    begin = file.read(HEADER_AT)
    if not begin or not begin.startswith(MAGIC[: len(begin)]):
        raise MapError(f"{path}: is no map of contourslam, it begins otherwise; `contourslam run` writes map.cmap")
    if len(begin) < HEADER_AT:
        raise damaged(path, "header", len(begin), "the file ends there")
    _, version, length = PREAMBLE.unpack_from(begin)
    if length > min(MOST_HEADER, size - HEADER_AT):
        raise damaged(path, "header", 0, "it cannot be as long as it says")
    text = file.read(length)
    if CHECKSUM.unpack_from(begin, PREAMBLE.size)[0] != zlib.crc32(text, zlib.crc32(begin[: PREAMBLE.size])):
        raise damaged(path, "header", 0, "its checksum is wrong")
    if version > VERSION:
        raise MapError(
            f"{path}: written by a newer contourslam (version {version} of the file, known up to {VERSION}); "
            "update contourslam"
        )
    try:
        header = json.loads(text)
        about, sections = header["about"], [_section(line) for line in header["sections"]]
        if version < 1 or not all(isinstance(value, str) for value in about.values()):
            raise ValueError("what it says about the map is no text, or its version 0")
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise damaged(path, "header", HEADER_AT, f"it cannot be understood ({error})") from error
    for problem in _wrong_arrays(version, sections):
        raise damaged(path, "header", HEADER_AT, problem)
    _check_places(path, sections, HEADER_AT + length, size)
    return about, sections


def _section(line: dict[str, Any]) -> Section:
    section = Section(**{**line, "shape": tuple(line["shape"])})
    numbers = (*section.shape, section.offset, section.stored, section.checksum)
    if not all(isinstance(text, str) for text in (section.name, section.dtype, section.packing)):
        raise ValueError("a name is no text")
    if not all(type(number) is int and 0 <= number < 1 << 62 for number in numbers):
        raise ValueError(f"a number of {section.name} is none")
    return section


def _wrong_arrays(version: int, sections: list[Section]) -> list[str]:
    """What is wrong with the arrays that a file says it holds."""
    known = layouts(version)
    names = [section.name for section in sections]
    wrong = [f"{name} comes more than once" for name in sorted(set(names)) if names.count(name) > 1]
    wrong += [
        f"there is no {section.name} of {section.dtype} in version {version}"
        for section in sections
        if section.name not in known or section.dtype != known[section.name][0]
    ]
    wrong += [f"{name} is missing" for name in missing(set(names), version)]
    shapes = {section.name: section.shape for section in sections}
    return wrong + [f"{name} {problem}" for name, problem in misshapen(shapes, version)]


def _check_places(path: Path, sections: list[Section], begin: int, size: int) -> None:
    """Hold the table against the size of the file, before any memory is taken."""
    for section in sections:
        if section.offset != begin:
            raise damaged(path, section.name, section.offset, f"it should begin at byte {begin}")
        begin += section.stored
        if begin > size:
            raise damaged(path, section.name, size, "the file ends there")
        most = {"none": section.stored, "zlib": MOST_PACKED * section.stored}.get(section.packing, -1)
        if section.size > most or (section.packing == "none" and section.size != section.stored):
            raise damaged(path, section.name, section.offset, "its length and its shape contradict each other")
    if begin != size:
        raise damaged(path, "end", begin, f"{size - begin} bytes follow that belong to nothing")
