"""Simulated seconds per second of several robots in one building, with wheel physics and without; target 3 robots at 1.

A 500-beam lidar at 10 Hz on each. The messages are made and dropped: no recording, no mapping. Seconds of computing, on
one core: everything runs in one thread.
"""

import argparse
import sys
import time
from itertools import islice

from contourslam.simulation.buildings import office_building
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.several import SeveralRobots
from table import Table, publish

ROLLING, GLIDING = (1, 3, 5, 10), (1, 3, 10, 30, 100)
CORRIDORS = {1: 2, 3: 2, 5: 2, 10: 3, 30: 4, 100: 8}  # in each direction: the smallest building with enough room
SEED = 4


def pace(robots: int, seconds: float, *, contact_free: bool) -> list[object]:
    """One row: how much is simulated in a second of the processor and of the clock."""
    building = office_building(CORRIDORS[robots], SEED)
    crew = SeveralRobots(building, SimulationConfig(duration=seconds), SEED, robots, contact_free=contact_free)
    messages = crew.messages()
    for _ in islice(messages, 50 * robots):  # compiles the kernels and the model
        pass
    clock, used = time.perf_counter(), time.process_time()
    for _ in messages:
        pass
    clock, used = time.perf_counter() - clock, time.process_time() - used
    mode, size = "gliding" if contact_free else "on wheels", len(building.room.pieces)
    return [mode, robots, size, seconds / used, seconds / clock]


def main() -> int:
    """Measure both ways of driving."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated for each row")
    seconds = parser.parse_known_args()[0].seconds
    rows = [pace(robots, seconds, contact_free=False) for robots in ROLLING]
    rows += [pace(robots, seconds, contact_free=True) for robots in GLIDING]
    columns = ("robots", "number", "pieces in the building", "simulated s per CPU s", "simulated s per s of the clock")
    publish(Table("several", columns, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
