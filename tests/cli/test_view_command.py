import http.client
import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from websockets.sync.client import connect

COMMAND = [sys.executable, "-m", "contourslam", "view", "--port", "0"]


def test_it_serves_the_page_until_ctrl_c_and_then_ends_well(log: Path) -> None:
    with subprocess.Popen(
        [*COMMAND, str(log), "--speed", "inf", "--detectors", "matched_filter,wu"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            url = process.stdout.readline().strip()
            port = int(re.fullmatch(r"http://127\.0\.0\.1:(\d+)/", url)[1])
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
            connection.request("GET", "/")
            assert b"<title>contourslam</title>" in connection.getresponse().read()
            connection.close()
            with connect(f"ws://127.0.0.1:{port}/ws", max_size=None) as page:
                hello = page.recv(timeout=60)
                about = json.loads(hello[4 : 4 + int.from_bytes(hello[:4], "little")])["about"]
                assert about["title"] == log.name
                assert about["lanes"] == ["matched_filter", "wu"]
                process.send_signal(signal.SIGINT)  # while a page is open
                assert process.wait(30) == 0
            assert "Ctrl-C" in process.stderr.read()
        finally:
            process.kill()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--detectors", "wu,wu"], "each once"),
        (["--detectors", "nobody"], "there is no detector 'nobody'"),
        (["--speed", "0"], "--speed must be above 0"),
        (["--port", "70000"], "--port must lie"),
        (["--host", "203.0.113.7", "--port", "0"], "cannot be served at 203.0.113.7"),
        (["--host", "203.0.113.7", "--port", "0"], "choose another --host, or another --port"),
        (["--overwrite"], "--overwrite replaces the file of --rerun"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    log: Path, failure: Callable[..., str], options: list[str], said: str
) -> None:
    assert said in failure("view", log, *options)


def test_a_recording_or_the_robot_is_wanted_and_not_both(log: Path, failure: Callable[..., str]) -> None:
    assert "name a recording, or --live for the robot" in failure("view")
    assert "a recording and --live do not go together" in failure("view", log, "--live")
    assert "leave it out for a recording" in failure("view", log, "--robot", "robot.yaml")
    said = failure("view", "--live", "--paused", "--detectors", "wu", "--scan-topic", "scan")
    assert "--detectors and --paused and --scan-topic are for recordings" in said
    assert "--overwrite are for recordings" in failure("view", "--live", "--overwrite")
    assert "robot.yaml: cannot be read" in failure("view", "--live", "--robot", "robot.yaml")
    assert "cannot be served at 203.0.113.7" in failure("view", "--live", "--host", "203.0.113.7", "--port", "0")


def test_a_recording_without_scans_is_said_at_once(tmp_path: Path) -> None:
    empty = tmp_path / "empty.log"
    empty.write_text("ODOM 0 0 0 0 0 0 1.0 host 0.0\n")
    done = subprocess.run([*COMMAND, str(empty)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert "error:" in done.stderr


def test_without_its_library_the_extra_is_named(
    log: Path, failure: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith(("contourslam.view", "websockets"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "websockets", None)
    assert "pip install 'contourslam[view]'" in failure("view", log)
