"""Where the time went."""

from dataclasses import dataclass

from contourslam.slam.result import RunResult


@dataclass(frozen=True, slots=True)
class Timing:
    """Computing time of a run.

    Attributes
    ----------
    seconds : dict of str to float
        Time per stage, s, the slowest first.
    shares : dict of str to float
        The same as a share of the total.
    total : float
        s.
    scans_per_second : float or None
        None where no time was recorded.
    """

    seconds: dict[str, float]
    shares: dict[str, float]
    total: float
    scans_per_second: float | None


def timing(result: RunResult) -> Timing:
    """Time per stage, its share, and the rate of the whole.

    Parameters
    ----------
    result : RunResult

    Returns
    -------
    Timing
    """
    seconds = dict(sorted(result.seconds.items(), key=lambda item: -item[1]))
    total = sum(seconds.values())
    shares = {stage: time / total for stage, time in seconds.items()} if total > 0 else {}
    return Timing(seconds, shares, total, len(result.stamps) / total if total > 0 else None)
