"""``contourslam warm-up``: everything compiled before the robot drives."""

import tempfile
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from contourslam.cli.console import note, print_json
from contourslam.cli.options import Flag, Json
from contourslam.errors import ContourslamError

if TYPE_CHECKING:
    from contourslam.live.rehearsal import Stage


class _ColdError(ContourslamError):
    """A kernel is not in the cache."""


@dataclass(frozen=True)
class WarmUp:
    """Compile everything that runs on a robot, so that its first scan is not late by a minute.

    A drive made up for it goes through mapping, localisation and the detectors, and a fleet is told of it; what is
    compiled on the way is cached for later processes of the same user, beside the package or in NUMBA_CACHE_DIR. Repeat
    it after an update of contourslam, Numba or Python. It takes a minute or two on a laptop, about five times that on a
    Raspberry Pi, and up to 800 MB of memory, which no later start needs.

    Example: contourslam warm-up
    """

    check: Flag = False
    """Compile nothing: say whether all is warm, with exit code 1 if it is not."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Drive, and say how many kernels were compiled, in what time and where they are kept."""
        from time import perf_counter

        from tqdm import tqdm

        from contourslam.kernels import watch_compilation
        from contourslam.live.rehearsal import cache_folder, stages

        compiled: list[str] = []
        bar = tqdm(desc="compiling", unit=" kernels", bar_format="{desc}: {n} kernels, {elapsed}", delay=1.0,
                   disable=None, leave=False)  # fmt: skip

        def begun(kernel: str) -> None:
            if self.check:
                raise _ColdError(f"{kernel} is not compiled; run `contourslam warm-up` as the same user")
            compiled.append(kernel)
            bar.update()

        start = perf_counter()
        with tempfile.TemporaryDirectory() as folder, watch_compilation(begun), bar:
            for name, run in [*stages(Path(folder)), *_fleet(), ("occupancy grid", _draw_grid)]:
                bar.set_description_str(name)
                run()
        seconds, place = perf_counter() - start, cache_folder()
        if self.json:
            print_json({"compiled": len(compiled), "seconds": seconds, "cache": str(place)})
        elif compiled:
            print(f"compiled {len(compiled)} kernels in {seconds:.0f} s; they are kept in {place}")
        else:
            print(f"all is warm: nothing was left to compile ({seconds:.1f} s); kept in {place}")
        if not self.check and find_spec("gtsam") is None:
            note("the graph back end was left out: GTSAM is not installed")
        return 0


def _fleet() -> "list[Stage]":
    """What a fleet's robots and server run; nothing without the graph, which they map with."""
    if find_spec("gtsam") is None:
        return []
    from contourslam.cli.run import DEFAULTS
    from contourslam.fleet.rehearsal import rehearse

    return [("a fleet's robots and server", partial(rehearse, DEFAULTS))]


def _draw_grid() -> None:
    """Let one beam into an occupancy grid, which a node publishes."""
    import numpy as np

    from contourslam.report.occupancy import OccupancyGrid

    OccupancyGrid().add(np.zeros((1, 2)), np.ones((1, 2)))
