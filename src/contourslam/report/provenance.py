"""Which software and which machine a result came from."""

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from contourslam import __version__
from contourslam.experiments.parallel import cores


def software() -> dict[str, str]:
    """Versions of this package, of Python and of the libraries the numbers depend on."""
    found = {"contourslam": __version__, "python": platform.python_version()}
    for name in ("numpy", "numba", "scipy", "mujoco"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def machine() -> dict[str, str]:
    """Processor, number of cores it lends us, and operating system."""
    return {"processor": _processor(), "cores": str(cores()), "system": f"{platform.system()} {platform.machine()}"}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    for line in lines:
        key, _, value = line.partition(":")
        if key.strip() in ("model name", "Model"):
            return value.strip()
    return platform.processor() or "unknown"
