"""What the tests allow to be said, in sentences."""

import math
from collections.abc import Mapping, Sequence

from contourslam.report.naming import label
from contourslam.report.paper import TABLE_I as PAPER
from contourslam.report.sweep.measures import Measure
from contourslam.report.sweep.statistics import Pair
from contourslam.report.sweep.values import Condition


def of_rooms(condition: Condition, found: Sequence[Pair], rooms: Sequence[str], measure: Measure) -> str:
    """Say room by room which detectors are shown to be better than which under one condition."""
    said = [f"{label(room)}: {_said([pair for pair in found if pair.place == room], measure)}" for room in rooms]
    return f"{label(condition.setting)}, {condition.name}. {' '.join(map(_capital, said))}"


def of_all(setting: str, found: Sequence[Pair], conditions: int, rooms: int, measure: Measure) -> str:
    """Say the same over everything that a setting was run on."""
    drives = max((pair.test.drives for pair in found), default=0)
    over = f"{counted(rooms, 'room')} and {counted(conditions, 'condition')} together, {drives} drives"
    return f"{label(setting)}, {over}. {_capital(_said(found, measure))}"


def counted(count: int, word: str) -> str:
    """Number and word, in the plural where there are several."""
    return f"{count} {word}{'s' * (count != 1)}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _said(found: Sequence[Pair], measure: Measure) -> str:
    won: dict[str, list[Pair]] = {}
    for pair in found:
        if pair.better is not None:
            won.setdefault(pair.better, []).append(pair)
    if not won:
        drives = {pair.test.verdict for pair in found} == {"too few drives"}
        return "too few drives to show anything." if drives else f"no difference shown{_reach(found, measure)}."
    sentences = []
    for name, pairs in sorted(won.items(), key=lambda entry: -len(entry[1])):
        others = [f"{label(_loser(pair))}{_by(pair, measure)}" for pair in pairs]
        sentences.append(f"{label(name)} is better than {_listed(others)}")
    undecided = sum(pair.better is None for pair in found)
    left = f"; of the other {undecided} pairs no difference is shown" if undecided > 1 else ""
    return f"{'; '.join(sentences)}{left}."


def _reach(found: Sequence[Pair], measure: Measure) -> str:
    """Tell how large a difference may still be that was not shown, as far as the intervals know."""
    ends = [pair.plain(end) for pair in found for end in (pair.interval.low, pair.interval.high)]
    known = [abs(end) for end in ends if math.isfinite(end)]
    if not known:
        return ""
    size = f"{100 * max(known):.1f} %" if measure.ratio else f"{measure.scale * max(known):.3g} {measure.unit}"
    return f" (the intervals of the mean differences reach to {size})"


def _by(pair: Pair, measure: Measure) -> str:
    effect = pair.effect if pair.better == pair.first else _reversed(pair)
    if not math.isfinite(effect):
        return " (which failed more often)"
    if pair.ratio:
        return f" (by {-100 * effect:.1f} %)"
    return f" (by {-measure.scale * effect:.3g} {measure.unit})"


def _reversed(pair: Pair) -> float:
    """How much larger the second's error is than the first's."""
    return math.expm1(-pair.test.median) if pair.ratio else -pair.test.median


def _loser(pair: Pair) -> str:
    return pair.second if pair.better == pair.first else pair.first


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def beside_the_paper(means: Mapping[str, float], room: str) -> str | None:
    """Hold the spread between the paper's four detectors against the one in its Table I; None without all four.

    Parameters
    ----------
    means : mapping of str to float
        RMSE of the position of each detector in the room, m.
    room : str
    """
    theirs = {name: math.hypot(row["x"], row["y"]) for name, row in PAPER.items()}
    ours = [means[name] for name in theirs if math.isfinite(means.get(name, math.nan))]
    if len(ours) < len(theirs) or min(ours) <= 0.0:
        return None
    paper = max(theirs.values()) / min(theirs.values())
    return (
        f"Between the best and the worst of the paper's four detectors lies a factor of {max(ours) / min(ours):.2f} in "
        f"the mean RMSE of the position in the {label(room)}; in the paper's Table I, of one drive, it is {paper:.1f}."
    )
