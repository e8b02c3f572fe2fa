"""A newcomer's paths: a clone, a new environment, and what README and docs say; nothing else of this machine.

The demo is a path too: ``make demo`` in a clone, which .ci/run does.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import FOLLOWED, blocks, needs, unsaid
from made import Made

pytestmark = pytest.mark.xdist_group("newcomer")  # one environment for all of them
ROOT = Path(__file__).parents[1]
KEPT = re.compile(r"HOME|LANG|SSL_CERT_FILE|TMPDIR|PIP_\w+|\w+_(PROXY|proxy)")
"""What of this machine a newcomer has too: how it reaches a package index."""


class Newcomer:
    """Somebody with a clone and an environment of their own, who pastes a document's blocks into a shell."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.clone = home / "contourslam"
        subprocess.run(["git", "clone", "--quiet", "--no-hardlinks", ROOT, self.clone], check=True)
        subprocess.run([sys.executable, "-m", "venv", home / "venv"], check=True)
        self.environment = {name: value for name, value in os.environ.items() if KEPT.fullmatch(name)}
        self.environment |= {"PATH": f"{home / 'venv' / 'bin'}:/usr/local/bin:/usr/bin:/bin", "MPLBACKEND": "template"}

    def paste(self, text: str, folder: Path) -> str:
        """Paste lines into a shell in that folder; the first that fails ends it."""
        done = self._shell(text, folder)
        assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def install(self, extras: str) -> None:
        """As README does it."""
        done = self._shell(f"pip install --quiet --disable-pip-version-check '.[{extras}]'", self.clone)
        if "after connection broken by" in done.stderr and done.returncode:
            pytest.skip("no package index can be reached, and a newcomer begins with it")
        assert done.returncode == 0, done.stderr

    def _shell(self, text: str, folder: Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["bash", "-euc", text], cwd=folder, env=self.environment, capture_output=True, text=True, check=False
        )

    def follow(self, document: str, made: Made) -> Path:
        """Do what a document's blocks say, in an empty folder, which is returned."""
        assert document in FOLLOWED  # or its commands would be run twice
        page = self.clone / document
        folder = self.home / page.stem
        folder.mkdir()
        for name in needs(page):
            made.put(name, folder)
        for block in blocks(page):
            said = ""
            if block.file:
                (folder / block.title).write_text(block.text)
            elif not block.title and block.kind == "python":
                said = self.paste(f"python - <<'END OF BLOCK'\n{block.text}\nEND OF BLOCK", folder)
            elif not block.title:
                lines = [
                    line for line in block.lines() if not re.match(r"pip install|git clone|make |python3 -m venv", line)
                ]
                said = self.paste("\n".join(lines), folder)
            assert block.title or unsaid(block.shown, said) == [], said
        return folder


@pytest.fixture(scope="module")
def newcomer(tmp_path_factory: pytest.TempPathFactory) -> Newcomer:
    if shutil.which("git") is None:
        pytest.skip("no git here, and a newcomer begins with a clone")
    somebody = Newcomer(tmp_path_factory.mktemp("newcomer"))
    (line,) = re.findall(r"^pip install '\.\[(graph)\]'", (somebody.clone / "README.md").read_text(), re.MULTILINE)
    somebody.install(line)
    return somebody


@pytest.fixture(scope="module")
def everything(newcomer: Newcomer) -> Newcomer:
    newcomer.install("graph,simulation,report")
    return newcomer


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return Made(tmp_path_factory.mktemp("made"))


def test_an_own_rosbag_becomes_a_map_by_the_readme_alone(newcomer: Newcomer, made: Made) -> None:
    folder = newcomer.home / "own"
    folder.mkdir()
    made.put("my_log.bag", folder)
    (block,) = (block for block in blocks(newcomer.clone / "README.md") if "contourslam info my_log.bag" in block.text)
    lines = [line for line in block.lines() if line.startswith("contourslam ")]
    assert "map it with" in newcomer.paste("\n".join(lines), folder)
    out = folder / "out" / "my_log"
    (table,) = re.findall(r"\| file \| what \|\n\|[-|]+\n((?:\|.*\n)+)", (newcomer.clone / "README.md").read_text())
    always = {"index.html", "trajectory.tum", "odometry.tum", "map.geojson", "map.cmap", "map.svg", "metrics.json"}
    assert all(f"`{name}`" in table and (out / name).is_file() for name in always)
    assert len(json.loads((out / "map.geojson").read_text())["features"]) > 10


def test_an_own_detector_is_written_run_and_compared(everything: Newcomer, made: Made) -> None:
    folder = everything.follow("docs/how_to/own_detector.md", made)
    assert json.loads((folder / "map" / "metrics.json").read_text())["detector"] == "turning_angle"
    assert "turning" in (folder / "comparison" / "index.html").read_text()


def test_a_map_in_the_format_of_nav2_is_what_another_reader_takes_it_for(everything: Newcomer, made: Made) -> None:
    from PIL import Image
    from ruamel.yaml import YAML

    folder = everything.follow("docs/how_to/nav2.md", made) / "map"
    told = YAML(typ="safe").load(folder / "map.yaml")
    with Image.open(folder / told["image"]) as picture:
        occupied = (255.0 - np.asarray(picture, dtype=float)) / 255.0
    size = told["resolution"] * np.array(occupied.shape)
    assert told["mode"] == "trinary"
    assert told["negate"] == 0
    assert (size > 5.0).all()
    assert (size < 15.0).all()  # a room of 8 by 6 m
    walls, free = occupied > told["occupied_thresh"], occupied < told["free_thresh"]
    assert 0.01 < walls.mean() < 0.2
    assert 0.3 < free.mean() < 0.9
    x, y, _ = told["origin"]
    end = [float(word) for word in (folder / "trajectory.tum").read_text().split("\n")[-2].split()][1:3]
    column, row = int((end[0] - x) / told["resolution"]), int((end[1] - y) / told["resolution"])
    assert free[::-1][row, column], "the robot stands in what the grid says is no free place"


def test_the_report_is_read_by_its_page(everything: Newcomer, made: Made) -> None:
    page = "docs/how_to/reading_the_report.md"
    folder = everything.follow(page, made)
    reports = " ".join(path.read_text() for path in folder.rglob("index.html")).lower()
    tiles = re.findall(r"^\| (?:error in x, y, heading|(.+?)) \|", (everything.clone / page).read_text(), re.MULTILINE)
    named = tiles[2 : tiles.index("scans a second") + 1]
    assert len(named) > 4
    assert [name for name in named if name.lower() not in reports] == []
