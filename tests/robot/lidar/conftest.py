import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from contourslam.simulation.hardware.plugged_x4 import PluggedX4

sys.path.insert(0, str(Path(__file__).parent))  # the packets of a room, x4_device


@pytest.fixture
def device(tmp_path: Path) -> Iterator[PluggedX4]:
    with PluggedX4(tmp_path / "lidar") as made:
        yield made
