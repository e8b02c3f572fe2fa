"""A file is whole or not there."""

import errno
import os
import resource
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from contourslam.atomic import ABANDONED, replacing, write_bytes, write_text
from contourslam.errors import ResultError


@contextmanager
def full_after(size: int) -> Iterator[None]:
    """Files may grow to so many bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.skipif(sys.platform != "linux", reason="limits the size of a file as Linux does")
def test_a_full_disk_is_said_and_the_old_file_stays(tmp_path: Path) -> None:
    path = tmp_path / "map.pgm"
    write_bytes(path, b"old")
    with full_after(1000), pytest.raises(ResultError, match=r"map\.pgm: cannot be written"):
        write_bytes(path, b"x" * 100_000)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_disk_that_turns_out_full_when_asked_to_settle_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "map.pgm"
    write_bytes(path, b"old")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ResultError, match="No space left on device"):
        write_bytes(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_two_writers_at_once_do_not_mix(tmp_path: Path) -> None:
    path = tmp_path / "map.txt"
    with replacing(path) as first, replacing(path) as second:
        assert first != second
        first.write_text("first" * 1000)
        second.write_text("second")
    assert path.read_text() == "first" * 1000  # its block ended last
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_killed_writer_left_goes_after_an_hour_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "map[1].txt"
    left, young = tmp_path / f".map[1].{'0f' * 8}.txt", tmp_path / f".map[1].{'1f' * 8}.txt"
    others = [tmp_path / name for name in (".map[1].backup.txt", f".map1.{'0f' * 8}.txt", f"map[1].{'0f' * 8}.txt")]
    old = time.time() - 2.0 * ABANDONED
    for file in (left, young, *others):
        file.touch()
        if file != young:
            os.utime(file, (old, old))
    write_text(path, "new")
    assert set(tmp_path.iterdir()) == {path, young, *others}
