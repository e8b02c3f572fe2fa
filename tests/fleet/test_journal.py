"""What was acknowledged is on the disk: after a crash, on a full disk, and whatever else the file has been through."""

import errno
import os
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.errors import JournalError
from contourslam.fleet import journal as module
from contourslam.fleet.facts import Report, Status
from contourslam.fleet.journal import BEGINNING, RECORD, Journal, read_report
from contourslam.fleet.wire import encode

REPORTS = [encode(Report("robot1", 7, number, ())) + bytes(number) for number in range(5)]


def written(path: Path) -> Journal:
    journal = Journal(path)
    for report in REPORTS:
        journal.add(report)
    journal.settle()
    return journal


def test_what_was_added_is_there_for_the_next_process_and_goes_on(tmp_path: Path) -> None:
    written(tmp_path / "deep" / "a.facts")
    again = Journal(tmp_path / "deep" / "a.facts")
    assert list(again.reports()) == REPORTS
    again.add(b"more")
    assert list(Journal(again.path).reports()) == [*REPORTS, b"more"]
    assert again.trouble == ""


def test_a_journal_without_a_report_leaves_no_file(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "a.facts")
    journal.settle()
    assert list(journal.reports()) == list(tmp_path.iterdir()) == []


@settings(max_examples=40)
@given(st.data())
def test_cut_anywhere_all_whole_reports_are_kept_and_the_rest_is_told_of(
    tmp_path_factory: pytest.TempPathFactory, data: Any
) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.facts"
    written(path)
    whole, cut = path.read_bytes(), data.draw(st.integers(0, path.stat().st_size - 1))
    path.write_bytes(whole[:cut])
    journal = Journal(path)
    kept = list(journal.reports())
    ends = np.cumsum([len(BEGINNING), *(RECORD.size + len(report) for report in REPORTS)])
    assert kept == REPORTS[: max(int(np.searchsorted(ends, cut, side="right")) - 1, 0)]
    torn = cut not in (0, *ends)
    assert ("no whole report" in journal.trouble) == torn
    journal.add(b"goes on")
    assert list(Journal(path).reports()) == [*kept, b"goes on"]


@settings(max_examples=40)
@given(st.data())
def test_a_damaged_report_ends_what_is_believed_and_is_set_aside(
    tmp_path_factory: pytest.TempPathFactory, data: Any
) -> None:
    path = tmp_path_factory.mktemp("damaged") / "a.facts"
    written(path)
    whole = bytearray(path.read_bytes())
    at = data.draw(st.integers(len(BEGINNING), len(whole) - 1))
    whole[at] ^= 1 << data.draw(st.integers(0, 7))
    path.write_bytes(bytes(whole))
    journal = Journal(path)
    kept = list(journal.reports())
    assert kept == REPORTS[: len(kept)] and len(kept) < len(REPORTS)
    assert path.read_bytes() + path.with_suffix(".torn").read_bytes() == bytes(whole)
    assert "robot is asked" in journal.trouble


def test_what_is_no_journal_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "a.facts"
    path.write_bytes(b"somebody's diary")
    with pytest.raises(JournalError, match="is no journal"):
        Journal(path)
    assert path.read_bytes() == b"somebody's diary"


@pytest.mark.parametrize("room", [0, 3, 20])
def test_on_a_full_disk_nothing_is_added_and_all_goes_on_once_there_is_room(
    tmp_path: Path, room: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(file: FileIO, data: bytes) -> None:
        file.write(data[:room])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    journal = written(tmp_path / "a.facts")
    monkeypatch.setattr(module, "_write", full)
    with pytest.raises(JournalError, match=r"No space left on device\); free space"):
        journal.add(b"x" * 100)
    assert list(journal.reports()) == REPORTS
    monkeypatch.undo()
    journal.add(b"later")
    journal.settle()
    assert list(Journal(journal.path).reports()) == [*REPORTS, b"later"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a disk that is always full")
def test_the_very_first_report_on_a_full_disk_is_told_of(tmp_path: Path) -> None:
    path = tmp_path / "a.facts"
    journal = Journal(path)
    path.symlink_to("/dev/full")
    with pytest.raises(JournalError, match="No space left on device"):
        journal.add(b"x")


def test_a_disk_that_fails_is_told_of_before_anything_is_acknowledged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(descriptor: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    journal = Journal(tmp_path / "a.facts")
    journal.add(b"x")
    monkeypatch.setattr(module.os, "fsync", fails)
    with pytest.raises(JournalError, match="the disk fails"):
        journal.settle()


def test_the_name_of_a_new_file_is_on_the_disk_before_anything_is_acknowledged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settled = []
    monkeypatch.setattr(module, "settle_folder", settled.append)
    journal = written(tmp_path / "a.facts")
    journal.add(b"x")
    journal.settle()
    written(tmp_path / "a.facts")
    assert settled == [tmp_path]


def test_a_kept_record_that_is_no_report_is_told_of(tmp_path: Path) -> None:
    with pytest.raises(JournalError, match="cannot read"):
        read_report(tmp_path, b"nonsense")
    with pytest.raises(JournalError, match="no report"):
        read_report(tmp_path, encode(Status("a", 1, 0, -1, np.zeros(3), 0.0)))
