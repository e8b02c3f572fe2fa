"""What is damaged is never obeyed, what is whole always is: the board against the host's own decoder."""

import json
import struct
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mega_bench import MEGA, Bench, framed

from contourslam.robot.base.messages import (
    REFUSED,
    TO_BASE,
    Ack,
    Drive,
    Hello,
    HelloReply,
    Message,
    Stop,
    Tune,
)
from contourslam.robot.base.protocol import RefusedError, decode, encode

VECTORS = json.loads((MEGA / "vectors.json").read_text())
GOOD = {vector["name"]: vector for vector in VECTORS["good"] if vector["to"] == "base"}
RESULT = {"type": 1, "length": 2, "value": 3}
LINE = 11520  # bytes a second


def answers_to(stream: bytes, last: int) -> tuple[list[Message | None], int, bool]:
    """What the base shall answer (None: a greeting), its last command afterwards, and whether anything was refused."""
    answers: list[Message | None] = []
    refused = False
    for coded in stream.split(b"\0")[:-1]:
        if not coded:
            continue
        try:
            message, last = decode(coded, TO_BASE)
            if isinstance(message, Stop | Tune):
                answers.append(Ack(last, 0))
            if isinstance(message, Hello):
                answers.append(None)
        except RefusedError as refusal:
            refused = True
            if refusal.sequence is not None:
                answers.append(Ack(refusal.sequence, RESULT[refusal.reason]))
    return answers, last, refused


def hear(mega: Bench, stream: bytes) -> tuple[list[Message | None], int, bool]:
    """What the base did answer, its last command afterwards, and whether it says that it refused anything."""
    said, states = len(mega.said()), len(mega.states())
    mega.run(0.045 + len(stream) / LINE + 0.04, stream)
    answers = [None if isinstance(message, HelloReply) else message for message in mega.said()[said:]]
    return answers, mega.state().last_command, any(state.flags & REFUSED for state in mega.states()[states:])


@pytest.mark.parametrize("name", GOOD)
def test_every_good_vector_is_obeyed(shared: Bench, name: str) -> None:
    vector = GOOD[name]
    stop = encode(Stop(), vector["sequence"] ^ 1)
    shared.run(0.05, stop)
    answers, last, refused = hear(shared, bytes.fromhex(vector["frame"]))
    wanted = {"STOP": [Ack(last, 0)], "TUNE": [Ack(last, 0)], "HELLO": [None], "DRIVE": []}
    assert answers == wanted[vector["message"]]
    assert last == vector["sequence"]
    assert not refused
    fields = vector["fields"]
    if vector["message"] == "DRIVE" and any(fields.values()):
        shared.run(0.05, bytes.fromhex(vector["frame"]))
        assert [duty > 0 for duty in shared.duty] == [fields["left"] > 0, fields["right"] > 0]
    shared.run(0.05, encode(Tune(0.15, 2.5, 0.0, 0.125), 0) + encode(Stop(), 1))


@pytest.mark.parametrize("vector", VECTORS["refused"], ids=lambda vector: vector["name"])
def test_no_refused_vector_is_obeyed(shared: Bench, vector: dict[str, str]) -> None:
    shared.run(0.05, encode(Stop(), 77))
    frame = bytes.fromhex(vector["frame"])
    answers, last, refused = hear(shared, frame)
    assert answers == ([Ack(9, RESULT[vector["reason"]])] if vector["reason"] in RESULT else [])
    assert last == 77
    assert refused
    assert shared.duty == (0, 0)
    with pytest.raises(RefusedError, match=vector["reason"]):
        decode(frame[:-1], TO_BASE)


@pytest.mark.parametrize("vector", VECTORS["streams"], ids=lambda vector: vector["name"])
def test_every_stream_is_obeyed_where_it_is_whole(shared: Bench, vector: dict[str, str | list[str]]) -> None:
    shared.run(0.05, encode(Stop(), 77))
    stream = bytes.fromhex(str(vector["bytes"]))
    obeyed = [GOOD[name] for name in vector["obeyed"]]
    answers, last, _ = hear(shared, stream)
    assert last == obeyed[-1]["sequence"]
    assert [answer for answer in answers if not isinstance(answer, Ack) or answer.result == 0] == [
        None if good["message"] == "HELLO" else Ack(good["sequence"], 0)
        for good in obeyed
        if good["message"] != "DRIVE"
    ]
    shared.run(0.05, encode(Stop(), 1))


def test_a_good_vector_of_the_host_is_what_the_board_says(bench: Callable[..., Bench]) -> None:
    """The board's own frames have the lengths and the order of fields of the vectors."""
    mega = bench()
    raw = b"".join(mega.step(0.005).sent for _ in range(20))
    frames = [frame for frame in raw.split(b"\0") if frame]
    by_type = {vector["message"]: len(bytes.fromhex(vector["frame"])) for vector in VECTORS["good"]}
    assert len(frames[0]) + 1 == by_type["HELLO_REPLY"]
    assert {len(frame) + 1 for frame in frames[1:]} == {by_type["STATE"]}


def test_no_frame_with_one_bit_flipped_is_obeyed(shared: Bench) -> None:
    shared.run(0.05, encode(Stop(), 77))
    whole = encode(Drive(2600, -2600), 9)
    for bit in range(8 * len(whole)):
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        shared.run(0.005, bytes(damaged) + b"\0")
    shared.run(0.05)
    assert shared.state().last_command == 77
    assert all(state.duty == (0, 0) for state in shared.states()[-50:])


def test_no_frame_that_was_cut_or_merged_is_obeyed(shared: Bench) -> None:
    shared.run(0.05, encode(Stop(), 77))
    whole, other = encode(Drive(2600, -2600), 9), encode(Drive(-500, 4000), 10)
    for cut in range(1, len(whole) - 1):
        shared.run(0.01, whole[:cut] + b"\0" + whole[cut:])
        shared.run(0.01, whole[:cut] + other)
        shared.run(0.005, b"\0" + whole[cut:])
    shared.run(0.05)
    assert shared.state().last_command == 77
    assert all(state.duty == (0, 0) for state in shared.states()[-50:])


SEQUENCES = st.integers(0, 255)
GAINS = st.floats(0, 100, width=32)
COMMANDS = st.one_of(
    st.builds(Drive, st.integers(-20000, 20000), st.integers(-20000, 20000)),
    st.just(Stop()),
    st.just(Hello()),
    st.builds(Tune, GAINS, GAINS, GAINS, GAINS),
)
WHOLE = st.builds(encode, COMMANDS, SEQUENCES)
WRONG = st.one_of(
    st.builds(framed, st.integers(0, 255), SEQUENCES, st.binary(max_size=62)),
    st.builds(
        lambda number, kind, left: framed(kind, number, struct.pack("<ii", left, 0)),
        SEQUENCES,
        st.sampled_from([1, 3]),
        st.integers(-(2**31), 2**31 - 1),
    ),
    st.builds(
        lambda number, gains: framed(3, number, struct.pack("<4f", *gains)),
        SEQUENCES,
        st.tuples(*[st.floats(width=32)] * 4),
    ),
)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """A frame with some of its bytes changed, lost or doubled."""
    frame = bytearray(draw(WHOLE))
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(frame) - 1))
        what = draw(st.sampled_from(["change", "lose", "double"]))
        if what == "change":
            frame[at] = draw(st.integers(0, 255))
        elif what == "lose" and len(frame) > 1:
            del frame[at]
        else:
            frame.insert(at, frame[at])
    return bytes(frame)


STREAMS = st.lists(st.one_of(WHOLE, WHOLE, WRONG, damaged(), st.binary(max_size=90)), min_size=1, max_size=8).map(
    b"".join
)


@settings(max_examples=300, deadline=None)
@given(STREAMS)
def test_of_any_bytes_exactly_what_is_whole_is_obeyed(shared: Bench, stream: bytes) -> None:
    shared.run(0.03, b"\0" + encode(Stop(), 77))
    stream += b"\0"
    assert hear(shared, stream) == answers_to(stream, 77)


def test_a_flood_of_refused_frames_loses_no_state(bench: Callable[..., Bench]) -> None:
    """Each asks for an answer longer than itself, at the full rate of the line."""
    mega = bench()
    mega.run(0.1)
    bad = framed(200, 1, b"")
    mega.run(2.0, bad * (2 * LINE // len(bad)))
    mega.run(0.1)
    assert mega.decoder.lost == 0
    assert mega.decoder.refused.total() == 0
    assert len(mega.states()) == pytest.approx(2.2 / 0.02, abs=1)
    assert len(mega.said()) > 500
