"""After the rehearsal neither a robot that tells a fleet of its drive nor the server waits for the compiler."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")


@pytest.mark.parametrize("who", ["fleet", "robot"])
def test_after_the_rehearsal_nothing_is_compiled(who: str) -> None:
    program = Path(__file__).with_name("rehearsed.py")
    done = subprocess.run([sys.executable, str(program), who], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert json.loads(done.stdout) == []
