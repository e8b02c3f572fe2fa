"""Chance in a run: every source draws from its own stream of the seed, so that more beams don't change the driving."""

import numpy as np

FLAWS, DRIVER, ODOMETRY, TURN_RATE, NOISE, LOOKS, CAMERA, TRAFFIC = range(8)


def stream(seed: int, source: int) -> np.random.Generator:
    """Return the generator of one source of chance (``FLAWS`` ... ``TRAFFIC``) in the run with this seed."""
    return np.random.default_rng([seed, source])


def seed_of(seed: int, robot: int) -> int:
    """Seed of one of several robots in the run with this seed, counted from 0; the first has the run's own."""
    return seed if robot == 0 else int(np.random.SeedSequence([seed, robot]).generate_state(1, np.uint64)[0] >> 1)
