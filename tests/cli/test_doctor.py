import json
import os
import subprocess
import sys
from dataclasses import replace
from importlib import metadata
from pathlib import Path

import pytest

from contourslam import __version__
from contourslam.cli import findings, main
from contourslam.cli.run import DEFAULTS
from contourslam.live import self_test as module
from contourslam.robot import serial_port


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]):
    """Exit code of the command, and its findings by what they belong to."""

    def run() -> tuple[int, dict[str, list[dict[str, str]]]]:
        code = main(["doctor", "--json"])
        said = json.loads(capsys.readouterr().out)
        assert said["well"] is (code == 0)
        groups: dict[str, list[dict[str, str]]] = {}
        for finding in said["findings"]:
            groups.setdefault(finding["group"], []).append(finding)
        return code, groups

    return run


@pytest.fixture(scope="module")
def compiled() -> module.SelfTest:
    """The self-test, which compiles what it needs where that was not done before."""
    return module.self_test(DEFAULTS)


@pytest.mark.usefixtures("compiled")
def test_a_machine_that_maps_is_well_and_says_how_well_it_maps(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert f"contourslam {__version__}" in said
    assert "self-test: 157 scans of 360 beams mapped at" in said
    assert "FAIL" not in said and "✗" not in said


def test_the_mapping_of_the_self_test_beats_its_wheels_by_far(compiled: module.SelfTest) -> None:
    assert compiled.error < 0.01 < 0.3 < compiled.odometry_error


def test_a_missing_extra_is_told_with_what_brings_it_and_is_no_fault(monkeypatch, told) -> None:
    version = metadata.version

    def without_gtsam(name: str) -> str:
        if name == "gtsam":
            raise metadata.PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr(metadata, "version", without_gtsam)
    code, groups = told()
    (graph,) = [finding for finding in groups["extras"] if finding["text"].startswith("graph")]
    assert (code, graph["state"]) == (0, "absent")
    assert graph["advice"] == "pip install 'contourslam[graph]'"


def test_a_missing_library_of_the_core_is_a_fault(monkeypatch, told) -> None:
    monkeypatch.setattr(findings, "_version", lambda name: None if name == "rosbags" else "1.0")
    code, groups = told()
    assert code == 1
    assert any(f["state"] == "wrong" and "rosbags" in f["text"] for f in groups["contourslam"])


def test_a_port_that_may_not_be_opened_is_told_with_the_group_that_may(monkeypatch, told, tmp_path: Path) -> None:
    port = tmp_path / "ttyUSB0"
    port.touch()
    monkeypatch.setattr(serial_port, "list_ports", lambda: [(str(port), "CP2102", serial_port.LIDAR.usb[0])])
    monkeypatch.setattr(os, "access", lambda name, mode: False)
    code, groups = told()
    (found,) = [finding for finding in groups["devices"] if str(port) in finding["text"]]
    assert code == 0
    assert "perhaps the lidar's" in found["text"]
    assert "usermod -aG" in found["advice"]


@pytest.mark.usefixtures("compiled")
def test_a_mapping_that_fails_or_errs_is_a_fault_and_the_rest_is_told_all_the_same(monkeypatch, told) -> None:
    whole = module.self_test

    def breaks(config):
        raise ZeroDivisionError("of the mapper")  # whatever it is, it is told

    monkeypatch.setattr(module, "self_test", breaks)
    code, groups = told()
    assert code == 1
    assert "ZeroDivisionError: of the mapper" in groups["work"][-1]["text"]
    assert groups["extras"] and groups["devices"] and groups["ROS 2"]

    monkeypatch.setattr(module, "self_test", lambda config: replace(whole(config), error=0.5))
    code, groups = told()
    assert (code, groups["work"][-1]["state"]) == (1, "wrong")


def test_where_nothing_can_be_written_the_rest_is_told(monkeypatch, told) -> None:
    def nowhere():
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr(findings.tempfile, "gettempdir", nowhere)
    code, groups = told()
    assert code == 0
    assert any("No usable temporary directory" in f["text"] and f["advice"] for f in groups["work"])


def test_where_nothing_is_compiled_it_compiles_nothing_and_says_what_does(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "contourslam", "doctor", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    cold = json.loads(done.stdout)["findings"][-1]
    assert cold["state"] == "absent"
    assert "not compiled yet" in cold["text"] and "contourslam warm-up" in cold["advice"]
    assert list(tmp_path.rglob("*.nbc")) == []


def test_ros_without_a_fitting_python_is_told(monkeypatch, told) -> None:
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    monkeypatch.setattr(findings, "find_spec", lambda name: None)
    _, groups = told()
    (ros,) = groups["ROS 2"]
    assert "jazzy is here, but this Python has no rclpy" in ros["text"]
