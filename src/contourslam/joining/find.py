"""Two maps that know nothing of each other: whether they overlap, and how."""

from collections.abc import Callable, Iterable

from contourslam.joining.chart import Chart
from contourslam.joining.joint import Apart, Joint
from contourslam.joining.looks import Look, look, turned_round

Observer = Callable[[int, int], None]


def find_joint(first: Chart, second: Chart, *, observer: Observer | None = None) -> Joint | Apart:
    """Find out whether two maps overlap, and how one lies to the other.

    Parameters
    ----------
    first, second : Chart
    observer : callable, optional
        Called after each view that was looked for, with how many are done and how many there are.

    Returns
    -------
    Joint or Apart
    """
    looks: list[Look] = []
    count = len(first.stretches) + len(second.stretches)
    for done in range(count):
        if done < len(second.stretches):
            looks += look(first, second, done)
        else:
            back = look(second, first, done - len(second.stretches))
            looks += [turned_round(each, second, first) for each in back]
        if observer is not None:
            observer(done + 1, count)
    return decide(first, second, looks)


def decide(first: Chart, second: Chart, looks: Iterable[Look]) -> Joint | Apart:
    """Decide from what was found of views.

    Parameters
    ----------
    first, second : Chart
    looks : iterable of Look
        Of views of the second map in the first, and of views of the first in the second, the latter given through
        :func:`contourslam.joining.looks.turned_round`; in any order.

    Returns
    -------
    Joint or Apart
    """
    return Apart("nothing alike")
