"""Every page of the report for those who do not see it, or not well: checked by axe in a real browser."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.cli.run import DEFAULTS
from contourslam.config import Config
from contourslam.evaluation.metrics import run_metrics
from contourslam.evaluation.relations import judge
from contourslam.experiments.loop_values import Counters, LoopConfig, LoopResult
from contourslam.geometry.poses import between, interpolate
from contourslam.recordings.picture import Picture
from contourslam.report.html import write_report
from contourslam.report.loop_page import write_loop_report
from contourslam.report.result_folder import write_result_folder
from contourslam.report.run_page import write_run_page
from contourslam.report.runs_page import write_runs_report
from contourslam.report.runs_reading import read_runs
from contourslam.report.scene_page import add_scene
from contourslam.robot.bring_up import Trouble
from contourslam.simulation.hardware.live_world import Record
from contourslam.slam.result import RunResult

Faults = Callable[[Path], list[str]]
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55"
    "0000000a49444154789c6368000000820081777f1a210000000049454e44ae426082"
)  # one grey pixel
SCENE = '{"seen": {"wall": 0.9, "floor": null}, "bytes": 1000, "pictures": {"used": 7}}'


@pytest.fixture(scope="module")
def faults(browser: Any) -> Faults:
    """Ask axe what is wrong with a page, light and dark, wide and narrow, with all its folds open."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    checker = axe.Axe()

    def ask(file: Path) -> list[str]:
        return [fault for scheme, width in (("light", 1280), ("dark", 390)) for fault in look(file, scheme, width)]

    def look(file: Path, scheme: str, width: int) -> list[str]:
        with browser.new_context(color_scheme=scheme, viewport={"width": width, "height": 900}) as context:
            page = context.new_page()
            page.goto(file.as_uri())
            page.evaluate("document.querySelectorAll('details').forEach((fold) => { fold.open = true; })")
            page.wait_for_timeout(100)  # what opens is drawn
            found = checker.run(page).response["violations"]
        return [f"{scheme}, {width}: {fault['id']}: {node['html']}" for fault in found for node in fault["nodes"]]

    return ask


def test_the_page_of_a_run_and_its_scene(make_graph_run: Callable[..., RunResult], tmp_path: Path, faults: Faults):
    run = make_graph_run(loops=8)
    assert run.truth is not None
    stamps = np.stack([run.stamps[:-20], run.stamps[20:]], axis=-1)
    relations = judge(run, stamps, between(run.truth[:-20], run.truth[20:]))
    metrics = run_metrics(run, relations=relations)
    write_run_page(tmp_path, run, Config(), metrics, relations, command="contourslam run a.log", name="a.log")
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "scene.json").write_text(SCENE)
    for name in ("preview.png", "inside.png"):
        (tmp_path / "scene" / name).write_bytes(PNG)
    add_scene(tmp_path)
    assert 'id="scene"' in (tmp_path / "index.html").read_text()
    assert faults(tmp_path / "index.html") == []


@pytest.mark.usefixtures("undrawn")
def test_the_page_of_the_detectors(
    make_study: Callable[..., Any], tmp_path: Path, faults: Faults, monkeypatch: pytest.MonkeyPatch
):
    renderer = "contourslam.report.page.room.render_room"
    monkeypatch.setattr(renderer, lambda room, path, **size: path.write_bytes(PNG))
    write_report(tmp_path, make_study(), command="contourslam compare --seeds 3")
    assert faults(tmp_path / "index.html") == []


@pytest.mark.usefixtures("undrawn")
def test_the_page_of_several_runs(make_run: Callable[..., RunResult], tmp_path: Path, faults: Faults):
    run = make_run()
    assert run.truth is not None
    worse = replace(run, poses=run.truth + 3.0 * (run.poses - run.truth))
    for name, one in (("a", run), ("b", worse)):
        metrics = {"recording": "hall.bag"} | run_metrics(one)
        write_result_folder(tmp_path / name, one, Config(), metrics, command="contourslam run hall.bag")
    write_runs_report(tmp_path / "out", read_runs([tmp_path / "a", tmp_path / "b"]), command="contourslam compare a b")
    assert faults(tmp_path / "out" / "index.html") == []


def test_the_page_of_a_robot_in_the_loop(make_run: Callable[..., RunResult], tmp_path: Path, faults: Faults):
    run = make_run(scans=120)
    assert run.truth is not None
    stamps = np.linspace(run.stamps[0] - 1.0, run.stamps[-1] + 1.0, 2000)
    poses = interpolate(run.stamps, run.truth, stamps)
    record = Record(stamps, poses, 50_000, 125, 0.034, 0.25, 1_000_000, 50_000, 3)
    loop = LoopResult(
        LoopConfig(fault="damaged"), DEFAULTS, run, record, Counters(20, 980, 1, 300, 2700, 1, 0), np.full(120, 0.02),
        0.15, 28.4, (Trouble(stamps[5], "lidar", "pull it out"),), (Picture(stamps[100], PNG, "png"),), 99,
    )  # fmt: skip
    assert faults(write_loop_report(tmp_path, loop, command="contourslam robot-in-the-loop")) == []
