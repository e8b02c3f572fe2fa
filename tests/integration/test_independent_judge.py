"""What `contourslam evaluate` says of a mapped real log is what an evaluator written by others says of its files."""

import json
import lzma
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main

SHARED = Path(__file__).parents[2].parent / "shared"
SCRIPT = SHARED / "tools" / "relations.py"
# Printed digits: mean, sd, median (m), largest (m), mean, sd, median, largest (degrees).
DIGITS = np.array([1e-4, 1e-4, 1e-4, 1e-2, 1e-3, 1e-3, 1e-3, 1e-1])


@pytest.mark.parametrize(
    ("log", "relations", "every"),
    [
        ("intel/intel.log.xz", "intel/intel.relations.xz", 12),
        ("mit_csail/mit-csail.clf.xz", "mit_csail/mit-csail.relations.xz", 4),
    ],
    ids=["intel", "mit_csail"],
)
def test_a_mapped_log_scores_as_the_independent_script_says(
    log: str, relations: str, every: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, known = SHARED / "data" / log, tmp_path / "known.relations"
    if not (recording.exists() and SCRIPT.exists()):
        pytest.skip(f"the real recordings or the independent script are not here: no {log} in ../shared/data")
    with lzma.open(SHARED / "data" / relations) as file:
        known.write_bytes(file.read())
    folder = tmp_path / "run"
    # Few scans, so that most stamps lie between them.
    assert main(["run", str(recording), "--every", str(every), "-o", str(folder)]) == 0
    capsys.readouterr()
    assert main(["evaluate", str(folder), "--relations", str(known), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)[str(folder)]["relations"]
    words = [sys.executable, str(SCRIPT), str(folder / "trajectory.tum"), str(known)]
    # The trajectory holds a pose at each reading, so that the way along the wheels adds nothing to it.
    printed, along = (
        subprocess.run([*words, *more], capture_output=True, text=True, check=True, timeout=60).stdout
        for more in ([], [str(folder / "odometry.tum")])
    )
    assert printed == along
    ours = [
        convert(found[part][name])
        for part, convert in (("translation", float), ("rotation", np.degrees))
        for name in ("mean", "sd", "median", "max")
    ]
    theirs = np.array([float(number) for number in re.findall(r"\d+\.\d+", printed)])
    assert (np.abs(np.array(ours) - theirs) <= 0.51 * DIGITS).all(), (ours, printed)
    assert int(printed.split()[0]) == found["count"]
