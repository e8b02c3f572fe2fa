"""A damaged frame is never obeyed, a sound one always is, and both ends agree with the firmware's own vectors."""

import json
import zlib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.robot.base.messages import (
    LAYOUTS,
    TO_BASE,
    TO_HOST,
    Ack,
    Drive,
    Hello,
    HelloReply,
    Message,
    State,
    Stop,
    Tune,
    made,
    numbers,
)
from contourslam.robot.base.protocol import Decoder, RefusedError, cobs_decode, cobs_encode, decode, encode

VECTORS = json.loads((Path(__file__).parents[3] / "firmware/mega/vectors.json").read_text())
KINDS = {"DRIVE": Drive, "STOP": Stop, "TUNE": Tune, "HELLO": Hello, "STATE": State, "ACK": Ack}
KINDS |= {"HELLO_REPLY": HelloReply}
GOOD = {vector["name"]: vector for vector in VECTORS["good"]}

I32, I16, U8 = st.integers(-(2**31), 2**31 - 1), st.integers(-(2**15), 2**15 - 1), st.integers(0, 255)
TRIPLE, DUTY = st.tuples(I16, I16, I16), st.integers(-1000, 1000)
TICKS, GAIN = st.integers(-20000, 20000), st.floats(0.0, 100.0, width=32)
U16 = st.integers(0, 65535)
TIME = st.integers(0, 2**32 - 1)
MESSAGES = st.one_of(
    st.builds(Drive, TICKS, TICKS),
    st.just(Stop()),
    st.builds(Tune, GAIN, GAIN, GAIN, GAIN),
    st.just(Hello()),
    st.builds(State, TIME, st.tuples(I32, I32), TRIPLE, TRIPLE, TRIPLE, U16, st.tuples(DUTY, DUTY), U8, U8),
    st.builds(Ack, U8, st.integers(0, 3)),
    st.builds(HelloReply, U8, U8, U8, U8, U16, U16, U8, U8, GAIN, GAIN, GAIN, GAIN),
)


def of(vector: dict[str, Any]) -> Message:
    return made(KINDS[vector["message"]], tuple(vector["fields"].values()))


def a_state(number: int) -> State:
    return State(20000 * number, (number, -number), (1, 2, 3), (0, 0, 9807), (0, 0, 0), 7400, (10, -10), 0, 2)


@pytest.mark.parametrize("name", list(GOOD))
def test_the_firmwares_frames_are_made_and_read_alike(name: str) -> None:
    vector = GOOD[name]
    frame = bytes.fromhex(vector["frame"])
    assert encode(of(vector), vector["sequence"]) == frame
    assert cobs_decode(frame[:-1]) == bytes.fromhex(vector["body"])
    accepted = TO_BASE if vector["to"] == "base" else TO_HOST
    assert decode(frame[:-1], accepted) == (of(vector), vector["sequence"])


@pytest.mark.parametrize("vector", VECTORS["refused"], ids=lambda vector: str(vector["name"]))
def test_what_the_firmware_refuses_is_refused_for_the_same_reason(vector: dict[str, str]) -> None:
    with pytest.raises(RefusedError) as caught:
        decode(bytes.fromhex(vector["frame"])[:-1], TO_BASE)
    assert caught.value.reason == vector["reason"]


@pytest.mark.parametrize("vector", VECTORS["streams"], ids=lambda vector: str(vector["name"]))
@pytest.mark.parametrize("piece", [1, 7, 10000])
def test_out_of_a_stream_the_same_frames_are_obeyed(vector: dict[str, Any], piece: int) -> None:
    stream, decoder = bytes.fromhex(vector["bytes"]), Decoder(TO_BASE)
    found = [
        received.message for at in range(0, len(stream), piece) for received in decoder.feed(stream[at : at + piece])
    ]
    assert found == [of(GOOD[name]) for name in vector["obeyed"]]


@given(MESSAGES, U8)
def test_what_is_made_is_read_again(message: Message, sequence: int) -> None:
    frame = encode(message, sequence)
    assert frame.count(0) == 1 and frame[-1] == 0 and len(frame) <= 66
    assert decode(frame[:-1], (*TO_BASE, *TO_HOST)) == (message, sequence)
    assert made(type(message), tuple(numbers(message))) == message


@given(st.binary(max_size=254))
def test_stuffing_takes_every_zero_out_and_puts_it_back(body: bytes) -> None:
    coded = cobs_encode(body)
    assert 0 not in coded and len(coded) == len(body) + 1
    assert cobs_decode(coded) == body


@given(MESSAGES, U8, st.data())
def test_a_frame_with_any_byte_changed_lost_or_added_is_never_obeyed(
    message: Message, sequence: int, data: st.DataObject
) -> None:
    frame = encode(message, sequence)[:-1]
    at, byte = data.draw(st.integers(0, len(frame) - 1)), data.draw(st.integers(1, 255))
    kind = data.draw(st.sampled_from(["changed", "lost", "added"]))
    if kind == "changed":
        damaged = frame[:at] + bytes([frame[at] ^ byte]) + frame[at + 1 :]
    else:
        damaged = frame[:at] + (b"" if kind == "lost" else bytes([byte])) + frame[at + (kind == "lost") :]
    obeyed = [received.message for received in Decoder((*TO_BASE, *TO_HOST)).feed(damaged + b"\0")]
    assert damaged == frame or obeyed == []


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=4000), st.lists(st.integers(1, 300), max_size=20))
def test_any_bytes_in_any_pieces_raise_nothing(noise: bytes, pieces: list[int]) -> None:
    whole, cut = Decoder(), Decoder()
    expected = [r.message for r in whole.feed(noise)]
    ends = [0, *np.cumsum(pieces).tolist(), len(noise)]
    found = [r.message for a, b in pairwise(ends) for r in cut.feed(noise[a:b] if a < b else b"")]
    assert found == expected and whole.received == len(noise)


def test_a_million_random_bytes_raise_nothing_and_say_nothing() -> None:
    noise = np.random.default_rng(5).integers(0, 256, 1_000_000).astype(np.uint8).tobytes()
    decoder = Decoder((*TO_BASE, *TO_HOST))
    assert [r for at in range(0, len(noise), 4096) for r in decoder.feed(noise[at : at + 4096])] == []
    assert sum(decoder.refused.values()) > 3000 and decoder.good == 0
    (found,) = decoder.feed(b"\0" + encode(Stop(), 1))
    assert found.message == Stop()


def test_of_a_damaged_stream_only_what_was_sent_is_read() -> None:
    rng = np.random.default_rng(6)
    sent = [a_state(number) for number in range(2000)]
    clean = np.frombuffer(b"".join(encode(state, n) for n, state in enumerate(sent)), dtype=np.uint8)
    stream = clean.copy()
    hit = rng.random(stream.size) < 0.005
    stream[hit] ^= rng.integers(1, 256, hit.sum()).astype(np.uint8)
    stream = stream[rng.random(stream.size) > 0.001]
    decoder = Decoder()
    found = [r.message for r in decoder.feed(stream.tobytes())]
    assert set(found) <= set(sent) and len(found) > 1200
    assert decoder.lost + decoder.good == pytest.approx(2000, abs=3)  # but for losses at the very ends


def test_frames_that_never_came_are_counted_and_a_reset_of_the_base_is_no_loss() -> None:
    decoder = Decoder()
    for sequence in (250, 251, 255, 0, 3):
        decoder.feed(encode(a_state(0), sequence))
    assert decoder.lost == 5
    decoder.feed(encode(HelloReply(1, 1, 0, 0, 20, 300, 1, 2, 0, 0, 0, 0), 0))
    decoder.feed(encode(a_state(0), 1))
    assert decoder.lost == 5


def test_a_frame_tells_its_place_in_the_stream() -> None:
    first, second = encode(a_state(0), 0), encode(Ack(1, 0), 1)
    decoder = Decoder()
    stream = b"\x07\x08\0" + first + b"\0\0" + second
    found = [r for at in range(0, len(stream), 5) for r in decoder.feed(stream[at : at + 5])]
    assert [r.end for r in found] == [3 + len(first), len(stream)]
    assert [stream[r.begin : r.end] for r in found] == [first, second]


@pytest.mark.parametrize(
    "message", [Drive(20001, 0), Drive(0, -20001), Tune(-0.1, 0, 0, 0), Tune(float("nan"), 0, 0, 0), Ack(256, 0)]
)
def test_what_would_be_refused_is_not_sent(message: Message) -> None:
    with pytest.raises(ValueError, match=r"would refuse|no frame can hold"):
        encode(message, 0)


def test_a_report_with_an_impossible_value_is_refused() -> None:
    body = b"\x82\x01\x00\x09"
    body += zlib.crc32(body).to_bytes(4, "little")
    with pytest.raises(RefusedError, match="value"):
        decode(cobs_encode(body))
    assert LAYOUTS[State][1].size == 38
