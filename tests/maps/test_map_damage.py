"""A damaged map file is refused with the place, or nothing is wrong with it."""

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from contourslam.errors import MapError
from contourslam.maps import SavedMap, load_map, save_map

Make = Callable[..., SavedMap]
Same = Callable[[SavedMap, SavedMap], None]
Damage = Callable[[bytearray, np.random.Generator], None]


def places(content: bytearray, rng: np.random.Generator, longest: int) -> slice:
    """A range of bytes; in the first kilobytes, where the table stands, as often as anywhere."""
    until = len(content) if rng.random() < 0.5 else min(len(content), 6000)
    first = int(rng.integers(until))
    return slice(first, first + int(rng.integers(1, longest)))


def flip(content: bytearray, rng: np.random.Generator) -> None:
    content[places(content, rng, 2).start] ^= 1 << int(rng.integers(8))


def cut(content: bytearray, rng: np.random.Generator) -> None:
    del content[places(content, rng, 2).start :]


def cut_out(content: bytearray, rng: np.random.Generator) -> None:
    del content[places(content, rng, 600)]


def insert(content: bytearray, rng: np.random.Generator) -> None:
    at = places(content, rng, 600)
    content[at.start : at.start] = rng.bytes(at.stop - at.start)


def append(content: bytearray, rng: np.random.Generator) -> None:
    content += rng.bytes(int(rng.integers(1, 600)))


def overwrite(content: bytearray, rng: np.random.Generator) -> None:
    at = places(content, rng, 600)
    content[at] = rng.bytes(len(content[at]))


def zero(content: bytearray, rng: np.random.Generator) -> None:
    at = places(content, rng, 4097)
    content[at] = bytes(len(content[at]))


def swap(content: bytearray, rng: np.random.Generator) -> None:
    size = int(rng.choice([1, 4, 8, 512]))
    first, second = sorted(rng.choice(len(content) // size, 2, replace=False) * size)
    one, other = slice(first, first + size), slice(second, second + size)
    content[one], content[other] = content[other], content[one]


def digit(content: bytearray, rng: np.random.Generator) -> None:
    """Another digit in a number of the table."""
    digits = [i for i in range(20, 6000) if chr(content[i]).isdigit()]
    content[int(rng.choice(digits))] = ord("0") + int(rng.integers(10))


DAMAGES: tuple[Damage, ...] = (flip, flip, cut, cut_out, insert, append, overwrite, zero, swap, digit)


@pytest.mark.parametrize("part", range(10))
def test_of_1000_damaged_files_none_gives_another_map(tmp_path: Path, make_saved: Make, same: Same, part: int) -> None:
    saved = make_saved(part, landmarks=60, keyframes=40, points=1500)
    path = tmp_path / "x.cmap"
    save_map(path, saved)
    whole = path.read_bytes()
    assert 50_000 < len(whole) < 100_000
    refused = 0
    for seed in range(100):
        content = bytearray(whole)
        DAMAGES[seed % len(DAMAGES)](content, np.random.default_rng((part, seed)))
        path.write_bytes(content)
        try:
            loaded = load_map(path)
        except MapError as error:
            refused += 1
            assert str(path) in str(error)
            assert "\n" not in str(error)
        else:
            assert content == whole
            same(loaded, saved)
    assert refused > 90


def test_the_message_names_the_section_and_the_byte(tmp_path: Path, make_saved: Make) -> None:
    saved = make_saved(landmarks=60)
    path = tmp_path / "x.cmap"
    save_map(path, saved)
    whole = path.read_bytes()
    place = whole.index(saved.corners.positions.tobytes())
    path.write_bytes(whole[: place + 9] + bytes([whole[place + 9] ^ 1]) + whole[place + 10 :])
    with pytest.raises(MapError, match=rf"x\.cmap: damaged in its section corners\.positions at byte {place}: its"):
        load_map(path)
    path.write_bytes(whole[: place + 9])
    with pytest.raises(MapError, match=rf"in its section corners\.positions at byte {place + 9}: the file ends there"):
        load_map(path)
    path.write_bytes(whole + b"1234")
    with pytest.raises(MapError, match=rf"at byte {len(whole)}: 4 bytes follow"):
        load_map(path)


def test_a_damaged_file_takes_no_more_memory_than_a_whole_one(tmp_path: Path, make_saved: Make) -> None:
    path = tmp_path / "x.cmap"
    save_map(path, make_saved(landmarks=60, keyframes=40, points=1500))
    whole = path.read_bytes()

    def peak(content: bytes | bytearray) -> int:
        path.write_bytes(content)
        tracemalloc.start()
        try:
            load_map(path)
        except MapError:
            pass
        finally:
            most = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        return most

    peak(whole)
    usual = peak(whole)
    for seed in range(40):
        content = bytearray(whole)
        DAMAGES[seed % len(DAMAGES)](content, np.random.default_rng(seed))
        assert peak(content) < 1.5 * usual
