"""A recording is never held whole in memory."""

import gzip
import tracemalloc
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from contourslam.recordings import Message, Recording, open_recording, write_recording
from contourslam.scan import Odometry, evenly_spaced


def peak_of_reading(recording: Recording) -> tuple[int, int]:
    """Peak of the memory while all messages are read, and their number."""
    tracemalloc.start()
    count = sum(1 for _ in recording.messages())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak, count


@pytest.mark.parametrize("packed", [False, True])
def test_a_long_log_is_read_within_a_megabyte(tmp_path: Path, carmen_lines: list[bytes], packed: bool) -> None:
    path = tmp_path / "long.log"
    text = b"".join(carmen_lines) * 60
    path.write_bytes(gzip.compress(text, 1) if packed else text)
    list(open_recording(path).messages())  # compiles and imports what is needed
    peak, count = peak_of_reading(open_recording(path))
    assert count == 60 * 180 and len(text) > 3_000_000
    assert peak < 1_000_000


def test_a_long_bag_is_written_and_read_within_a_few_chunks(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)

    def run(steps: int) -> Iterable[Message]:
        for step in range(steps):
            yield Odometry(0.1 * step, np.zeros(3))
            yield evenly_spaced(
                0.1 * step,
                rng.uniform(0.5, 9.0, 2000),
                angle_min=-3.0,
                angle_increment=0.003,
                range_min=0.1,
                range_max=12.0,
            )

    write_recording(tmp_path / "warm", run(5))
    list(open_recording(tmp_path / "warm").messages())
    tracemalloc.start()
    write_recording(tmp_path / "run", run(800))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    size = (tmp_path / "run" / "run.mcap").stat().st_size
    assert size > 5_000_000
    # The writer keeps a chunk of a megabyte, packed and not, and the index of all messages.
    assert peak < 4_500_000
    peak, count = peak_of_reading(open_recording(tmp_path / "run"))
    assert count == 1600 and peak < 4_500_000
