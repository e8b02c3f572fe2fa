import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
LOGS = [HERE.parents[2] / "shared" / "data" / name for name in ("intel/intel.log.xz", "mit_csail/mit-csail.clf.xz")]


def run(*arguments: object, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = os.environ | ({} if folder is None else {"NUMBA_CACHE_DIR": str(folder)})
    command = [sys.executable, *(str(argument) for argument in arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


def test_after_the_rehearsal_a_robot_compiles_nothing() -> None:
    pytest.importorskip("gtsam", reason="needs the extra 'graph'")
    done = run(HERE / "rehearsed.py", *(log for log in LOGS if log.exists()))
    assert done.stderr == ""
    assert json.loads(done.stdout) == {}


def test_check_on_a_cold_machine_names_what_is_cold_and_compiles_nothing(tmp_path: Path) -> None:
    done = run("-m", "contourslam", "warm-up", "--check", folder=tmp_path)
    assert done.returncode == 1
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert "is not compiled; run `contourslam warm-up`" in line
    assert list(tmp_path.rglob("*.nbc")) == []


def test_a_kernel_is_compiled_by_the_first_process_and_found_by_the_next(tmp_path: Path) -> None:
    code = (
        "from contourslam.kernels import watch_compilation\n"
        "from contourslam.geometry.angles import wrap_angle\n"
        "with watch_compilation(print):\n"
        "    wrap_angle(4.0)\n"
        "    wrap_angle(5.0)\n"
        "wrap_angle(6)\n"
    )
    first, second = run("-c", code, folder=tmp_path), run("-c", code, folder=tmp_path)
    assert (first.stdout, first.stderr) == ("contourslam.geometry.angles.wrap_angle\n", "")
    assert (second.stdout, second.stderr) == ("", "")
