"""What the tests allow to be said, in sentences."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from contourslam.report.naming import label
from contourslam.report.paper import TABLE_I as PAPER
from contourslam.report.sweep.measures import Measure
from contourslam.report.sweep.statistics import Pair
from contourslam.report.sweep.values import Condition


def of_rooms(condition: Condition, found: Sequence[Pair], rooms: Sequence[str], measure: Measure) -> str:
    """Say room by room which detectors are shown to be better than which under one condition."""
    said = [f"{label(room)}: {_said([pair for pair in found if pair.place == room], measure)}" for room in rooms]
    return f"{label(condition.setting)}, {condition.name}. {' '.join(map(_capital, said))}"


def of_axes(setting: str, room: str, found: Sequence[Pair], conditions: int, measure: Measure) -> str:
    """Say the same of a room over all conditions that a setting was run on there."""
    drives = max((pair.test.drives for pair in found), default=0)
    over = f"{label(room)} over all its {conditions} conditions, {drives} drives"
    return f"{label(setting)}, {over}. {_capital(_said(found, measure))}"


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
    shown = [pair for pair in found if pair.better is not None]
    if not shown:
        few = {pair.test.verdict for pair in found} == {"too few drives"}
        return "too few drives to show anything." if few else f"no difference shown{_reach(found, measure)}."
    winners, losers = _grouped(shown, lambda pair: str(pair.better)), _grouped(shown, _loser)
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
    return f"{'; '.join(sized)}."


def _grouped(found: Sequence[Pair], key: Callable[[Pair], str]) -> dict[str, list[Pair]]:
    groups: dict[str, list[Pair]] = {}
    for pair in found:
        groups.setdefault(key(pair), []).append(pair)
    return groups


def _reach(found: Sequence[Pair], measure: Measure) -> str:
    """Tell how large a difference may still be that was not shown, as far as the intervals know."""
    ends = [pair.plain(end) for pair in found for end in (pair.interval.low, pair.interval.high)]
    known = [abs(end) for end in ends if math.isfinite(end)]
    return f" (intervals of the difference reach to {_amount(max(known), measure)})" if known else ""


def _size(found: Sequence[Pair], measure: Measure) -> str:
    """Tell by how much the better ones are better, in the median over the drives."""
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
