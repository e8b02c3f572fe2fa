"""``contourslam record``: the scans of a lidar, written as a recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from contourslam.cli.console import make_way, note, print_json
from contourslam.cli.interrupt import Interrupt
from contourslam.cli.options import Baud, Json, Overwrite, Patience, Port
from contourslam.errors import ConfigError


@dataclass(frozen=True)
class Record:
    """Record the scans of a YDLidar X4 until Ctrl-C, or for some seconds.

    The recording is a rosbag2 folder, which ROS 2 and Foxglove read. A standard scan has evenly spaced beams; the
    lidar's are put on such. Whatever ends the recording, Ctrl-C, a lidar unplugged for good or a full disk, what was
    recorded until then is whole and kept.

    Example: contourslam record -o out/room --seconds 60
    """

    output: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="DIR")]
    """Folder of the recording to write."""
    overwrite: Overwrite = False
    port: Port = None
    baud: Baud = 128000
    seconds: float | None = None
    """How long to record, s; until Ctrl-C where left out."""
    patience: Patience = 30.0
    json: Json = False

    def execute(self, command: str) -> int:
        """Record, and say what was written."""
        from tqdm import tqdm

        from contourslam.recordings import RecordingWriter
        from contourslam.robot.lidar.even_beams import even_beams
        from contourslam.robot.lidar.ydlidar_x4 import YdlidarX4

        if self.seconds is not None and not self.seconds > 0.0:
            raise ConfigError(f"--seconds must be above 0, got {self.seconds}")
        count, first, last = 0, 0.0, 0.0
        with Interrupt() as interrupt, YdlidarX4(self.port, baud=self.baud, patience=self.patience) as lidar:
            make_way(self.output, overwrite=self.overwrite)  # only once there is a lidar to replace it with
            with RecordingWriter(self.output) as writer:
                scans = lidar.scans(interrupt.or_after(self.seconds))
                for scan in tqdm(scans, unit=" scan", delay=1.0, disable=None, leave=False):
                    writer.write(even_beams(scan))
                    first, last, count = first if count else scan.stamp, scan.stamp, count + 1
        seconds = last - first
        if self.json:
            print_json({"recording": str(self.output), "scans": count, "seconds": seconds})
        else:
            print(f"{self.output}: {count} scans, {seconds:.1f} s")
            note(f"look into it with: contourslam info {self.output}")
        return 0
