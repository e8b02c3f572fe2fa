"""Round numbers along an axis."""

import math


def ticks(low: float, high: float) -> list[float]:
    """Give about six round numbers between two."""
    step = 10.0 ** math.floor(math.log10((high - low) / 4.0))
    step *= next(factor for factor in (5.0, 2.0, 1.0) if step * factor <= (high - low) / 4.0)
    return [k * step for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def decades(low: float, high: float) -> list[float]:
    """Give 1, 2, 5 times the powers of ten between two logarithms; the powers alone where they are many."""
    factors = (1.0, 2.0, 5.0) if high - low < 4.0 else (1.0,)
    values = [f * 10.0**k for k in range(math.floor(low), math.ceil(high) + 1) for f in factors]
    return [value for value in values if low - 1e-9 <= math.log10(value) <= high + 1e-9]
