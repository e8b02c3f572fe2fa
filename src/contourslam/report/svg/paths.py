"""Points as the data of SVG paths: each relative to the one before, which is a third shorter than where they are.

The page's scripts read these paths again, so that it holds no number twice.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def lines(points: Floats, begins: NDArray[np.bool_], digits: int) -> str:
    """Give lines through points.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        px, finite.
    begins : ndarray of bool, shape (n,)
        Where a line begins anew; the first does.
    digits : int
        Decimals of a px that are kept.
    """
    words = [
        ("m" if begin else " " if not u.startswith("-") else "") + _joined(u, v)
        for (u, v), begin in zip(_steps(points, digits), begins.tolist(), strict=True)
    ]
    return "".join(words)


def segments(ends: Floats, digits: int) -> list[str]:
    """Give a piece of path for each straight line, shape (n, 2, 2); joined, they follow each other."""
    steps = _steps(ends.reshape(-1, 2), digits)
    return [f"m{_joined(*begin)}l{_joined(*end)}" for begin, end in zip(steps[::2], steps[1::2], strict=True)]


def dots(points: Floats, digits: int) -> list[str]:
    """Give a piece of path for each point; joined, they follow each other, and with round ends they are dots."""
    return [f"m{_joined(*step)}h0" for step in _steps(points, digits)]


def _steps(points: Floats, digits: int) -> list[tuple[str, str]]:
    """Give the way from each point to the next, from the origin to the first; rounding does not add up."""
    whole = np.round(points * 10.0**digits).astype(np.int64)
    steps = np.diff(whole, axis=0, prepend=np.zeros((1, 2), dtype=np.int64))
    return [(number(u, digits), number(v, digits)) for u, v in steps.tolist()]


def _joined(u: str, v: str) -> str:
    return f"{u}{v}" if v.startswith("-") else f"{u} {v}"


def number(value: int, digits: int) -> str:
    """Give a number of 1/10**digits in as few characters as it takes."""
    if not digits:
        return str(value)
    whole, part = divmod(abs(value), 10**digits)
    behind = f"{part:0{digits}d}".rstrip("0")
    said = f"{whole or ''}.{behind}" if behind else str(whole)
    return f"-{said}" if value < 0 else said
