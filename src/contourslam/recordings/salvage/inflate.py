"""Unpacking of a bag's chunks, as far as they go where they are damaged."""

import bz2
import importlib
import sys
from typing import Protocol

# Fed in pieces, so that what was unpacked before a damaged place is not lost with it.
_PIECE = 4096


class _Decompressor(Protocol):
    @property
    def eof(self) -> bool: ...

    def decompress(self, data: bytes, /) -> bytes: ...


def inflate(compression: str, packed: bytes) -> tuple[bytes, Exception | None]:
    """Unpack a chunk.

    Parameters
    ----------
    compression : str
        ``""``, ``bz2``, ``lz4`` or ``zstd``.
    packed : bytes

    Returns
    -------
    data : bytes
        What could be unpacked.
    damage : Exception or None
        Why it is not all, if so.
    """
    if compression == "":
        return packed, None
    decompressor = _decompressor(compression)
    data = bytearray()
    try:
        for start in range(0, len(packed), _PIECE):
            if decompressor.eof:
                break
            data += decompressor.decompress(packed[start : start + _PIECE])
    except Exception as error:  # each library has an exception of its own for damaged data
        return bytes(data), error
    return bytes(data), None if decompressor.eof else EOFError(f"a {compression} chunk is cut short")


def _decompressor(compression: str) -> _Decompressor:
    # zstd and lz4 come with rosbags, which uses the same modules; lz4 has no type stubs.
    decompressor: _Decompressor
    if compression == "bz2":
        decompressor = bz2.BZ2Decompressor()
    elif compression == "lz4":
        decompressor = importlib.import_module("lz4.frame").LZ4FrameDecompressor()
    elif compression == "zstd":
        name = "compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd"
        decompressor = importlib.import_module(name).ZstdDecompressor()
    else:
        raise ValueError(f"chunk compression {compression!r} is not known")
    return decompressor
