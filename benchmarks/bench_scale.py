"""Time, memory, map and error against distance: simulated buildings that grow with the drive, each in its own process.

``bench_scale.py 100 300`` drives these distances (m) only. Not part of run_all.py, since all of it takes half an hour.
"""

import json
import sys
import tempfile
from pathlib import Path

from measure import SystemFailedError, measured
from table import Table, publish

DISTANCES, SEED = (100, 300, 1000, 3000, 10000), 0
COLUMNS = (
    *("distance, m", "scans", "ms a scan", "over the last tenth", "refinement at the end, s", "memory, MB"),
    *("landmarks", "map, kB", "loops", "RMSE, m", "as known at the time, m", "raw odometry, m"),
)


def row(distance: int) -> list[object]:
    """Drive one distance."""
    with tempfile.TemporaryDirectory() as name:
        figures, map_file = Path(name) / "figures.json", Path(name) / "map.geojson"
        script = Path(__file__).with_name("scale_drive.py")
        words = [sys.executable, str(script), str(distance), str(SEED), str(figures), str(map_file)]
        try:
            _, peak = measured(words, Path(name))
        except SystemFailedError as error:
            return [distance, str(error), *["-"] * (len(COLUMNS) - 2)]
        found, size = json.loads(figures.read_text()), map_file.stat().st_size
    times = [found["ms_per_scan"], found["ms_per_last_scan"], found["seconds_at_the_end"]]
    online = "″" if found["online_rmse"] is None else found["online_rmse"]
    errors = [found["rmse"], online, found["odometry_rmse"]]
    return [distance, found["scans"], *times, peak / 1e6, found["landmarks"], size / 1e3, found["loops"], *errors]


def main() -> None:
    rows = []
    for distance in [int(word) for word in sys.argv[1:] if word.isdigit()] or DISTANCES:
        rows.append(row(distance))
        print(*rows[-1], file=sys.stderr)
    publish(Table("scale", COLUMNS, rows))


if __name__ == "__main__":
    main()
