"""The whole robot at real time on the real firmware: 25 seconds, in which the lidar is unplugged for three."""

from pathlib import Path

from contourslam.cli.run import DEFAULTS
from contourslam.experiments.loop_values import Firmware, LoopConfig
from contourslam.experiments.robot_in_the_loop import robot_in_the_loop
from contourslam.recordings import open_recording
from contourslam.report.loop_page import write_loop_report

BUILD = Path(__file__).parents[1] / "build"


def test_the_robot_finds_its_way_at_real_time_through_a_fault(tmp_path: Path) -> None:
    config = LoopConfig(seed=2, seconds=25.0, fault="unplugged", pictures=1.0, settings=DEFAULTS)
    result = robot_in_the_loop(config, Firmware.built_in(BUILD), recording=tmp_path / "recording")
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
