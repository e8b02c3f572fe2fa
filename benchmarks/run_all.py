"""Run every benchmark, one after the other, on one core, and rewrite the tables of BENCHMARK.md."""

import os
import subprocess
import sys
from pathlib import Path

# The filter's matrices are small: threads of the linear algebra would measure the machine's load, not the code.
ONE_CORE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
# Too long to be part of all, at real time, or in an environment of its own: `make bench-scale` and the others.
ON_THEIR_OWN = {
    "bench_scale",
    "bench_ros",
    "bench_robot",
    "bench_joining",
    "bench_fleet",
    "bench_fleet_wire",
    "bench_sweep",
}


def main() -> int:
    failed = []
    for script in sorted(Path(__file__).parent.glob("bench_*.py")):
        if script.stem in ON_THEIR_OWN:
            continue
        print(f"\n{script.stem}", flush=True)
        if subprocess.run([sys.executable, str(script), "--write"], env=os.environ | ONE_CORE, check=False).returncode:
            failed.append(script.stem)
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
