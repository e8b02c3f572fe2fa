"""Numbers in few bytes: all come back, few take few, and no bytes make the reader do anything but end."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.errors import MessageError
from contourslam.fleet import compact
from contourslam.fleet.compact import Reader, Writer

KINDS = np.array([0, 3, 12, 0])
NUMBERS = st.tuples(st.integers(0, 3), st.integers(-(2**62) + 1, 2**62 - 1))
SMALL = st.tuples(st.integers(0, 3), st.integers(-40, 40))


def packed(numbers: list[tuple[int, int]]) -> bytes:
    writer = Writer(KINDS)
    for context, value in numbers:
        writer.put(context, value)
    return writer.packed()


@given(st.lists(NUMBERS | SMALL, max_size=60))
def test_all_numbers_come_back_and_nothing_is_left_over(numbers: list[tuple[int, int]]) -> None:
    reader = Reader(packed(numbers), KINDS)
    assert [reader.take(context) for context, _ in numbers] == [value for _, value in numbers]
    reader.end()


@given(st.lists(st.tuples(st.integers(1, 62), st.integers(0, 2**62 - 1)), max_size=20))
def test_numbers_that_are_as_good_as_chance_take_their_bits_and_come_back(numbers: list[tuple[int, int]]) -> None:
    cut = [(-bits, value & ((1 << bits) - 1)) for bits, value in numbers]
    data = packed(cut)
    assert len(data) <= sum(bits for bits, _ in numbers) / 8 + 6
    reader = Reader(data, KINDS)
    assert [reader.take(context) for context, _ in cut] == [value for _, value in cut]


def test_numbers_that_are_alike_take_little_more_than_what_they_tell() -> None:
    rng = np.random.default_rng(0)
    values = np.rint(3.0 * rng.standard_normal(4000)).astype(np.int64)
    shares = np.unique(values, return_counts=True)[1] / len(values)
    told = -float(np.sum(shares * np.log2(shares))) * len(values) / 8
    writer = Writer(KINDS)
    writer.extend(np.zeros(len(values), np.int64), values)
    assert told < len(writer.packed()) < 1.05 * told


def test_the_same_kernels_in_plain_python_give_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    contexts, values = rng.integers(0, 4, 200), (rng.standard_normal(200) * 10 ** rng.uniform(0, 6, 200)).astype(int)
    writer = Writer(KINDS)
    writer.extend(contexts, values)
    compiled = writer.packed()
    for name in ("_fresh", "_likelihood", "_learn", "_carry", "_put_bit", "_put_even", "_put", "_pack"):
        monkeypatch.setattr(compact, name, getattr(compact, name).py_func)
    assert writer.packed() == compiled


@settings(max_examples=200)
@given(st.binary(max_size=80), st.lists(st.integers(0, 3), max_size=200))
def test_no_bytes_make_the_reader_do_anything_but_end(data: bytes, contexts: list[int]) -> None:
    reader = Reader(data, KINDS)
    try:
        assert all(abs(reader.take(context)) < 2**62 for context in contexts)
    except MessageError as error:
        assert "ends too early" in str(error)


@given(st.lists(NUMBERS, min_size=4, max_size=30), st.integers(6, 40))
def test_numbers_cut_short_are_told_from_whole_ones(numbers: list[tuple[int, int]], less: int) -> None:
    data = packed(numbers)
    reader = Reader(data[: max(len(data) - less, 0)], KINDS)
    with pytest.raises(MessageError, match="ends too early"):
        for context in [context for context, _ in numbers] + [-62, -62]:
            reader.take(context)


@pytest.mark.parametrize("value", [-1, 101, 2**40])
def test_a_count_is_held_against_what_there_can_be(value: int) -> None:
    with pytest.raises(MessageError, match=f"speaks of {value} things"):
        Reader(packed([(0, value)]), KINDS).count(0, 100)


def test_counts_that_no_bytes_follow_take_no_memory() -> None:
    with pytest.raises(MessageError, match="no room"):
        Reader(packed([(0, 50_000)]), KINDS).count(0, 10**9)


def test_what_is_too_much_for_one_message_is_not_packed() -> None:
    with pytest.raises(MessageError, match="too many for one message"):
        Writer(KINDS).count(0, 11, 10)
    writer = Writer(KINDS)
    writer.count(0, compact.MOST_THINGS, 10**9)
    with pytest.raises(MessageError, match="too many for one message"):
        writer.count(0, 1, 10**9)
