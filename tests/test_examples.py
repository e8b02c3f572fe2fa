"""The examples run as they stand, without a warning."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
# What each must say, so that an example that runs and finds nothing does not pass.
SAYS = {
    "01_corners_of_one_scan.py": "curvature_scale_space: 6 corners",
    "02_streaming_slam.py": "map: ",
    "03_a_fifth_detector.py": "turning angle   RMSE",
    "04_map_a_recording.py": "map.geojson, map.pgm, map.svg, map.yaml",
    "05_compare_two_detectors.py": "teh_chin        walls",
}


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("[0-9]*.py")), ids=lambda path: path.stem)
def test_the_example_runs(path: Path) -> None:
    environment = os.environ | {"MPLBACKEND": "template"}  # pictures are drawn nowhere, without a word
    command = [sys.executable, "-W", "error", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    assert SAYS[path.name] in done.stdout
