"""The page of a robot in the loop, from numbers made up for it."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.cli.run import DEFAULTS
from contourslam.experiments.loop_values import Counters, LoopConfig, LoopResult
from contourslam.geometry.poses import interpolate
from contourslam.recordings.picture import Picture
from contourslam.report.loop_page import kept, loop_metrics, write_loop_report
from contourslam.report.result_folder import read_result_folder
from contourslam.robot.bring_up import Trouble
from contourslam.simulation.hardware.live_world import Record
from contourslam.slam.result import RunResult


@pytest.fixture
def loop(make_run: Callable[..., RunResult]) -> LoopResult:
    run = make_run(scans=120)
    stamps = np.linspace(run.stamps[0] - 1.0, run.stamps[-1] + 1.0, 2000)
    assert run.truth is not None
    record = Record(
        stamps, interpolate(run.stamps, run.truth, stamps), 50_000, 125, 0.034, 0.25, 1_000_000, 50_000, 3
    )  # fmt: skip
    jpeg = b"\xff\xd8\xff<&" + b"\xff\xd9"
    return LoopResult(
        LoopConfig(fault="damaged"), DEFAULTS, run, record, Counters(20, 980, 1, 300, 2700, 1, 0), np.full(120, 0.02),
        0.15,
        28.4, (Trouble(stamps[5], "lidar", "pull <it> out"), Trouble(stamps[9], "lidar", "")),
        (Picture(stamps[100], jpeg, "jpeg"),), 99,
    )  # fmt: skip


def test_the_page_tells_way_errors_punctuality_wires_and_pictures(
    loop: LoopResult, tmp_path: Path, parsed: Callable[..., Any]
) -> None:
    text = write_loop_report(tmp_path, loop, command="contourslam robot-in-the-loop <&>").read_text()
    page = parsed(text)
    assert "5 % of all bytes" in text and "50,000" in text and "5.0 %" in text
    assert "0.25 %" in text and "34 ms" in text and "98.0 % fail" in text
    assert "pull &lt;it&gt; out" in text and "the lidar is there again" in text
    assert "pictures/00.jpg" in [image["src"] for image in page.all("img")]
    assert (tmp_path / "pictures" / "00.jpg").read_bytes() == loop.pictures[0].data
    assert all(":" not in image["src"].removeprefix("data:") for image in page.all("img"))  # nothing from outside


def test_the_numbers_are_those_of_the_poses_known_at_the_time(loop: LoopResult, tmp_path: Path) -> None:
    assert loop.run.truth is not None
    off = loop.run.truth + np.array([0.05, 0.0, 0.0])
    bad = replace(loop, run=replace(loop.run, online_poses=off, poses=loop.run.truth))
    assert not kept(bad) and loop_metrics(bad)["loop"]["online_rmse"]["x"] == pytest.approx(0.05)
    assert bad.revised["x"] == 0.0
    good = replace(bad, run=replace(bad.run, online_poses=loop.run.truth))
    assert kept(good)
    assert "larger than they may be" in write_loop_report(tmp_path / "bad", bad).read_text()
    assert "larger than they may be" not in write_loop_report(tmp_path / "good", good).read_text()
    stored = read_result_folder(tmp_path / "good")
    assert len(stored.result.stamps) == 120
    assert json.loads((tmp_path / "good" / "metrics.json").read_text())["loop"]["counters"]["states"] == 300
