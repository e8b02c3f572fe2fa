"""The painted room and its pictures, taken once."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from painted_room import Painted, painted_room, photographs


@pytest.fixture(scope="session")
def room() -> list[Painted]:
    return painted_room()


@pytest.fixture(scope="session")
def images(room: list[Painted]) -> list[np.ndarray]:
    return photographs(room)
