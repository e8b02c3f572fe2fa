"""What ``contourslam doctor`` finds: a line on each thing that can be missing."""

import os
import platform
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from contourslam import __version__
from contourslam.errors import ContourslamError

State = Literal["good", "absent", "wrong"]
_EXTRA = re.compile(r"""^([\w.-]+)[^;]*;.*extra\s*==\s*["'](\w+)["']""")
_LIBRARY = re.compile(r"^[\w.-]+")
_FOR_USERS = ("graph", "robot", "camera", "view", "simulation", "report", "rerun")
_ROOM = 1.0  # GB, for a recording and its map
_WORST = 0.1  # m by which the self-test may err; that of a machine where all is well errs by a tenth of it


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Attributes
    ----------
    group : str
        What it belongs to.
    state : {"good", "absent", "wrong"}
        Absent is what one may do without.
    text : str
    advice : str
        What to do, where something is to be done.
    """

    group: str
    state: State
    text: str
    advice: str = ""


def examine() -> list[Finding]:
    """Look at everything, in the order in which it is told."""
    parts: tuple[Callable[[], Iterator[Finding]], ...] = (_python, _extras, _devices, _ros, _room, _test)
    return [finding for part in parts for finding in _guarded(part)]


def _guarded(part: Callable[[], Iterator[Finding]]) -> Iterator[Finding]:
    """Whatever goes wrong in one part is a finding too: the others are to be told with it."""
    try:
        yield from part()
    except Exception as error:
        told = f"{type(error).__name__}: {' '.join(str(error).split())}"
        yield Finding("work", "wrong", f"{part.__name__.strip('_')} cannot be examined: {told}", "please report this")


def _python() -> Iterator[Finding]:
    group = "contourslam"
    place = Path(__file__).parents[1]
    yield Finding(group, "good", f"contourslam {__version__} in {place}")
    system = f"{platform.system()} {platform.release()}, {platform.machine()}, {os.cpu_count()} cores"
    yield Finding(group, "good", f"Python {platform.python_version()} ({sys.executable}) on {system}")
    names = [_LIBRARY.match(line) for line in _requirements() if "extra" not in line]
    found = {match.group(): _version(match.group()) for match in names if match}
    missing = [name for name, version in found.items() if version is None]
    if missing:
        yield Finding(
            group, "wrong", f"not installed: {', '.join(missing)}", "pip install --force-reinstall contourslam"
        )
    if len(missing) < len(found):
        yield Finding(group, "good", ", ".join(f"{name} {version}" for name, version in found.items() if version))


def _requirements() -> list[str]:
    try:
        return metadata.requires("contourslam") or []
    except metadata.PackageNotFoundError:  # run from its source, without being installed
        return []


def _version(library: str) -> str | None:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return None


def _extras() -> Iterator[Finding]:
    wanted: dict[str, list[str]] = {name: [] for name in _FOR_USERS}
    for line in _requirements():
        match = _EXTRA.match(line)
        if match and match.group(2) in wanted and match.group(1) != "contourslam":
            wanted[match.group(2)].append(match.group(1))
    for extra, libraries in wanted.items():
        if not libraries:  # of another version, whose description is still the installed one
            continue
        found = {library: _version(library) for library in libraries}
        if all(found.values()):
            yield Finding("extras", "good", f"{extra}: " + ", ".join(f"{name} {v}" for name, v in found.items()))
        else:
            absent = ", ".join(name for name, version in found.items() if version is None)
            advice = f"pip install 'contourslam[{extra}]'"
            yield Finding("extras", "absent", f"{extra}: {absent} is not installed", advice)


def _devices() -> Iterator[Finding]:
    yield from _ports()
    cameras = sorted(Path("/dev").glob("video[0-9]*"))
    if not cameras:
        yield Finding("devices", "absent", "no video device")
    for camera in cameras:
        yield _device(str(camera), "video device")


def _ports() -> Iterator[Finding]:
    from contourslam.robot.serial_port import BASE, LIDAR, list_ports

    try:
        ports = list_ports()
    except ContourslamError:
        yield Finding("devices", "absent", "serial ports cannot be listed without the extra robot")
        return
    if not ports:
        yield Finding("devices", "absent", "no serial port", "plug the lidar's USB cable in, where there is one")
    for name, what, usb in ports:
        parts = [part.name for part in (LIDAR, BASE) if usb in part.usb]
        guess = f", perhaps the {parts[0]}'s" if parts else ""
        yield _device(name, f"serial port ({what}{guess})")


def _device(name: str, what: str) -> Finding:
    from contourslam.robot.serial_port import join_group

    if os.access(name, os.R_OK | os.W_OK):
        return Finding("devices", "good", f"{name}: {what}, may be opened")
    return Finding("devices", "absent", f"{name}: {what}", join_group(name))


def _ros() -> Iterator[Finding]:
    distribution = os.environ.get("ROS_DISTRO")
    if find_spec("rclpy") is None:
        if distribution or shutil.which("ros2"):
            version = platform.python_version()
            advice = f"in a shell that sourced its setup.bash, use the Python that it was made for (this is {version})"
            yield Finding("ROS 2", "absent", f"{distribution or 'ros2'} is here, but this Python has no rclpy", advice)
        else:
            yield Finding("ROS 2", "absent", "not found; nothing but the ROS nodes needs it")
        return
    yield Finding("ROS 2", "good", f"rclpy is here{f', {distribution}' if distribution else ''}")
    if find_spec("contourslam_ros") is None:
        advice = "build ros2/ with colcon and source its install/setup.bash"
        yield Finding("ROS 2", "absent", "the package contourslam_ros is not", advice)
    else:
        yield Finding("ROS 2", "good", "contourslam_ros is here")


def _room() -> Iterator[Finding]:
    try:
        folder = tempfile.gettempdir()
    except FileNotFoundError as error:
        yield Finding("work", "absent", f"no folder for temporary files: {error.strerror}", "name one in TMPDIR")
        return
    free = shutil.disk_usage(folder).free / 1e9
    text = f"{free:.1f} GB free for temporary files in {folder}"
    yield Finding("work", "good", text) if free > _ROOM else Finding("work", "absent", text, "make room first")


class _ColdError(ContourslamError):
    """A kernel is not in the cache."""


def _test() -> Iterator[Finding]:
    """Map a made-up drive, where nothing has to be compiled for it."""

    def begun(kernel: str) -> None:
        raise _ColdError(kernel)

    try:
        from contourslam.cli.run import DEFAULTS
        from contourslam.kernels import watch_compilation
        from contourslam.live.rehearsal import cache_folder
        from contourslam.live.self_test import self_test

        with watch_compilation(begun):
            self_test(DEFAULTS)  # loads what is compiled; the second one has the rate of a robot's
            test = self_test(DEFAULTS)
    except _ColdError:
        advice = "`contourslam warm-up` compiles them now, in a minute or two; the first run would else; then ask again"
        yield Finding("work", "absent", f"kernels are not compiled yet (they are kept in {cache_folder()})", advice)
        return
    yield Finding("work", "good", f"kernels are compiled, in {cache_folder()}")
    rate = test.scans / max(test.seconds, 1e-9)
    said = (
        f"self-test: {test.scans} scans of {test.beams} beams mapped at {rate:.0f} scans/s, "
        f"{100 * test.error:.1f} cm off the truth (wheels alone: {100 * test.odometry_error:.0f} cm)"
    )
    if test.error < _WORST:
        yield Finding("work", "good", said)
    else:
        yield Finding("work", "wrong", said, "no mapping errs so much here; please report this")
