"""How many messages were dropped, or went without odometry, and why."""

from collections import deque
from dataclasses import dataclass

from contourslam.live.events import Incident, Reason, Source

RECENT = 100  # incidents told one by one; the others are in the counts alone
MOST = 4000  # incidents remembered for the counts of the last seconds


@dataclass(frozen=True, slots=True)
class Count:
    """Incidents of one kind.

    Attributes
    ----------
    number : int
    worst : float
        Largest delay among them, s.
    last : Incident
    """

    number: int
    worst: float
    last: Incident


class Tally:
    """Counts of incidents by source and reason; changed in place.

    Attributes
    ----------
    counts : dict
        From (source, reason) to :class:`Count`.
    """

    def __init__(self) -> None:
        self.counts: dict[tuple[Source, Reason], Count] = {}
        self._untold: deque[Incident] = deque(maxlen=RECENT)
        self._latest: deque[Incident] = deque(maxlen=MOST)

    def add(self, incident: Incident) -> None:
        """Count one."""
        _count(self.counts, incident)
        self._untold.append(incident)
        self._latest.append(incident)

    def number(self, source: Source, *reasons: Reason) -> int:
        """Give how many incidents of these reasons there were, or of all that lose a message where none is named."""
        return sum(
            count.number
            for (origin, reason), count in self.counts.items()
            if origin == source and (reason in reasons if reasons else reason.loses)
        )

    def new(self) -> tuple[Incident, ...]:
        """Give the incidents since the last call, oldest first; of many, the latest hundred."""
        incidents = tuple(self._untold)
        self._untold.clear()
        return incidents

    def since(self, then: float) -> dict[tuple[Source, Reason], Count]:
        """Give the counts of what happened since then, s on the caller's clock, the commonest first."""
        counts: dict[tuple[Source, Reason], Count] = {}
        for incident in self._latest:
            if incident.now >= then:
                _count(counts, incident)
        return dict(sorted(counts.items(), key=lambda item: -item[1].number))


def _count(counts: dict[tuple[Source, Reason], Count], incident: Incident) -> None:
    key = incident.source, incident.reason
    before = counts.get(key)
    number, worst = (0, incident.delay) if before is None else (before.number, before.worst)
    counts[key] = Count(number + 1, max(worst, incident.delay), incident)
