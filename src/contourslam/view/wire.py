"""Messages to the page: a header in JSON and arrays as they lie in memory, which a browser reads without parsing."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

ALIGNED = 8  # bytes; where each array begins, so that the browser may look at it in place
CODES = {"float32": "f4", "float64": "f8", "int32": "i4", "uint32": "u4", "int16": "i2", "uint8": "u1"}


def pack(kind: str, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] | None = None) -> bytes:
    """Give one message.

    It holds the length of the header (u32), the header, and the arrays, all little-endian; the header's ``arrays``
    tells of each its type, where it begins after the header, and how many numbers it has.

    Parameters
    ----------
    kind : str
        What the message is about.
    header : mapping
        Plain values; what is not finite becomes null, which JSON knows.
    arrays : mapping of str to ndarray, optional
        Of the types in `CODES`.
    """
    places: dict[str, tuple[str, int, int]] = {}
    pieces: list[bytes] = []
    at = 0
    for name, values in (arrays or {}).items():
        data = np.ascontiguousarray(values).tobytes()
        places[name] = CODES[values.dtype.name], at, values.size
        padding = -len(data) % ALIGNED
        pieces += [data, bytes(padding)]
        at += len(data) + padding
    text = _dump({"kind": kind, **header, "arrays": places}).encode()
    text += b" " * (-(len(text) + 4) % ALIGNED)
    return b"".join([len(text).to_bytes(4, "little"), text, *pieces])


def _dump(values: dict[str, Any]) -> str:
    try:  # most headers hold nothing that has to be looked for
        return json.dumps(values, separators=(",", ":"), allow_nan=False, default=_listed)
    except ValueError:
        return json.dumps(plain(values), separators=(",", ":"))


def _listed(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return dict(value)


def plain(value: Any) -> Any:
    """Give a value as JSON knows it: lists for arrays, null for what is not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value
