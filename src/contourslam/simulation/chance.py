"""Chance in a run: every source draws from its own stream of the seed, so that more beams don't change the driving."""

import numpy as np

FLAWS, DRIVER, ODOMETRY, TURN_RATE, NOISE, LOOKS, CAMERA = range(7)


def stream(seed: int, source: int) -> np.random.Generator:
    """Return the generator of one source of chance (``FLAWS`` ... ``CAMERA``) in the run with this seed."""
    return np.random.default_rng([seed, source])
