import importlib
import os
import signal
import threading
from pathlib import Path

import pytest

from contourslam.errors import ContourslamError, MissingExtraError
from contourslam.experiments.parallel import Observer, each


@pytest.fixture
def work(monkeypatch):
    """Pieces of work in a module that other processes find, too."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    return importlib.import_module("parallel_work")


@pytest.fixture(autouse=True)
def ctrl_c_works():
    """A shell ignores Ctrl-C for what it starts in the background, and Python then leaves it so."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_the_items_and_every_step_is_told(work, jobs):
    told = []
    observer = Observer(progress=lambda done, total: told.append((done, total)))
    assert list(each(work.count_to_three, "abc", steps=3, jobs=jobs, observer=observer)) == [
        ("a", 3),
        ("b", 3),
        ("c", 3),
    ]
    assert told[-1] == (9, 9)
    assert told == sorted(told)


def test_a_stop_ends_the_work_after_a_step_and_keeps_what_is_done(work):
    told = []
    observer = Observer(progress=lambda done, total: told.append(done), stopped=lambda: len(told) >= 4)
    assert list(each(work.count_to_three, "abc", steps=3, jobs=1, observer=observer)) == [("a", 3), ("b", 1)]


def test_a_stop_reaches_other_processes(work):
    told = []
    observer = Observer(progress=lambda done, total: told.append(done), stopped=lambda: bool(told))
    results = list(each(work.slow_steps, "ab", steps=200, jobs=2, observer=observer))
    assert [item for item, _ in results] in (["a", "b"], ["a"], ["b"])
    assert all(0 < done < 200 for _, done in results)


def test_ctrl_c_keeps_what_other_processes_have_done(work):
    def press(done, total):
        if done and not pressed:
            pressed.append(done)
            threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()

    pressed = []
    results = list(each(work.slow_steps, "ab", steps=200, jobs=2, observer=Observer(progress=press)))
    assert pressed
    assert results
    assert all(0 < done < 200 for _, done in results)


def test_ctrl_c_in_this_process_keeps_the_items_before(work):
    assert list(each(work.interrupt, [0, 1, 2], steps=1, jobs=1)) == [0]


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_comes_through_as_it_was_raised(work, jobs):
    with pytest.raises(MissingExtraError, match="not installed"):
        list(each(work.fail, [0, 1, 2], steps=1, jobs=jobs))


def test_a_process_that_dies_is_a_known_failure(work):
    with pytest.raises(ContourslamError, match="Try fewer jobs"):
        list(each(work.die, [0, 1], steps=1, jobs=2))
