import gzip
import lzma
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from contourslam.errors import RecordingError
from contourslam.recordings.text import number_rows, text_lines

Drain = Callable[[Iterator[Any]], tuple[list[Any], RecordingError | None]]
LINES = [f"{i} {i + 0.5} {i * 7919 % 1000}\n".encode() for i in range(20000)]


@pytest.mark.parametrize("pack", [bytes, gzip.compress, lzma.compress])
def test_the_content_tells_the_compression_whatever_the_suffix(tmp_path: Path, pack: Callable[[bytes], bytes]) -> None:
    path = tmp_path / "rows.txt"
    path.write_bytes(pack(b"".join(LINES)))
    assert [line for _, line in text_lines(path)] == LINES


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress])
@pytest.mark.parametrize("harm", ["cut", "corrupt"])
def test_the_lines_before_a_damage_in_compressed_data_come_first(
    tmp_path: Path, drain: Drain, pack: Callable[[bytes], bytes], harm: str
) -> None:
    data = bytearray(pack(b"".join(LINES)))
    half = len(data) // 2
    if harm == "cut":
        del data[half:]
    else:
        data[half : half + 200] = bytes(200)
    path = tmp_path / "rows"
    path.write_bytes(data)
    got, error = drain(text_lines(path))
    assert error is not None and f"after line {len(got)}" in str(error)
    # Neither format checks what it unpacks as it goes, so that a few wrong lines may come before the error.
    sound = len(got) if harm == "cut" else len(LINES) // 5
    assert sound >= len(LINES) // 5
    assert [line for _, line in got[:sound]] == LINES[:sound]
    assert [number for number, _ in got] == list(range(1, len(got) + 1))


def test_a_file_without_line_ends_is_refused_before_it_fills_the_memory(tmp_path: Path) -> None:
    path = tmp_path / "noise"
    path.write_bytes(b"x" * (3 * 2**20))
    with pytest.raises(RecordingError, match="line 1 is longer"):
        list(text_lines(path))


def test_missing_empty_and_folder_are_named(tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    for name, words in (("nowhere", "No such file"), ("empty", "is empty"), (".", "directory")):
        with pytest.raises(RecordingError, match=words) as caught:
            list(text_lines(tmp_path / name))
        assert str(tmp_path / name) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"1 2 3\n1 2\n", "line 2 has 2 values, expected 3"),
        (b"# head\n\n1 2 3\n1 two 3\n", "line 4"),
        (b"1 2 nan\n", "line 1 has a value that is not finite"),
        (b"# only a comment\n", "no row"),
        (b"1 2 3 4\n", "line 1 has 4 values, expected 3"),
        (b"1 2 3\n4 5 \x00\n", "line 2"),
    ],
)
def test_a_malformed_row_is_named_by_its_line(tmp_path: Path, text: bytes, words: str) -> None:
    path = tmp_path / "rows"
    path.write_bytes(text)
    with pytest.raises(RecordingError, match=words):
        number_rows(path, (3,))
