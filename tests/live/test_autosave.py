"""Maps are written beside the work, no more often than they change, and the dearer they are the more rarely."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest

from contourslam.live.autosave import Autosave
from contourslam.maps.saved_map import SavedMap

MAP = cast("SavedMap", "a map")


class Disk:
    """Remembers what is written; holds the writer up until it is let go."""

    def __init__(self) -> None:
        self.written: list[tuple[Path, Any]] = []
        self.go_on = threading.Event()
        self.go_on.set()
        self.done = threading.Semaphore(0)

    def write(self, path: Path, saved: SavedMap) -> None:
        self.go_on.wait(10.0)
        self.written.append((path, saved))
        self.done.release()


@pytest.fixture
def disk() -> Iterator[Disk]:
    one = Disk()
    yield one
    one.go_on.set()


def test_the_first_map_is_due_after_a_period_and_not_before_it_changed(disk: Disk) -> None:
    saving = Autosave(Path("a.cmap"), 10.0, disk.write)
    assert not saving.due(1, 100.0)
    assert not saving.due(1, 109.9)
    assert not saving.due(0, 110.0)
    assert saving.due(1, 110.0)
    saving.hand_over(lambda: MAP, 1, 110.0)
    saving.close(lambda: MAP, 1, 111.0)
    assert disk.written == [(Path("a.cmap"), MAP)]
    assert saving.saved_at == 110.0


def test_a_slow_disk_holds_nobody_up_and_gets_one_map_at_a_time(disk: Disk) -> None:
    saving = Autosave(Path("a.cmap"), 10.0, disk.write)
    saving.due(0, 0.0)
    disk.go_on.clear()
    saving.hand_over(lambda: MAP, 1, 10.0)  # returns though nothing can be written
    assert not saving.due(2, 30.0)
    disk.go_on.set()
    assert disk.done.acquire(timeout=10.0)
    saving.close(lambda: MAP, 2, 31.0)  # writes the newer one
    assert len(disk.written) == 2
    assert saving.saved_at == 31.0


def test_a_map_that_takes_long_to_make_is_made_the_more_rarely(disk: Disk) -> None:
    saving = Autosave(Path("a.cmap"), 10.0, disk.write)
    saving.due(0, 0.0)
    saving.hand_over(lambda: MAP, 1, 10.0)
    saving.took(0.1, 10.0)
    assert disk.done.acquire(timeout=10.0)
    assert not saving.due(2, 29.9)
    while not saving.due(2, 30.0):  # the thread may not have ended yet
        pass
    saving.took(0.001, 30.0)  # cheap maps keep their period
    saving.hand_over(lambda: MAP, 2, 30.0)
    assert disk.done.acquire(timeout=10.0)
    while not saving.due(3, 40.0):
        pass
    saving.close(lambda: MAP, 2, 41.0)


@pytest.mark.parametrize("where", ["making", "writing"])
def test_a_failure_is_kept_for_the_diagnostics_and_tried_again_a_period_later(disk: Disk, where: str) -> None:
    def broken(*_: object) -> SavedMap:
        raise ValueError("no room")

    saving = Autosave(Path("a.cmap"), 10.0, broken if where == "writing" else disk.write)
    saving.due(0, 0.0)
    saving.hand_over(broken if where == "making" else lambda: MAP, 1, 10.0)
    while not saving.due(1, 20.0):
        pass
    assert saving.trouble == "no room"
    assert not saving.due(1, 19.9)
    saving.close(lambda: MAP, 1, 21.0)
    assert saving.trouble == ("" if where == "making" else "no room")


def test_what_is_set_aside_stands_beside_and_its_failure_ends_nothing(disk: Disk) -> None:
    saving = Autosave(Path("maps/a.cmap"), 10.0, disk.write)
    saving.set_aside(lambda: MAP)
    assert disk.written == [(Path("maps/previous-a.cmap"), MAP)]

    def broken() -> SavedMap:
        raise ValueError("no room")

    saving.set_aside(broken)
    assert saving.trouble == "no room"
    saving.close(lambda: MAP, 0, 1.0)
