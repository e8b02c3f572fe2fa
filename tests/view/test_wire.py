import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from contourslam.view.wire import ALIGNED, CODES, pack

TYPES = st.sampled_from(sorted(CODES))


def unpack(message: bytes):
    """As the page does it."""
    length = int.from_bytes(message[:4], "little")
    header = json.loads(message[4 : 4 + length])
    arrays = {}
    for name, (code, at, count) in header["arrays"].items():
        assert (4 + length + at) % ALIGNED == 0
        arrays[name] = np.frombuffer(message, "<" + code, count, 4 + length + at)
    return header, arrays


@given(
    st.text(max_size=30),
    st.dictionaries(
        st.text(max_size=8), TYPES.flatmap(lambda t: hnp.arrays(t, hnp.array_shapes(max_dims=2))), max_size=4
    ),
)
def test_what_is_packed_is_read_back_where_a_browser_can_look_at_it(title, arrays) -> None:
    header, found = unpack(pack("map", {"title": title}, arrays))
    assert (header["kind"], header["title"]) == ("map", title)
    assert found.keys() == arrays.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(found[name], values.ravel())


def test_what_is_not_finite_becomes_null_which_json_knows() -> None:
    header, _ = unpack(pack("status", {"a": float("nan"), "b": [np.inf, 1.5], "c": np.array([np.nan, 2.0])}))
    assert (header["a"], header["b"], header["c"]) == (None, [None, 1.5], [None, 2.0])
