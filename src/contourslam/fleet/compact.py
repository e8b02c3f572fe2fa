"""Whole numbers in few bytes: an adaptive binary range coder, and a way to tell numbers by their size, sign and digits.

The coder is the binary one of LZMA, with carries (Martin, "Range encoding", 1979): each decision is coded by how likely
it was found to be among those of its kind, and each kind of number has kinds of decision of its own.
"""

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Ints
from contourslam.errors import MessageError
from contourslam.kernels import kernel

Bytes = NDArray[np.uint8]
States = NDArray[np.uint16]

# Of each context: sizes (bits of the magnitude, one decision each), signs by size, and the digits after the first one.
SIZES = 62  # bits that a magnitude may have
DIGITS = 4  # digits whose likelihood is learned; those after them are as good as chance
ROOM = SIZES + 1 + SIZES + 1 + (SIZES + 1) * (1 << DIGITS)
# A likelihood learns as an average does, and from so many decisions on as a running one: numbers change on the way.
LONG = 40
HALF, LIKELY, GUESSED = 1 << 15, 61440, 4  # what is guessed of the sizes counts as much as so many decisions
DENSEST = 710  # numbers a byte that there can be: each takes a decision, and that costs 0.011 bits at least
SPARED = 4  # zeros at the end that are left out
MOST_THINGS = 100_000  # of which one message may speak


@kernel
def _fresh(sizes: Ints) -> States:
    """Likelihoods of a zero, out of 2**16, and from how many decisions they are; of each decision of each context."""
    states = np.empty((sizes.size * ROOM, 2), np.uint16)
    states[:, 0], states[:, 1] = HALF, 0
    for context in range(sizes.size):
        for n in range(sizes[context] - 2):
            states[context * ROOM + n, 0], states[context * ROOM + n, 1] = 65536 - LIKELY, GUESSED
    return states


@kernel
def _learn(states: States, at: int, bit: int) -> None:
    was, number = np.int64(states[at, 0]), np.int64(states[at, 1])
    states[at, 0] = was + ((0 if bit else 65535) - was) // (number + 2)
    states[at, 1] = number + 1 if number < LONG else LONG


@kernel
def _likelihood(states: States, at: int) -> int:
    """Of a zero, out of 2**16; never 0, and never all."""
    likelihood = int(states[at, 0])
    return 512 if likelihood < 512 else 65536 - 512 if likelihood > 65536 - 512 else likelihood


@kernel
def _carry(out: Bytes, state: Ints) -> None:
    """Put out the top byte of the low end; `state`: low, range, byte held back, how many 255 follow it, bytes out."""
    low = state[0]
    if low < 0xFF000000 or low > 0xFFFFFFFF:
        carry = low >> 32
        held = state[2]
        if held >= 0:
            out[state[4]] = (held + carry) & 0xFF
            state[4] += 1
        for _ in range(state[3]):
            out[state[4]] = (0xFF + carry) & 0xFF
            state[4] += 1
        state[3] = 0
        state[2] = (low >> 24) & 0xFF
    else:
        state[3] += 1
    state[0] = (low & 0x00FFFFFF) << 8


@kernel
def _put_bit(out: Bytes, state: Ints, states: States, at: int, bit: int) -> None:
    bound = (state[1] >> 16) * _likelihood(states, at)
    if bit:
        state[0] += bound
        state[1] -= bound
    else:
        state[1] = bound
    _learn(states, at, bit)
    while state[1] < 1 << 24:
        state[1] <<= 8
        _carry(out, state)


@kernel
def _put_even(out: Bytes, state: Ints, bit: int) -> None:
    state[1] >>= 1
    if bit:
        state[0] += state[1]
    while state[1] < 1 << 24:
        state[1] <<= 8
        _carry(out, state)


@kernel
def _put(out: Bytes, state: Ints, states: States, context: int, value: int) -> None:
    if context < 0:
        for n in range(-context - 1, -1, -1):
            _put_even(out, state, (value >> n) & 1)
        return
    first = context * ROOM
    magnitude, size = abs(value), 0
    while magnitude >> size:
        size += 1
    for n in range(size):
        _put_bit(out, state, states, first + n, 1)
    if size < SIZES:
        _put_bit(out, state, states, first + size, 0)
    if size == 0:
        return
    _put_bit(out, state, states, first + SIZES + 1 + size, 1 if value < 0 else 0)
    tree, node = first + 2 * (SIZES + 1) + (size << DIGITS), 1
    for n in range(size - 2, -1, -1):
        bit = (magnitude >> n) & 1
        if node < 1 << DIGITS:
            _put_bit(out, state, states, tree + node, bit)
            node = 2 * node + bit
        else:
            _put_even(out, state, bit)


@kernel
def _pack(contexts: Ints, values: Ints, sizes: Ints, out: Bytes) -> int:
    """Code all values; returns the number of bytes."""
    states = _fresh(sizes)
    state = np.array([0, 0xFFFFFFFF, -1, 0, 0], np.int64)
    for i in range(values.size):
        _put(out, state, states, contexts[i], values[i])
    for _ in range(5):
        _carry(out, state)
    count = least = state[4]
    while count > max(least - SPARED, 0) and out[count - 1] == 0:  # the reader takes zeros beyond the end
        count -= 1
    return int(count)


class Writer:
    """Numbers on their way into bytes; changed in place.

    Parameters
    ----------
    sizes : ndarray of int64
        One for each context, which is a kind of number: about how many bits they have, 0 where nothing is known.
    """

    def __init__(self, sizes: Ints) -> None:
        self._sizes = sizes
        self._contexts: list[int] = []
        self._values: list[int] = []
        self._things = 0

    def put(self, context: int, value: int) -> None:
        """Add a number below 2**62 in magnitude; where the context is -n, one of n bits that are as good as chance."""
        self._contexts.append(context)
        self._values.append(value)

    def extend(self, contexts: Ints, values: Ints) -> None:
        """Add many numbers."""
        self._contexts += contexts.tolist()
        self._values += values.tolist()

    def count(self, context: int, value: int, most: int) -> None:
        """Add a number of things that follow.

        Raises
        ------
        MessageError
            If it is above `most`, or the message speaks of too much as a whole.
        """
        self._things += value
        if value > most or self._things > MOST_THINGS:
            raise MessageError(f"{value} things are too many for one message; send them in several")
        self.put(context, value)

    def packed(self) -> bytes:
        """Give all numbers as bytes."""
        contexts, values = np.array(self._contexts, np.int64), np.array(self._values, np.int64)
        out = np.empty(16 * len(values) + 16, np.uint8)
        return out[: _pack(contexts, values, self._sizes, out)].tobytes()


@kernel
def _next_byte(data: Bytes, state: Ints) -> int:
    """Give the next byte; zeros beyond the end, which `state` counts on."""
    at = state[2]
    state[2] += 1
    return int(data[at]) if at < data.size else 0


@kernel
def _take_bit(data: Bytes, state: Ints, states: States, at: int) -> int:
    bound = (state[1] >> 16) * _likelihood(states, at)
    if state[0] < bound:
        state[1], bit = bound, 0
    else:
        state[0] -= bound
        state[1] -= bound
        bit = 1
    _learn(states, at, bit)
    while state[1] < 1 << 24:
        state[1] <<= 8
        state[0] = (state[0] << 8) | _next_byte(data, state)
    return bit


@kernel
def _take_even(data: Bytes, state: Ints) -> int:
    state[1] >>= 1
    bit = 0
    if state[0] >= state[1]:
        state[0] -= state[1]
        bit = 1
    while state[1] < 1 << 24:
        state[1] <<= 8
        state[0] = (state[0] << 8) | _next_byte(data, state)
    return bit


@kernel
def take(data: Bytes, state: Ints, states: States, context: int) -> int:
    """Decode one number; the reader's own kernels call it, everybody else :meth:`Reader.take`."""
    if context < 0:
        plain = 0
        for _ in range(-context):
            plain = 2 * plain + _take_even(data, state)
        return plain
    first, size = context * ROOM, 0
    while size < SIZES and _take_bit(data, state, states, first + size):
        size += 1
    if size == 0:
        return 0
    negative = _take_bit(data, state, states, first + SIZES + 1 + size)
    tree, node, magnitude = first + 2 * (SIZES + 1) + (size << DIGITS), 1, 1
    for _ in range(size - 1):
        if node < 1 << DIGITS:
            bit = _take_bit(data, state, states, tree + node)
            node = 2 * node + bit
        else:
            bit = _take_even(data, state)
        magnitude = 2 * magnitude + bit
    return -magnitude if negative else magnitude


@kernel
def _begin(data: Bytes, state: Ints) -> None:
    state[1] = 0xFFFFFFFF
    for _ in range(4):
        state[0] = (state[0] << 8) | _next_byte(data, state)


class Reader:
    """Numbers out of what a :class:`Writer` packed; changed in place.

    Parameters
    ----------
    data : bytes
    sizes : ndarray of int64
        As it was packed with.

    Attributes
    ----------
    parts : tuple of ndarray
        The first three arguments of :func:`take`, for kernels that decode many numbers.
    """

    def __init__(self, data: bytes, sizes: Ints) -> None:
        self._data = np.frombuffer(data, np.uint8)
        self._things = min(MOST_THINGS, DENSEST * (len(data) + SPARED))
        self._state = np.zeros(3, np.int64)
        _begin(self._data, self._state)
        self.parts = self._data, self._state, _fresh(sizes)

    def take(self, context: int) -> int:
        """Give the next number, of this kind.

        Raises
        ------
        MessageError
            If there is none.
        """
        value = int(take(*self.parts, context))
        self.check()
        return value

    def count(self, context: int, most: int) -> int:
        """Give a number of things that follow, held against the bytes that there are.

        Raises
        ------
        MessageError
            If it is negative, above `most`, or more than so few bytes can hold.
        """
        value = self.take(context)
        if not 0 <= value <= min(most, self._things):
            raise MessageError(f"it speaks of {value} things, for which it has no room; it is damaged or foreign")
        self._things -= value
        return value

    def check(self) -> None:
        """Refuse to go on beyond the end.

        Raises
        ------
        MessageError
            If more was read than there is.
        """
        if self._state[2] > len(self._data) + SPARED:
            raise MessageError("it ends too early; it is damaged or foreign")

    def end(self) -> None:
        """Refuse what is left over.

        Raises
        ------
        MessageError
            If the numbers read do not take all bytes.
        """
        self.check()
        if self._state[2] + 4 < len(self._data):
            raise MessageError("it goes on after its end; it is damaged or foreign")
