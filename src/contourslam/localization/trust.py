"""Whether a robot that is followed is where it is thought to be: counted over scans that fit the map well or badly."""

from contourslam.matching.odometry import POOR

USUAL = 0.85  # part of a scan that fits its map, before the drive has told
LEAST_USUAL = 0.6  # so much of it at least, however much has changed
LEARN = 0.02  # weight of the newest scan in what is usual
LOST = 8  # poor scans in a row, after which the map is no longer believed
FOUND = 3  # good scans in a row that end all doubt
CHECK_EVERY = 5.0  # s; where a scan fits in part only, a second opinion is asked for, if the last one is this long ago


class Trust:
    """Counts scans; changed in place.

    Attributes
    ----------
    localized : bool
        Whether the pose is believed.
    poor : int
        Poor scans since all was well; 0 where it is.
    weak : bool
        Whether the last scan fitted in part only.
    """

    def __init__(self) -> None:
        self.localized, self.poor, self.weak = False, LOST, False
        self._usual, self._good, self._unchecked = USUAL, 0, 0.0

    @property
    def enough(self) -> float:
        """Overlap from which a scan fits as well as usual."""
        return POOR * max(self._usual, LEAST_USUAL)

    def quality(self, overlap: float) -> float:
        """Overlap as a part of the usual one, at most 1."""
        return min(overlap / max(self._usual, LEAST_USUAL), 1.0)

    def count_poor(self) -> None:
        """Count a scan that fits badly."""
        self.poor += 1
        self._good, self.weak = 0, False
        self.localized = self.localized and self.poor < LOST

    def count_good(self, overlap: float, elapsed: float) -> None:
        """Count a scan that fits: as well as usual, or in part, `elapsed` s after the one before."""
        self._good += 1
        if self._good >= FOUND:
            self.localized, self.poor = True, 0
        if not self.localized:
            return
        self._unchecked += elapsed
        self.weak = overlap < self.enough
        if not self.weak:  # what has changed stays unusual
            self._usual += LEARN * (overlap - self._usual)

    def found(self) -> None:
        """Begin anew where the robot was found."""
        self.localized, self.poor, self._good, self.weak, self._unchecked = True, 1, 0, False, 0.0

    def wants_check(self) -> bool:
        """Whether a second opinion is to be asked for; having said so, not again for a while."""
        if not self.weak or self._unchecked < CHECK_EVERY:
            return False
        self._unchecked = 0.0
        return True
