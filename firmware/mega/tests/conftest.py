import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # mega_bench

from mega_bench import Bench


@pytest.fixture
def bench() -> Iterator[Callable[..., Bench]]:
    """Make benches, with options of the board's program; all are switched off at the end."""
    with ExitStack() as stack:
        yield lambda *options, **others: stack.enter_context(Bench(*options, **others))


@pytest.fixture(scope="module")
def shared() -> Iterator[Bench]:
    """One bench for tests that leave it as they found it: stopped."""
    with Bench() as bench:
        bench.run(0.5)
        yield bench
