"""The whole robot at real time on the real firmware: 25 seconds, in which the lidar is unplugged for three; watched."""

import json
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from contourslam.cli.run import DEFAULTS
from contourslam.cli.serving import Page
from contourslam.experiments.loop_values import Firmware, LoopConfig
from contourslam.experiments.robot_in_the_loop import robot_in_the_loop
from contourslam.recordings import open_recording
from contourslam.report.loop_page import write_loop_report

BUILD = Path(__file__).parents[1] / "build"


class Browser:
    """What a browser would be told, read in a thread of its own.

    Attributes
    ----------
    heads : list
        Headers of the messages, in their order.
    """

    def __init__(self) -> None:
        self.heads: list[Any] = []
        self._thread: threading.Thread | None = None

    def open(self, url: str) -> None:
        """Open the page."""
        self._thread = threading.Thread(target=self._read, args=(url.replace("http:", "ws:") + "ws",))
        self._thread.start()

    def join(self) -> None:
        """Wait until the server has gone."""
        assert self._thread is not None
        self._thread.join()

    def _read(self, url: str) -> None:
        try:
            with connect(url, max_size=None) as page:
                for message in page:
                    assert isinstance(message, bytes)
                    head = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
                    self.heads.append(head)
                    if head["kind"] == "frame":
                        page.send(json.dumps({"do": "drawn", "value": head["index"]}))
        except ConnectionClosed:
            return

    def of(self, kind: str) -> list[Any]:
        """Give those of a kind."""
        return [head for head in self.heads if head["kind"] == kind]


def test_the_robot_finds_its_way_at_real_time_through_a_fault_and_is_watched(tmp_path: Path) -> None:
    config = LoopConfig(seed=2, seconds=25.0, fault="unplugged", pictures=1.0, settings=DEFAULTS)
    browser = Browser()
    with ExitStack() as stack:
        witness = Page(port=0).witness(stack, DEFAULTS, "loop", driven=True, say=browser.open)
        result = robot_in_the_loop(config, Firmware.built_in(BUILD), recording=tmp_path / "recording", witness=witness)
    browser.join()
    told = [{row["name"]: row["message"] for row in status["health"]} for status in browser.of("status")]
    assert {"scans", "odometry", "latency", "lidar", "base", "camera"} <= set(told[-1])
    assert any("battery" in messages.get("base", "") for messages in told)  # the page is there before the robot
    events = [event["text"] for status in browser.of("status") for event in status["events"]]
    assert any(text.startswith("lidar: no turn of the lidar for") for text in events)
    assert "lidar: well again" in events
    assert browser.of("map")[-1]["arrays"]["corner_ids"][2] > 0
    assert browser.of("frame")[-1]["index"] > 0.8 * len(result.run.stamps)
    assert result.counters.reconnections >= 1
    assert result.travelled > 3.0
    assert result.picture_count > 3
    # A busy machine holds the world up, and what is late by so much lies off by so much way.
    allowed = 0.03 + config.speed * max(result.record.latest - 0.02, 0.0)
    assert result.online["x"] < allowed and result.online["y"] < allowed
    assert result.online["theta"] < 0.01 + 0.9 * max(result.record.latest - 0.02, 0.0)
    page = write_loop_report(tmp_path / "report", result).read_text()
    assert "the lidar is unplugged for 3 s" in page and "After" in page
    recording = open_recording(tmp_path / "recording")
    assert recording.camera is not None
    assert sum(1 for _ in recording.pictures()) == result.picture_count
    assert sum(1 for _ in recording.messages()) > 1000
