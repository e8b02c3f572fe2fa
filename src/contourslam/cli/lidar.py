"""``contourslam lidar``: what a lidar on a serial port says and sees."""

import shutil
import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from contourslam.cli.console import note, print_json
from contourslam.cli.interrupt import Interrupt
from contourslam.cli.options import Baud, Json, Patience, Port
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from contourslam.robot.lidar.figures import LidarTally
    from contourslam.robot.lidar.ydlidar_x4 import DeviceInfo, YdlidarX4
    from contourslam.scan import LaserScan

_REDRAW = 0.2  # s


@dataclass(frozen=True)
class Lidar:
    """Look at a YDLidar X4: turns a second, beams, noise, damaged packets, and on a terminal a live picture from above.

    On a terminal it goes on until Ctrl-C; elsewhere, and with --json, it looks for some seconds and says what it saw.

    Example: contourslam lidar --port /dev/ttyUSB0
    """

    port: Port = None
    baud: Baud = 128000
    seconds: float | None = None
    """How long to look, s; on a terminal until Ctrl-C where left out, elsewhere 3."""
    patience: Patience = 30.0
    json: Json = False

    def execute(self, command: str) -> int:
        """Watch the lidar and say what was seen."""
        from contourslam.robot.lidar.figures import LidarTally
        from contourslam.robot.lidar.ydlidar_x4 import YdlidarX4

        if self.seconds is not None and not self.seconds > 0.0:
            raise ConfigError(f"--seconds must be above 0, got {self.seconds}")
        live = sys.stdout.isatty() and not self.json
        span = self.seconds if self.seconds is not None or live else 3.0
        tally, drawn = LidarTally(), 0.0
        with Interrupt() as interrupt, YdlidarX4(self.port, baud=self.baud, patience=self.patience) as lidar:
            info = lidar.info()
            scan = None
            for scan in lidar.scans(interrupt.or_after(span)):
                tally.add(scan)
                if live and time.monotonic() - drawn > _REDRAW:
                    drawn = time.monotonic()
                    _draw(scan, lidar, tally)
            found = _found(lidar, info, tally)
        if self.json:
            print_json(found)
        else:
            _print(found)
        if scan is None:
            note("no turn was completed; look for longer with --seconds")
            return 1
        return 0


def _found(lidar: "YdlidarX4", info: "DeviceInfo", tally: "LidarTally") -> dict[str, Any]:
    figures, parser = tally.figures(), lidar.turns.parser
    headers = parser.good + parser.bad
    return {
        "port": lidar.name,
        "model": info.model,
        "firmware": info.firmware,
        "hardware": info.hardware,
        "serial_number": info.serial_number,
        "scans": lidar.turns.turns,
        "rate": figures.rate,
        "beams": figures.beams,
        "returns": figures.returns,
        "noise": figures.noise,
        "packets": parser.good,
        "checksum_rate": parser.good / headers if headers else None,
        "bytes_skipped": parser.skipped,
        "restarts": lidar.restarts,
        "reconnections": lidar.reconnections,
        "motor_line": lidar.motor_line,
    }


def _print(found: dict[str, Any]) -> None:
    model = "X4" if found["model"] == 6 else f"model {found['model']}"
    print(f"{found['port']}: {model}, firmware {found['firmware']}, serial number {found['serial_number']}")
    print(f"turns:      {found['scans']}, {found['rate']:.2f} a second")
    print(f"beams:      {found['beams']} a turn, {found['returns']:.0%} return")
    print(f"noise:      {1000.0 * found['noise']:.1f} mm")
    rate = found["checksum_rate"]
    print(f"packets:    {found['packets']}, {'none' if rate is None else f'{rate:.2%}'} pass their checksum")
    if found["restarts"] or found["reconnections"]:
        print(f"trouble:    told {found['restarts']} times again to scan, opened {found['reconnections']} times anew")


def _draw(scan: "LaserScan", lidar: "YdlidarX4", tally: "LidarTally") -> None:
    from contourslam.robot.lidar.figures import polar_picture

    size = shutil.get_terminal_size()
    lines, metres = polar_picture(scan, size.columns - 1, size.lines - 3)
    figures, parser = tally.figures(), lidar.turns.parser
    passed = parser.good / max(parser.good + parser.bad, 1)
    head = (
        f"{figures.rate:5.2f} turns/s  {figures.beams:4d} beams  {figures.returns:4.0%} return  "
        f"noise {1000.0 * figures.noise:4.1f} mm  checksum {passed:7.2%}  line {metres:.2f} m"
    )
    text = "\n".join([head[: size.columns - 1], *lines])
    print(f"\x1b[H\x1b[2J{text}", flush=True)
