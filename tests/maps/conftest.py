"""Maps made by chance, files written byte by byte, and what makes two maps the same."""

import dataclasses
import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.maps import Contoured, Relations, SavedMap, Seen, Stretches
from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]
Same = Callable[[SavedMap, SavedMap], None]
Make = Callable[..., SavedMap]
WriteFile = Callable[..., None]
# What a file must give back although arithmetic seldom makes it.
ODD = (0.0, -0.0, 5e-324, -1e-310, 1.7e308, np.nextafter(1.0, 2.0), -np.pi)


def covariances(rng: np.random.Generator, *shape: int) -> Floats:
    """Symmetric to the bit, and positive."""
    half = rng.normal(size=shape)
    return half @ half.swapaxes(-1, -2) + np.eye(shape[-1])


def numbers(rng: np.random.Generator, *shape: int) -> Floats:
    return np.where(rng.random(shape) < 0.2, rng.choice(ODD, shape), rng.normal(0.0, 30.0, shape))


def starts(rng: np.random.Generator, count: int, total: int) -> NDArray[np.int64]:
    return np.array([0, *np.sort(rng.integers(0, total + 1, max(count - 1, 0))), *([total] if count else [])])


def make_saved(
    seed: int = 0, *, landmarks: int = 7, keyframes: int | None = 6, points: int = 40, graph: bool = True
) -> SavedMap:
    """A map of any size; without keyframes where these are None, and without what binds them where `graph` is off."""
    rng = np.random.default_rng(seed)
    c = int(rng.integers(landmarks + 1))
    w, ids, given = landmarks - c, rng.permutation(landmarks + 3)[:landmarks], landmarks + 3
    corners = CornerMap(
        ids[:c], numbers(rng, c, 2), covariances(rng, c, 2, 2), numbers(rng, c), rng.uniform(0.1, 3.0, c),
        rng.random(c) < 0.5, rng.integers(0, 99, c), rng.integers(0, 99, c),
    )  # fmt: skip
    walls = WallMap(
        ids[c:], numbers(rng, w, 2, 2), covariances(rng, w, 2, 2, 2), numbers(rng, w), covariances(rng, w, 2, 2),
        rng.integers(0, 99, w), rng.integers(0, 99, w),
    )  # fmt: skip
    about = {"recording": "bürö.log", "made": str(seed), "note": '"\\\n\0\ud800'}
    if keyframes is None:
        return SavedMap(corners, walls, about=about)
    k, n = keyframes, points if keyframes else 0
    contoured = Contoured(
        numbers(rng, k), numbers(rng, k, 3), covariances(rng, k, 3, 3), rng.uniform(0.0, 1.0, k), starts(rng, k, n),
        rng.normal(size=(n, 4)).astype(np.float32), np.sort(rng.integers(0, 2, k)) if k > 1 else np.zeros(k, np.int64),
    )  # fmt: skip
    contoured.drives[:1] = 0
    if not graph:
        return SavedMap(corners, walls, contoured, about=about)
    r, s, p = (2 * k, 3 * k, k // 2) if k > 1 else (0, 0, 0)
    first = rng.integers(-1, k, r) if k else np.zeros(0, np.int64)
    second = (first + 1 + rng.integers(0, max(k - 1, 1), r)) % k if k else first
    robust = np.where(rng.random(r) < 0.5, np.nan, 3.0)
    relations = Relations(first, second, numbers(rng, r, 3), covariances(rng, r, 3, 3), robust, rng.random(r) < 0.3)
    rows = rng.normal(size=(s, 13)).astype(np.float32)
    rows[:, 0] = rng.random(s) < 0.5
    keys = np.sort(rng.integers(0, max(k, 1), s)).astype(np.int32)
    seen = Seen(keys, rng.integers(-1, given, s).astype(np.int32), rows, rng.integers(0, 50, given))
    stretches = Stretches(
        rng.integers(0, max(k, 1), p), starts(rng, p, 2 * p), rng.integers(0, max(k, 1), 2 * p), numbers(rng, 2 * p, 3)
    )
    return SavedMap(corners, walls, contoured, relations, seen, stretches, about)


def parts_of(saved: SavedMap) -> dict[str, Any]:
    """Every array by its name in the file."""
    parts = {field.name: getattr(saved, field.name) for field in dataclasses.fields(saved) if field.name != "about"}
    return {
        f"{part}.{field.name}": getattr(values, field.name)
        for part, values in parts.items()
        if values is not None
        for field in dataclasses.fields(values)
    }


def assert_same(first: SavedMap, second: SavedMap) -> None:
    """Equal to the bit, NaN and minus zero too."""
    a, b = parts_of(first), parts_of(second)
    assert a.keys() == b.keys()
    assert first.about == second.about
    for name, array in a.items():
        assert (array.dtype, array.shape) == (b[name].dtype, b[name].shape), name
        assert array.tobytes() == b[name].tobytes(), name


def write_file(
    path: Path,
    arrays: dict[str, Any],
    *,
    version: int = 2,
    about: Any = None,
    change: Callable[[dict[str, Any]], None] = lambda header: None,
    packed: tuple[str, ...] = (),
) -> None:
    """A file as docs/map_file.md says, without the package; `change` may spoil the header before it is sealed."""
    stored = {n: zlib.compress(a.tobytes()) if n in packed else a.tobytes() for n, a in arrays.items()}
    room = 400 + 200 * len(arrays)
    offset, table = 20 + room, []
    for name, array in arrays.items():
        table.append(
            {
                "name": name,
                "dtype": array.dtype.newbyteorder("<").str,
                "shape": list(array.shape),
                "offset": offset,
                "stored": len(stored[name]),
                "packing": "zlib" if name in packed else "none",
                "checksum": zlib.crc32(stored[name]),
            }
        )
        offset += len(stored[name])
    header = {"about": {} if about is None else about, "sections": table}
    change(header)
    text = json.dumps(header).encode().ljust(room)
    begin = struct.pack("<8sII", b"\x8fCMAP\r\n\x1a", version, len(text))
    path.write_bytes(begin + struct.pack("<I", zlib.crc32(begin + text)) + text + b"".join(stored.values()))


@pytest.fixture(name="make_saved")
def _make_saved() -> Make:
    return make_saved


@pytest.fixture(name="same")
def _same() -> Same:
    return assert_same


@pytest.fixture(name="parts")
def _parts() -> Callable[[SavedMap], dict[str, Any]]:
    return parts_of


@pytest.fixture(name="write_file")
def _write_file() -> WriteFile:
    return write_file
