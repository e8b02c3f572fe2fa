"""``contourslam doctor``: what is here, what is missing, and whether it works."""

import json
import sys
from dataclasses import asdict, dataclass
from itertools import groupby

from contourslam.cli.console import colour_wanted
from contourslam.cli.options import Json

_MARKS = {"good": ("✓", "ok  ", "32"), "absent": ("·", "-   ", "33"), "wrong": ("✗", "FAIL", "31")}


@dataclass(frozen=True)
class Doctor:
    """Say what is installed, which devices there are and may be opened, and whether the mapping works here.

    Libraries, extras, compiled kernels, serial ports and cameras with their permissions, ROS, and a self-test of about
    two seconds: a drive made up for it is mapped and held against its true poses. What is only absent (an extra, a
    lidar, ROS) is no fault, and is told with what brings it. Paste the output into a bug report.

    Exit code 0 where the mapping works, 1 where it does not.

    Example: contourslam doctor
    """

    json: Json = False

    def execute(self, command: str) -> int:
        """Look at everything, and tell."""
        from contourslam.cli.findings import examine

        findings = examine()
        well = all(finding.state != "wrong" for finding in findings)
        if self.json:
            # Not by print_json: that needs NumPy, which may be what is broken.
            print(json.dumps({"well": well, "findings": [asdict(finding) for finding in findings]}, indent=2))
            return 0 if well else 1
        for group, members in groupby(findings, key=lambda finding: finding.group):
            print(f"{group}")
            for finding in members:
                print(f"  {_mark(finding.state)} {finding.text}")
                if finding.advice:
                    print(f"      {finding.advice}")
        return 0 if well else 1


def _mark(state: str) -> str:
    sign, plain, colour = _MARKS[state]
    mark = sign if "utf" in (sys.stdout.encoding or "").lower() else plain
    return f"\x1b[{colour}m{mark}\x1b[0m" if colour_wanted(sys.stdout) else mark
