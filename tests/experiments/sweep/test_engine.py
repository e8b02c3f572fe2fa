"""What keeps a sweep from beginning is told in a line."""

import contextlib
import multiprocessing
import signal
import socket
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest

from contourslam.errors import ConfigError, ContourslamError
from contourslam.experiments.parallel import Observer
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
    with pytest.raises(ContourslamError, match=r"no Dask scheduler answers at nowhere.*unknown address scheme"):
        sweep(planned(ROOM), Store(str(tmp_path)), scheduler="nowhere://1:2")


@pytest.mark.parametrize("said", [b"", b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\n\r\n" * 20])
def test_what_listens_and_is_no_dask_is_told(planned, tmp_path, monkeypatch, said):
    monkeypatch.setattr(engine, "_PATIENCE", 0.5)
    heard, notes = [], []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer():
            with contextlib.suppress(OSError):
                heard.append(server.accept()[0])
                heard[0].sendall(said)

        answering = threading.Thread(target=answer)
        answering.start()
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(ContourslamError, match=f"no Dask scheduler answers at {address}") as error:
            sweep(planned(ROOM), Store(str(tmp_path)), scheduler=address, say=notes.append)
        answering.join()
        heard[0].close()
    assert "\n" not in str(error.value)
    assert notes == [f"connecting to {address}"]


def test_ctrl_c_ends_the_connecting(planned, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        stopped = Observer(stopped=lambda: True)
        found = sweep(planned(ROOM), Store(str(tmp_path)), scheduler=address, observer=stopped)
    assert found == Outcome(0, 0, False)


def test_a_process_of_a_sweep_never_hears_ctrl_c_from_its_first_moment():
    process = multiprocessing.get_context("spawn").Process(target=signal.raise_signal, args=(signal.SIGINT,))
    engine._deaf_to_ctrl_c(process.start)
    process.join(30.0)
    assert process.exitcode == 0
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_why_processes_do_not_start_is_told_to_who_starts_them():
    def fail():
        raise OSError("too many processes")

    with pytest.raises(OSError, match="too many"):
        engine._deaf_to_ctrl_c(fail)


def test_a_command_that_finds_no_scheduler_ends(tmp_path):
    (tmp_path / "experiment.toml").write_text(f'name = "test"\n{ROOM}')
    line = [sys.executable, "-m", "contourslam", "sweep", "experiment.toml", "-o", "results", "--scheduler", "garbage"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines()[1:] == [
        "contourslam: error: no Dask scheduler answers at garbage (missing port number in address 'garbage'); "
        "start one with `dask scheduler`"
    ]


def test_a_sweep_without_a_worker_says_so_once(tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "_LOOK", 0.0)
    workers, notes = iter([{"a": 1}, {}, {}, {"b": 1}]), []
    client = SimpleNamespace(scheduler=SimpleNamespace(ncores=None), sync=lambda *_, **__: next(workers))
    session = engine._Session(client, Store(str(tmp_path)), Observer(), notes.append)
    for _ in range(4):
        session._look_for_workers()
    assert notes == ["no worker is left; waiting for one to come", "workers are there again"]
