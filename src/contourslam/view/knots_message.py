"""Knots as the page gets them."""

from collections.abc import Sequence

import numpy as np

from contourslam.view.knots import Knot
from contourslam.view.wire import pack


def knots_message(first: int, knots: Sequence[Knot]) -> bytes:
    """Give the message of some knots; `first` is the place of the first of them."""
    return pack(
        "knots",
        {"first": first, "count": len(knots), "lanes": len(knots[0].lanes)},
        {
            "rows": np.stack([knot.row for knot in knots]),
            "poses": np.stack([knot.lanes for knot in knots]),
            "sizes": np.array([len(knot.ink) for knot in knots], dtype=np.int32),
            "ink": np.concatenate([knot.ink for knot in knots]),
        },
    )
