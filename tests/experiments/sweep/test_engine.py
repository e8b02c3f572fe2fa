"""What keeps a sweep from beginning is told in a line."""

import socket

import pytest

from contourslam.errors import ConfigError, ContourslamError
from contourslam.experiments.sweep import engine
from contourslam.experiments.sweep.engine import Outcome, sweep
from contourslam.experiments.sweep.store import Store

ROOM = '[simulation]\nrooms = "furnished_room"\nduration = 1.0\n'


def test_nothing_to_do_starts_nothing(tmp_path):
    assert sweep([], Store(str(tmp_path))) == Outcome(0, 0, True)


def test_a_place_that_workers_cannot_see_is_refused(planned):
    with pytest.raises(ConfigError, match="is seen by one process alone"):
        sweep(planned(ROOM), Store("memory://here"))


def test_a_scheduler_that_does_not_answer_is_told(planned, tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "_PATIENCE", 0.5)
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{unused.getsockname()[1]}"
        with pytest.raises(ContourslamError, match="no Dask scheduler answers at"):
            sweep(planned(ROOM), Store(str(tmp_path)), scheduler=address)


def test_an_address_that_is_none_is_told(planned, tmp_path, monkeypatch):
    with pytest.raises(ContourslamError, match="no Dask scheduler answers at nowhere"):
        sweep(planned(ROOM), Store(str(tmp_path)), scheduler="nowhere://1:2")
