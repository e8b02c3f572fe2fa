"""``contourslam grid``: the occupancy grid of a run, when somebody wants it."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from contourslam.cli.console import complain, progress
from contourslam.cli.interrupt import INTERRUPTED, Interrupt, UntilStopped
from contourslam.errors import RecordingError, ResultError

if TYPE_CHECKING:
    from contourslam.recordings import Message


@dataclass(frozen=True)
class Grid:
    """Render the occupancy grid of a run for Nav2's map server: map.pgm and map.yaml, into its folder.

    The map itself is corners and walls; the grid shows what else the lidar saw, so the recording is read again, and its
    scans are placed at the run's poses. Ctrl-C stops and keeps what is done.

    Example: contourslam grid out/intel intel.log.xz
    """

    folder: tyro.conf.Positional[Path]
    """Folder that `contourslam run` wrote."""
    recording: tyro.conf.Positional[Path]
    """The recording that was mapped."""
    scan_topic: str | None = None
    """Topic of the scans; found by itself where there is only one."""
    resolution: float = 0.05
    """Side of a cell, m."""

    def execute(self, command: str) -> int:
        """Write the two files and say how large the grid is."""
        import numpy as np

        from contourslam.recordings import open_recording
        from contourslam.report.nav2_map import write_nav2_map
        from contourslam.report.result_folder import read_result_folder
        from contourslam.report.run_grid import run_grid

        stored = read_result_folder(self.folder)
        recording = open_recording(self.recording, scan_topic=self.scan_topic)
        lidar = stored.config.lidar
        mount = recording.lidar_mount or lidar.mount
        with Interrupt() as interrupt:
            messages = UntilStopped(recording.messages(), interrupt)
            grid = run_grid(
                progress(_undamaged(messages), "message"),
                stored.result,
                lidar_mount=np.array(mount),
                resolution=self.resolution,
                max_range=lidar.max_range,
            )
        if not grid.hits.any():
            raise messages.error or ResultError(
                f"{self.recording}: no scan of it has a place in {self.folder}; is it another recording?"
            )
        write_nav2_map(self.folder, grid)
        rows, columns = grid.cells()[0].shape
        print(f"{self.folder / 'map.yaml'}: {columns} x {rows} cells of {grid.resolution:g} m")
        if messages.error is not None:
            complain(f"{messages.error}; the grid shows what came before")
            return 1
        return INTERRUPTED if messages.interrupted else 0


def _undamaged(messages: "Iterable[Message]") -> "Iterator[Message]":
    """Yield what comes before the damage of a recording, which the caller asks for afterwards."""
    with suppress(RecordingError):
        yield from messages
