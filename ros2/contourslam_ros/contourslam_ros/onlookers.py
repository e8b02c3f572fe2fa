"""Several who watch the mapping."""

from collections.abc import Sequence

from contourslam.live.processed import Processed
from contourslam.live.worker import Onlooker


class Onlookers:
    """Several onlookers as one, each in turn.

    Parameters
    ----------
    each : sequence of Onlooker
    """

    def __init__(self, each: Sequence[Onlooker]) -> None:
        self._each = each

    def take(self, processed: Processed) -> None:
        """Hand on what a scan gave."""
        for onlooker in self._each:
            onlooker.take(processed)

    def rest(self) -> None:
        """Let each do what can wait."""
        for onlooker in self._each:
            onlooker.rest()
