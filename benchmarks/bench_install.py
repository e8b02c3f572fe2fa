"""Size of the core's libraries on a 64-bit Raspberry Pi (Python 3.11), byte code included: target below 300 MB.

Installs the wheels for that machine into a folder of their own, without running anything of them.
"""

import compileall
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

from table import ROOT, Table, publish

TARGET_MB = 300
MACHINE = {
    "platform_machine": "aarch64",
    "python_version": "3.11",
    "sys_platform": "linux",
    "implementation_name": "cpython",
}
PLATFORMS = ("manylinux_2_28_aarch64", "manylinux_2_27_aarch64", "manylinux_2_17_aarch64", "manylinux2014_aarch64")


def requirements() -> list[str]:
    """Give the core's requirements that hold on the Raspberry Pi; pip would judge their markers by this machine."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = []
    for line in project["dependencies"]:
        requirement = Requirement(line)
        if requirement.marker is None or requirement.marker.evaluate(MACHINE):
            requirement.marker = None
            wanted.append(str(requirement))
    return wanted


def megabytes(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile"]
        platforms = [word for platform in PLATFORMS for word in ("--platform", platform)]
        only = ["--only-binary=:all:", "--python-version", "3.11", "--target", name]
        subprocess.run([*pip, *platforms, *only, *requirements()], check=True)
        compileall.compile_dir(name, quiet=2)
        sizes = {entry.name: megabytes(entry) for entry in folder.iterdir() if entry.is_dir()}
        whole = megabytes(folder) + megabytes(ROOT / "src")
        rows: list[list[object]] = [[part, size] for part, size in sorted(sizes.items(), key=lambda item: -item[1])[:8]]
        publish(Table("install", ["part", "MB"], [*rows, [f"**all of it, target {TARGET_MB}**", whole]]))
        if whole > TARGET_MB:
            raise SystemExit(f"the core takes {whole:.0f} MB on a Raspberry Pi, more than {TARGET_MB}")


if __name__ == "__main__":
    main()
