"""What was probably meant, where a name or a file is not there."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

_ALIKE = 0.6  # share of equal letters from which a name counts as a slip of another one


def perhaps(name: str, choices: Iterable[str], place: str = "") -> str:
    """Give the end of a message that asks whether the nearest choice was meant.

    Parameters
    ----------
    name : str
        What was asked for and is not there.
    choices : iterable of str
        What there is.
    place : str
        What the choice is written after, such as ``"slam."``.

    Returns
    -------
    str
        ``"; did you mean X?"``, or nothing where no choice is near.

    Examples
    --------
    >>> perhaps("teh_chinn", ["wu", "teh_chin"])
    '; did you mean teh_chin?'
    """
    found = _nearest(name, choices)
    return f"; did you mean {place}{found}?" if found else ""


def no_such(kind: str, name: str, choices: Iterable[str]) -> str:
    """Say that there is no such thing, which was probably meant, and which there are.

    Parameters
    ----------
    kind : str
        What it would be, such as ``"detector"``.
    name : str
    choices : iterable of str

    Returns
    -------
    str
    """
    there = list(choices)
    return f"there is no {kind} {name!r}{perhaps(name, there)}; choose one of {', '.join(there)}"


def _nearest(name: str, choices: Iterable[str]) -> str | None:
    by_lower = {choice.lower(): choice for choice in choices}
    found = get_close_matches(name.lower(), by_lower, n=1, cutoff=_ALIKE)
    return by_lower[found[0]] if found else None


def unreadable(path: Path, error: OSError) -> str:
    """Say why a file cannot be read, and which one of its folder may have been meant.

    Parameters
    ----------
    path : Path
    error : OSError
        With which reading it ended.

    Returns
    -------
    str
    """
    said = f"{path}: cannot be read ({error.strerror or error})"
    return said + near_file(path) if isinstance(error, FileNotFoundError) else said


def near_file(path: Path) -> str:
    """Give the end of a message about a path that is not there: the nearest name where the path breaks off.

    Parameters
    ----------
    path : Path

    Returns
    -------
    str
        As of :func:`perhaps`.
    """
    parts = (path, *path.parents)
    there = next((i for i, parent in enumerate(parts) if parent.is_dir()), None)
    if not there:  # the path itself is there, or nothing of it
        return ""
    missing, folder = parts[there - 1], parts[there]
    try:
        names = {child.name for child in folder.iterdir()}
    except OSError:
        return ""
    found = _nearest(missing.name, sorted(names))
    return f"; did you mean {folder / found}?" if found and missing.name not in names else ""
