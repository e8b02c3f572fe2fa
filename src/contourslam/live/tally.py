"""How many messages were dropped, or went without odometry, and why."""

from collections import deque
from dataclasses import dataclass

from contourslam.live.events import Incident, Reason, Source

RECENT = 100  # incidents told one by one; the others are in the counts alone


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
        self._recent: deque[Incident] = deque(maxlen=RECENT)

    def add(self, incident: Incident) -> None:
        """Count one."""
        key = incident.source, incident.reason
        before = self.counts.get(key)
        number, worst = (0, incident.delay) if before is None else (before.number, before.worst)
        self.counts[key] = Count(number + 1, max(worst, incident.delay), incident)
        self._recent.append(incident)

    def number(self, source: Source, *reasons: Reason) -> int:
        """Give how many incidents of these reasons there were, or of all that lose a message where none is named."""
        return sum(
            count.number
            for (origin, reason), count in self.counts.items()
            if origin == source and (reason in reasons if reasons else reason.loses)
        )

    def new(self) -> tuple[Incident, ...]:
        """Give the incidents since the last call, oldest first; of many, the latest hundred."""
        incidents = tuple(self._recent)
        self._recent.clear()
        return incidents
