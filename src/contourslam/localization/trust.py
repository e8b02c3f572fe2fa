"""Whether a robot that is followed is where it is thought to be: counted over scans that fit the map well or badly."""

from contourslam.matching.odometry import POOR

USUAL = 0.85  # part of a scan that fits its map, before the drive has told
LEAST_USUAL = 0.6  # so much of it at least, however much has changed
LEARN = 0.02  # weight of the newest scan in what is usual
LOST = 8  # poor scans in a row, after which the map is no longer believed
FOUND = 3  # good scans in a row that end all doubt
CHECK_EVERY = 5.0  # s of scans that fit in part only, after which a second opinion is asked for


class Trust:
    """Counts scans; changed in place.

    Attributes
    ----------
    localized : bool
        Whether the pose is believed.
    poor : int
        Poor scans since all was well; 0 where it is.
    weak_for : float
        How long scans have fitted in part only, s, since a second opinion was asked for.
    """

    def __init__(self) -> None:
        self.localized, self.poor, self.weak_for = False, LOST, 0.0
        self._usual, self._good = USUAL, 0

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
        self._good = 0
        self.localized = self.localized and self.poor < LOST

    def count_good(self, overlap: float, elapsed: float) -> None:
        """Count a scan that fits: as well as usual, or in part, `elapsed` s after the one before."""
        self._good += 1
        if self._good >= FOUND:
            self.localized, self.poor = True, 0
        if not self.localized:
            return
        if overlap >= self.enough:
            self._usual += LEARN * (overlap - self._usual)
            self.weak_for = 0.0
        else:  # what has changed stays unusual, so that the doubt does
            self.weak_for += elapsed

    def found(self) -> None:
        """Begin anew where the robot was found."""
        self.localized, self.poor, self._good, self.weak_for = True, 1, 0, 0.0

    @property
    def check_due(self) -> bool:
        """Whether a second opinion is to be asked for."""
        return self.weak_for > CHECK_EVERY
