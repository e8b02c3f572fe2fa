"""Decimal numbers out of text, fast: most of the time of reading a log goes there."""

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel

Floats = NDArray[np.float64]

# The integers and the powers of ten up to which a quotient of the two is the correctly rounded value of a decimal.
_EXACT_DIGITS = 15
_POWERS: Floats = np.array([10.0**k for k in range(_EXACT_DIGITS + 1)])


@kernel
def parse_plain_decimals(text: NDArray[np.uint8], powers: Floats, out: Floats) -> bool:
    """Parse numbers like ``-12.34``, separated by blanks, into `out` (kernel).

    Parameters
    ----------
    text : ndarray of uint8, shape (k,)
        ASCII codes.
    powers : ndarray
        Powers of ten; their number bounds the digits of a number.
    out : ndarray, shape (n,)
        Filled in.

    Returns
    -------
    bool
        False where the text holds anything else, or not exactly n numbers: it then takes a closer look.
    """
    position, length, found = 0, text.size, 0
    while True:
        while position < length and (text[position] == 32 or text[position] == 9):
            position += 1
        if position == length:
            return found == out.size
        if found == out.size:
            return False
        negative = text[position] == 45
        if negative:
            position += 1
        mantissa, digits, decimals, seen_point = 0, 0, 0, False
        while position < length and text[position] != 32 and text[position] != 9:
            code = text[position]
            if 48 <= code <= 57:
                digits += 1
                if digits >= powers.size:
                    return False
                mantissa = 10 * mantissa + (code - 48)
                if seen_point:
                    decimals += 1
            elif code == 46 and not seen_point:
                seen_point = True
            else:
                return False
            position += 1
        if digits == 0:
            return False
        value = mantissa / powers[decimals]
        out[found] = -value if negative else value
        found += 1


def parse_numbers(text: bytes, count: int) -> Floats:
    """Parse `count` numbers separated by blanks; the values are those that ``float`` gives.

    Parameters
    ----------
    text : bytes
    count : int
        How many numbers there must be.

    Returns
    -------
    ndarray, shape (count,)

    Raises
    ------
    ValueError
        If a word is not a number, or there are more or fewer.
    """
    out = np.empty(count)
    if not parse_plain_decimals(np.frombuffer(text, dtype=np.uint8), _POWERS, out):
        words = text.split()
        if len(words) != count:
            raise ValueError("wrong number of values")
        out[:] = np.array([float(word) for word in words])
    return out
