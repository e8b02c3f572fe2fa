"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import tyro

from contourslam.config import Config

Flag = Annotated[bool, tyro.conf.FlagCreatePairsOff]
Output = Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="DIR", help="Folder to write; made where needed.")]
Overwrite = Annotated[Flag, tyro.conf.arg(help="Replace what the output folder holds.")]
Json = Annotated[Flag, tyro.conf.arg(help="Print the result as JSON on standard output, for scripts.")]
Port = Annotated[str | None, tyro.conf.arg(help="Serial port; found by itself where only one can be the lidar's.")]
Baud = Annotated[int, tyro.conf.arg(help="Bits a second.")]
Patience = Annotated[float, tyro.conf.arg(help="How long to wait for a lidar that was unplugged, s.")]
Settings = Annotated[Config, tyro.conf.arg(name="")]
"""Every setting of the core as an option of its own name, without prefix: --detector, --walls, --sigma-range, ..."""
