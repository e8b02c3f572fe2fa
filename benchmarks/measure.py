"""What a command costs: ``measured([...], folder)`` runs it through a small launcher, which is this file as a script.

The launcher is a process of its own because the kernel counts the memory of the process that starts a command as the
command's own: a benchmark that has read a log would put its size under every system's figure.
"""

import json
import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

from run_all import ONE_CORE

CPU_LIMIT = 1800  # s; a system that runs away is stopped and its row says so


class SystemFailedError(Exception):
    """A system that could not be installed or run; the message goes into its row."""


def measured(words: list[str], folder: Path) -> tuple[float, int]:
    """Run a command on one core; what it prints goes into ``log.txt``, what it costs into ``cost.json``.

    Parameters
    ----------
    words : list of str
    folder : Path

    Returns
    -------
    cpu_seconds : float
        User and system time of the process and its children.
    peak_bytes : int
        Largest memory of the process, or of one of its children.

    Raises
    ------
    SystemFailedError
        If it fails, with the last line that it printed.
    """
    cost, log = folder / "cost.json", folder / "log.txt"
    with log.open("w") as out:
        launcher = [sys.executable, __file__, str(cost), *words]
        done = subprocess.run(launcher, env=os.environ | ONE_CORE, stdout=out, stderr=out, check=False)
    if done.returncode:
        raise SystemFailedError(f"failed: {last_line(log.read_text(errors='replace'))}")
    figures = json.loads(cost.read_text())
    return figures["cpu_seconds"], figures["peak_bytes"]


def last_line(text: str) -> str:
    """Give the last line of what a command printed, fit for a table's cell."""
    lines = text.strip().splitlines() or ["it says nothing"]
    return lines[-1].replace("|", "/")[:120]


def _limit() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT, CPU_LIMIT + 5))


def main() -> int:
    process = subprocess.Popen(sys.argv[2:], preexec_fn=_limit)
    _, status, usage = os.wait4(process.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    if code:
        if code < 0:
            limit = f" after {CPU_LIMIT} s of CPU" if -code == signal.SIGXCPU else ""
            print(f"ended by {signal.Signals(-code).name}{limit}", file=sys.stderr)
        return 1
    peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    figures = {"cpu_seconds": usage.ru_utime + usage.ru_stime, "peak_bytes": peak}
    Path(sys.argv[1]).write_text(json.dumps(figures) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
