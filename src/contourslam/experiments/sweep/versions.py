"""Which program a run was done by: a changed one does not take over the rows of the one before."""

import hashlib
import json
import platform
import re
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import contourslam

_START = "contourslam.experiments.sweep.work"
_PACKAGE = Path(contourslam.__file__).parent
# Imports within functions and those for type checkers count as well: rather one file too many than one too few.
_IMPORT = re.compile(
    r"^\s*(?:from\s+(contourslam[\w.]*)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+(contourslam[\w.]*))", re.M
)
LIBRARIES = ("numpy", "numba", "scipy", "mujoco", "gtsam", "rosbags", "evo", "shapely")
"""Those that the numbers depend on."""


@cache
def program() -> str:
    """Version of the package, with digests of its source files that a run uses and of the libraries' versions.

    Such as ``0.1.0+1f2e3d4c5b6a.9a8b7c6d``.
    """
    digest = hashlib.sha256()
    for name in sources():
        digest.update(name.encode() + b"\0" + _file(name).read_bytes() + b"\0")
    others = hashlib.sha256(json.dumps({name: libraries()[name] for name in LIBRARIES}).encode())
    return f"{contourslam.__version__}+{digest.hexdigest()[:12]}.{others.hexdigest()[:8]}"


def sources() -> tuple[str, ...]:
    """Names of the package's modules that one run imports, found by following the imports, in alphabetical order."""
    found: set[str] = set()
    waiting = [_START]
    while waiting:
        name = waiting.pop()
        if name in found or not _file(name).exists():
            continue
        found.add(name)
        waiting.append(name.rpartition(".")[0])
        for origin, names, plain in _IMPORT.findall(_file(name).read_text(encoding="utf-8")):
            waiting.append(plain or origin)
            waiting += [f"{origin}.{word}" for word in re.findall(r"\w+", re.sub(r"\bas\s+\w+|#.*", "", names))]
    return tuple(sorted(found))


def libraries() -> dict[str, str]:
    """Versions of the libraries that the numbers depend on."""
    found = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _file(module: str) -> Path:
    if not module.startswith("contourslam"):
        return _PACKAGE / "no module of ours"
    place = _PACKAGE.joinpath(*module.split(".")[1:])
    return place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
