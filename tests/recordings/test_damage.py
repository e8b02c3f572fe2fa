"""Bags that are cut, corrupt, unfinished or no bags at all."""

import shutil
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from contourslam.errors import RecordingError
from contourslam.recordings import Message, open_recording, write_recording

Drain = Callable[[Iterator[Any]], tuple[list[Any], RecordingError | None]]
Same = Callable[[Message, Message], bool]
LONE = ("bag1", "bag1_bz2", "bag1_lz4", "lone_mcap", "lone_db3", "zstd_mcap")
FUZZ = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.differing_executors],
    deadline=None,
    max_examples=20,
)


@pytest.fixture(scope="module")
def many_messages(make_messages: Callable[[int], list[Message]]) -> list[Message]:
    """Enough for several chunks of a megabyte."""
    return make_messages(1100)


@pytest.fixture(scope="module")
def write_lone(
    tmp_path_factory: pytest.TempPathFactory,
    entries: Callable[[list[Message]], Iterator[Any]],
    make_bag: Callable[..., Path],
) -> Callable[[str, list[Message]], Path]:
    """Write a bag of one of the formats that are a single file."""

    def write(kind: str, messages: list[Message]) -> Path:
        folder = tmp_path_factory.mktemp(kind)
        if kind == "zstd_mcap":  # as our own writer makes it
            write_recording(folder / "run", messages)
            return folder / "run" / "run.mcap"
        return make_bag(kind, folder, entries(messages))

    return write


@pytest.fixture(scope="module")
def small_files(write_lone: Callable[[str, list[Message]], Path], messages: list[Message]) -> dict[str, Path]:
    return {kind: write_lone(kind, messages) for kind in LONE}


def read_until_damage(path: Path, drain: Drain) -> tuple[list[Message], RecordingError | None]:
    try:
        recording = open_recording(path)
    except RecordingError as error:
        assert str(path) in str(error) and "\n" not in str(error)
        return [], error
    return drain(recording.messages())


@pytest.mark.parametrize("kind", LONE)
def test_a_cut_bag_gives_what_comes_before_the_cut(
    write_lone: Callable[[str, list[Message]], Path],
    many_messages: list[Message],
    tmp_path: Path,
    drain: Drain,
    same: Same,
    kind: str,
) -> None:
    whole = write_lone(kind, many_messages)
    content = whole.read_bytes()
    path = tmp_path / whole.name
    found = []
    for share in (0.3, 0.6, 0.97, 0.9999):
        path.write_bytes(content[: int(share * len(content))])
        got, error = read_until_damage(path, drain)
        assert error is not None and str(path) in str(error)
        assert all(same(*pair) for pair in zip(got, many_messages, strict=False))
        found.append(len(got))
    assert found == sorted(found)
    # SQLite may need pages from the end of the file, and bz2 packs 900 kB into one block that is nothing if not whole.
    if kind != "lone_db3":
        assert found[1] > (0.2 if kind == "bag1_bz2" else 0.4) * len(many_messages)
    assert found[3] > 0.8 * len(many_messages)


@FUZZ
@given(st.data())
@pytest.mark.parametrize("kind", LONE)
def test_a_corrupt_bag_gives_what_comes_before_and_nothing_but_known_errors(
    small_files: dict[str, Path],
    tmp_path: Path,
    drain: Drain,
    messages: list[Message],
    kind: str,
    data: st.DataObject,
) -> None:
    content = bytearray(small_files[kind].read_bytes())
    # Half of the time in the last part, where the index lies.
    first = data.draw(st.sampled_from([0, len(content) * 9 // 10, len(content) - 200]))
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(first, len(content) - 1))
        patch = data.draw(st.binary(min_size=1, max_size=8))
        content[place : place + len(patch)] = patch
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content))) :]
    path = tmp_path / small_files[kind].name
    path.write_bytes(content)
    got, _ = read_until_damage(path, drain)
    assert len(got) <= len(messages) + 10


@FUZZ
@given(st.sampled_from([b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n", b"SQLite format 3\x00", b""]), st.binary(max_size=300))
@pytest.mark.parametrize("name", ["run.bag", "run.mcap", "run.db3"])
def test_any_bytes_are_refused_with_a_known_error(
    tmp_path: Path, drain: Drain, name: str, magic: bytes, content: bytes
) -> None:
    path = tmp_path / name
    path.write_bytes(magic + content)
    got, error = read_until_damage(path, drain)
    assert got == [] and error is not None


@pytest.mark.parametrize("kind", ["mcap", "sqlite3"])
def test_a_folder_without_metadata_is_read(
    messages: list[Message], entries: Any, make_bag: Any, tmp_path: Path, drain: Drain, kind: str
) -> None:
    path = make_bag(kind, tmp_path, entries(messages))
    (path / "metadata.yaml").unlink()
    assert drain(open_recording(path).messages())[1] is None
    assert len(list(open_recording(path).messages())) == len(messages)


def test_the_files_of_a_folder_without_metadata_follow_each_other_by_number(
    make_messages: Callable[[int], list[Message]], entries: Any, make_bag: Any, tmp_path: Path, drain: Drain
) -> None:
    messages = make_messages(60)
    folder = tmp_path / "split"
    folder.mkdir()
    for part, number in enumerate((0, 2, 10)):
        piece = make_bag("lone_mcap", tmp_path, entries(messages[part * 50 : part * 50 + 50]))
        piece.rename(folder / f"run_{number}.mcap")
        shutil.rmtree(tmp_path / "run")
    recording = open_recording(folder)
    stamps = [message.stamp for message in recording.messages()]
    assert stamps == [message.stamp for message in messages]
    assert {topic.name: topic.count for topic in recording.topics()}["/odom"] == 60
    # The recorder died: the last file is empty.
    (folder / "run_10.mcap").write_bytes(b"")
    got, error = drain(open_recording(folder).messages())
    assert [message.stamp for message in got] == stamps[:100]
    assert error is not None and "run_10.mcap: the file is empty" in str(error)


@pytest.mark.parametrize("content", ["", "a: b", "{", "\x00\x01", "rosbag2_bagfile_information: {version: 99}"])
def test_metadata_of_no_use_does_not_hide_the_messages(
    messages: list[Message], entries: Any, make_bag: Any, tmp_path: Path, drain: Drain, content: str
) -> None:
    path = make_bag("mcap", tmp_path, entries(messages))
    (path / "metadata.yaml").write_text(content)
    got, error = drain(open_recording(path).messages())
    assert len(got) == len(messages)
    assert error is not None and "metadata.yaml does not fit" in str(error)


def test_a_missing_file_of_a_folder_is_named(
    messages: list[Message], entries: Any, make_bag: Any, tmp_path: Path
) -> None:
    path = make_bag("mcap", tmp_path, entries(messages))
    (path / "run.mcap").unlink()
    with pytest.raises(RecordingError, match=r"run: .*missing.*run\.mcap"):
        open_recording(path)


def test_metadata_that_promises_more_than_there_is_ends_in_an_error(
    messages: list[Message], entries: Any, make_bag: Any, tmp_path: Path, drain: Drain
) -> None:
    path = make_bag("mcap", tmp_path, entries(messages))
    metadata = path / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("message_count: 20\n", "message_count: 25\n"))
    got, error = drain(open_recording(path).messages())
    assert len(got) == len(messages)
    assert error is not None and "only 100 of 105 messages" in str(error)


def test_a_bag_that_its_recorder_did_not_close_is_read_to_its_end(
    small_files: dict[str, Path], tmp_path: Path, drain: Drain, messages: list[Message]
) -> None:
    content = bytearray(small_files["bag1"].read_bytes())
    place = content.index(b"index_pos=") + len(b"index_pos=")
    content[place : place + 8] = bytes(8)
    path = tmp_path / "run.bag.active"
    path.write_bytes(content)
    got, error = drain(open_recording(path).messages())
    assert len(got) == len(messages)
    assert error is not None and "recorder did not close it" in str(error)


def test_messages_left_in_the_write_ahead_log_of_sqlite_are_mentioned(
    messages: list[Message], entries: Any, make_bag: Any, tmp_path: Path, drain: Drain
) -> None:
    path = make_bag("sqlite3", tmp_path, entries(messages))
    (path / "run.db3-wal").write_bytes(b"pages")
    got, error = drain(open_recording(path).messages())
    assert len(got) == len(messages)
    assert error is not None and "run.db3-wal" in str(error)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("photo.bag", b"\xff\xd8\xff\xe0\x00\x10JFIF" + bytes(400), "neither a rosbag"),
        ("empty.mcap", b"", "is empty"),
        ("words.db3", b"hello\n" * 3000, "neither a rosbag"),
        ("short.mcap", b"\x89MCAP0\r\n", "damaged before its first message"),
        ("old.bag", b"#ROSBAG V1.2\n" + bytes(100), "neither a rosbag1"),
    ],
)
def test_a_file_of_another_kind_is_refused_by_name_and_reason(
    tmp_path: Path, name: str, content: bytes, words: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=words) as caught:
        open_recording(path)
    assert str(path) in str(caught.value)


def test_missing_files_and_folders_that_are_no_bag_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="No such file"):
        open_recording(tmp_path / "nowhere.bag")
    with pytest.raises(RecordingError, match=r"the folder is no rosbag2: .*metadata\.yaml"):
        open_recording(tmp_path)


def test_a_database_of_another_program_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.db3"
    database = sqlite3.connect(path)
    database.execute("CREATE TABLE songs (name TEXT)")
    database.commit()
    database.close()
    with pytest.raises(RecordingError, match=r"other\.db3: damaged before its first message: no such table"):
        open_recording(path)
