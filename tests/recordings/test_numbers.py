import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.recordings.numbers import _POWERS, parse_numbers, parse_plain_decimals

WORDS = st.one_of(
    st.floats(allow_nan=False).map(repr),
    st.decimals(allow_nan=False, allow_infinity=False, places=3).map(str),
    st.integers(-(10**20), 10**20).map(str),
    st.sampled_from(["81.91", "0", "-0.0", ".5", "5.", "1e3", "+2.5", "inf", "-nan", "00012.3400"]),
)


@settings(deadline=None)
@given(st.lists(WORDS, max_size=30), st.sampled_from([" ", "  ", "\t", " \r"]))
def test_the_numbers_are_those_that_float_gives(words: list[str], blank: str) -> None:
    got = parse_numbers(blank.join(words).encode(), len(words))
    expected = np.array([float(word) for word in words])
    assert np.array_equal(got, expected, equal_nan=True)
    assert np.array_equal(np.signbit(got), np.signbit(expected))


@settings(deadline=None)
@given(st.text(alphabet="0123456789.- \te", max_size=30), st.integers(0, 5))
def test_the_kernel_does_as_its_plain_twin(text: str, count: int) -> None:
    codes = np.frombuffer(text.encode(), dtype=np.uint8)
    compiled, plain = np.zeros(count), np.zeros(count)
    # Python integers, as NumPy's eight-bit ones would wrap where the compiled ones do not.
    twin = parse_plain_decimals.py_func(codes.astype(np.int64), _POWERS, plain)
    assert parse_plain_decimals(codes, _POWERS, compiled) == twin
    if twin:
        assert np.array_equal(compiled, plain)


@settings(deadline=None)
@given(st.binary(max_size=40), st.integers(0, 5))
def test_any_bytes_are_numbers_or_a_value_error(text: bytes, count: int) -> None:
    with contextlib.suppress(ValueError):
        assert parse_numbers(text, count).shape == (count,)


@pytest.mark.parametrize("text", [b"1 2", b"1 2 3 4", b"1 x 3", b"1 - 3", b"1 . 3", b"1 1.2.3 3", b""])
def test_a_wrong_number_of_values_or_a_word_is_refused(text: bytes) -> None:
    with pytest.raises(ValueError):
        parse_numbers(text, 3)
