"""A process that compiles what the tests' nodes map with, and what tells a fleet of it."""

import tempfile
from pathlib import Path

from contourslam.fleet.rehearsal import rehearse
from contourslam.live.rehearsal import stages
from contourslam_ros.settings import Settings

with tempfile.TemporaryDirectory() as folder:
    work = dict(stages(Path(folder)))
    for name in ("mapping, graph", "continuing a map, graph", "localising"):
        work[name]()
rehearse(Settings().core)
