"""A process that is killed while it saves leaves a whole map: the old one or the new."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("kill_saves.py")
KILLS = 200


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills processes as Unix does")
def test_a_map_is_whole_however_often_its_writer_is_killed(tmp_path: Path) -> None:
    calm = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # the process forks, which threads would not outlive
    command = [sys.executable, "-W", "error", str(SCRIPT), str(tmp_path), str(KILLS), "0"]
    done = subprocess.run(command, capture_output=True, text=True, env=calm, timeout=300)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["kills"] == KILLS
    assert report["saves"] > KILLS / 10  # many were killed after a save or two,
    assert report["left"] > KILLS / 10  # and many in the midst of one
