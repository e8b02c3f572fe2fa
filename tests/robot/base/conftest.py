import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # the simulated Mega, mega_device

from mega_device import MegaDevice


@pytest.fixture
def mega(tmp_path: Path) -> Iterator[MegaDevice]:
    made = MegaDevice(tmp_path / "base")
    yield made
    made.close()
