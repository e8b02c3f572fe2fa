"""What the tests allow to be said, in sentences."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from contourslam.evaluation.paired_tests import LEVEL
from contourslam.report.naming import label
from contourslam.report.paper import TABLE_I as PAPER
from contourslam.report.sweep.measures import Measure
from contourslam.report.sweep.statistics import Pair

T = TypeVar("T")

_FEWEST_SEEDS = math.ceil(1.0 - math.log2(LEVEL))
"""With which a signed-rank test alone can pass: if all agree, its two-sided p is 2 to the power of 1 - n."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """All pairs of detectors over the same drives.

    Attributes
    ----------
    setting : str
    where : str
        Rooms and conditions in words.
    pairs : sequence of Pair
    """

    setting: str
    where: str
    pairs: Sequence[Pair]

    @property
    def name(self) -> str:
        """Setting and drives."""
        return f"{label(self.setting)}, {self.where}"

    @property
    def seeds(self) -> int:
        """With how many both detectors of a pair were measured, at most."""
        return max((pair.test.seeds for pair in self.pairs), default=0)

    @property
    def shown(self) -> list[Pair]:
        """Pairs of which one is shown to be better."""
        return [pair for pair in self.pairs if pair.better is not None]

    def said(self, measure: Measure) -> str:
        """Say who is shown to be better than whom, and by how much."""
        return _capital(_said(self.pairs, measure))


def sentence(tested: Comparison, measure: Measure) -> str:
    """Say of which drives, and what their tests show."""
    return f"{tested.name}, {counted(tested.seeds, 'seed')}. {tested.said(measure)}"


def in_short(found: Sequence[Comparison], measure: Measure) -> list[str]:
    """Say in a few sentences what all comparisons by a measure come to.

    Parameters
    ----------
    found : sequence of Comparison
        One or more.
    measure : Measure
    """
    of = f"{counted(len(found), 'comparison')} (a setting in a room, or in all rooms)"
    if not any(one.shown for one in found):
        said = [f"No detector is shown to be better than another in {of}."]
        if all(pair.test.verdict == "too few seeds" for one in found for pair in one.pairs):
            most = counted(max(one.seeds for one in found), "seed")
            said.append(
                f"The seeds are too few to show anything: {most}, of {_FEWEST_SEEDS} that two detectors in one room "
                "need even where all seeds agree; more detectors or rooms need more."
            )
        return said
    best = [(name, one) for one in found if (name := _alone(one, lambda pair: str(pair.better)))]
    worst = [(name, one) for one in found if (name := _alone(one, _loser))]
    said = [
        f"Better than every other: {_places(best)}." if best else f"No detector is better than every other in {of}."
    ]
    if worst:
        said.append(f"Worse than every other: {_places(worst)}.")
    sizes = [(_larger(pair), one, pair) for one in found for pair in one.shown if math.isfinite(pair.test.median)]
    if sizes:
        size, one, pair = max(sizes, key=lambda each: each[0])
        told = f"{_names([_loser(pair)])} has {_amount(size, measure)} more than {label(str(pair.better))}"
        said.append(f"The largest difference shown: {told} ({one.name}).")
    settings = _by(found, lambda one: one.setting)
    lacking = {setting: sum(not one.shown for one in mine) for setting, mine in settings.items()}
    if any(lacking.values()):
        each = [f"{label(setting)} {lacking[setting]} of {len(mine)}" for setting, mine in settings.items()]
        said.append(f"Comparisons in which no difference is shown: {', '.join(each)}.")
    return said


def _alone(one: Comparison, key: Callable[[Pair], str]) -> str | None:
    """Detector that is better, or worse, than every other."""
    detectors = {name for pair in one.pairs for name in (pair.first, pair.second)}
    groups = _by(one.shown, key)
    return next((name for name, group in groups.items() if len(group) == len(detectors) - 1), None)


def _places(found: Sequence[tuple[str, Comparison]]) -> str:
    """Name detectors, each with the comparisons, setting by setting."""
    said = []
    for name, mine in _by(found, lambda each: each[0]).items():
        settings = _by([one for _, one in mine], lambda one: one.setting)
        where = (f"{label(setting)}: {', '.join(one.where for one in ones)}" for setting, ones in settings.items())
        said.append(f"{label(name)} ({'; '.join(where)})")
    return ", and ".join(said)


def _larger(pair: Pair) -> float:
    """By how much the worse one's error is larger, in the median over the seeds."""
    return pair.plain(abs(pair.test.median))


def counted(count: int, word: str) -> str:
    """Number and word, in the plural where there are several."""
    return f"{count:,} {word}{'s' * (count != 1)}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _said(found: Sequence[Pair], measure: Measure) -> str:
    shown = [pair for pair in found if pair.better is not None]
    if not shown:
        few = {pair.test.verdict for pair in found} == {"too few seeds"}
        return "too few seeds to show anything." if few else f"no difference shown{_reach(found, measure)}."
    winners, losers = _by(shown, lambda pair: str(pair.better)), _by(shown, _loser)
    if len(winners) <= len(losers):
        said = [f"{label(name)} is better than {_names(map(_loser, group))}" for name, group in winners.items()]
        groups = winners
    else:
        said = []
        for name, group in losers.items():
            verb = "is" if len(group) == 1 else "are"
            said.append(f"{_names(str(pair.better) for pair in group)} {verb} better than {label(name)}")
        groups = losers
    sized = [f"{text}{_size(group, measure)}" for text, group in zip(said, groups.values(), strict=True)]
    return f"{'; '.join(sized)}.{' No other difference is shown.' * (len(shown) < len(found))}"


def _by(found: Sequence[T], key: Callable[[T], str]) -> dict[str, list[T]]:
    groups: dict[str, list[T]] = {}
    for one in found:
        groups.setdefault(key(one), []).append(one)
    return groups


def _reach(found: Sequence[Pair], measure: Measure) -> str:
    """Tell how far the intervals of differences reach that were not shown."""
    ends = [pair.plain(end) for pair in found for end in (pair.interval.low, pair.interval.high)]
    known = [abs(end) for end in ends if math.isfinite(end)]
    if not known:
        return ""
    without = ", without the seeds that a run failed with" if any(pair.lost for pair in found) else ""
    return f" (each pair's own 95 % interval, uncorrected{without}: within {_amount(max(known), measure)})"


def _size(found: Sequence[Pair], measure: Measure) -> str:
    """Tell by how much the better ones are better, in the median over the seeds."""
    signs = [1.0 if pair.better == pair.first else -1.0 for pair in found]
    sizes = [-pair.plain(sign * pair.test.median) for pair, sign in zip(found, signs, strict=True)]
    known = sorted(size for size in sizes if math.isfinite(size))
    if not known:
        return " (which failed more often)"
    low, high = (_amount(known[i], measure) for i in (0, -1))
    number = low.partition(" ")[0]
    return f" (by {low})" if low == high else f" (by {number} to {high})"


def _amount(value: float, measure: Measure) -> str:
    return f"{100.0 * value:.1f} %" if measure.ratio else f"{measure.scale * value:.2g} {measure.step}".rstrip()


def _loser(pair: Pair) -> str:
    return pair.second if pair.better == pair.first else pair.first


def _names(names: Iterable[str]) -> str:
    words = [label(name) for name in names]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def beside_the_paper(means: Mapping[str, Mapping[str, float]], room: str) -> str | None:
    """Hold the spread between the paper's four detectors against the one in its Table I.

    Parameters
    ----------
    means : mapping of str to mapping of str to float
        Mean RMSE of the position of each detector by the setting, m.
    room : str

    Returns
    -------
    str or None
        None where no setting has all four.
    """
    theirs = [math.hypot(row["x"], row["y"]) for row in PAPER.values()]
    ours = {
        setting: values
        for setting, mean in means.items()
        if (values := [mean.get(name, math.nan) for name in PAPER]) and all(value > 0.0 for value in values)
    }
    if not ours:
        return None
    said = ", ".join(f"{max(values) / min(values):.2f} ({label(setting)})" for setting, values in ours.items())
    return (
        f"The mean error of the worst of the paper's four detectors over that of the best, in the {label(room)} where "
        f"the sweep's axes cross: {said}. In the paper's Table I, of one drive: {max(theirs) / min(theirs):.1f}."
    )
