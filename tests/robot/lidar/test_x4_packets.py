import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.robot.lidar.x4_packets import (
    LONGEST,
    PacketParser,
    angle_deg,
    correction_deg,
    distance_mm,
    encode_packet,
    spans_deg,
)

CAPTURES = Path(__file__).parents[2] / ".." / "shared" / "data" / "ydlidar_x4"


def capture(name: str) -> bytes:
    if not CAPTURES.exists():
        pytest.skip("the captured packets are not beside the project (../shared/data/ydlidar_x4)")
    return (CAPTURES / name).read_bytes()


def test_the_makers_vectors_hold() -> None:
    assert angle_deg(0x6FE5) == pytest.approx(223.78125)
    assert distance_mm(0x6FE5) == 7161.25
    assert correction_deg([1000.0, 8000.0, 0.0]) == pytest.approx([-6.7622, -7.8374, 0.0], abs=5e-5)


def test_four_captured_packets_are_two_good_ones_a_wrong_checksum_and_a_cut() -> None:
    parser = PacketParser()
    packets = parser.feed(capture("a_four_packets.bin"))
    assert packets.starts.tolist() == [True, False]
    assert packets.counts.tolist() == [1, 40]
    assert (parser.good, parser.bad) == (2, 1)
    assert packets.first_deg[0] == packets.last_deg[0] == pytest.approx(351.1875)
    assert packets.first_deg[1] == pytest.approx(351.6875) and packets.last_deg[1] == pytest.approx(10.234375)
    assert spans_deg(packets)[1] == pytest.approx(18.546875)  # through 360 degrees
    assert distance_mm(packets.raw)[-1] == 0x6C48 / 4


@pytest.mark.parametrize(("name", "counts"), [("b_one_packet.bin", [40]), ("c_tg15_log.bin", [40, 26])])
def test_captured_packets_are_all_good(name: str, counts: list[int]) -> None:
    parser = PacketParser()
    data = capture(name)
    assert parser.feed(data).counts.tolist() == counts
    assert (parser.good, parser.bad) == (len(counts), 0)


@given(st.integers(1, 255), st.floats(0, 359.9), st.floats(0.1, 30.0), st.booleans(), st.data())
@settings(max_examples=60)
def test_what_is_encoded_is_decoded(count: int, first: float, span: float, start: bool, data: st.DataObject) -> None:
    mm = np.array(data.draw(st.lists(st.integers(0, 16000), min_size=count, max_size=count)))
    span = span if count > 1 else 0.0
    packets = PacketParser().feed(encode_packet(first, first + span, mm, start=start))
    assert packets.starts.tolist() == [start]
    assert distance_mm(packets.raw).tolist() == mm.tolist()
    assert (packets.first_deg[0] - first + 180) % 360 - 180 == pytest.approx(0.0, abs=1 / 64)
    assert spans_deg(packets)[0] == pytest.approx(span, abs=1 / 32)


@given(st.binary(max_size=4000), st.lists(st.integers(0, 300), max_size=20))
def test_any_bytes_in_any_pieces_give_the_same_packets_and_no_error(data: bytes, cuts: list[int]) -> None:
    sound = encode_packet(10.0, 29.5, np.arange(500, 540))
    data = data + sound * 2 + data[::-1] + b"\xaa\x55\x00\xff\x01\x01\x01\x01" + data
    whole = PacketParser()
    expected = whole.feed(data).raw.tolist()
    parser, got, at = PacketParser(), [], 0
    for cut in [*cuts, len(data)]:
        got += parser.feed(data[at : at + cut]).raw.tolist()
        at += cut
        assert len(parser._rest) < LONGEST
    got += parser.feed(data[at:]).raw.tolist()
    assert got == expected
    assert (parser.good, parser.bad, parser.skipped) == (whole.good, whole.bad, whole.skipped)


def test_a_million_random_bytes_raise_nothing_and_keep_nothing() -> None:
    data = np.random.default_rng(3).integers(0, 256, 1_000_000, dtype=np.uint8)
    data[::61] = 0xAA  # headers wherever the eye falls
    data[1::61] = 0x55
    stream = data.tobytes()
    parser = PacketParser()
    tracemalloc.start()
    for at in range(0, len(stream), 997):
        parser.feed(stream[at : at + 997])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 300_000
    assert parser.received == 1_000_000
    assert parser.good < 10


def test_a_damaged_length_costs_no_sound_packet() -> None:
    sound = [encode_packet(10.0 * k, 10.0 * k + 9.0, np.full(20, 700 + k)) for k in range(6)]
    broken = bytearray(sound[2])
    broken[3] = 90  # would reach over the three that follow
    parser = PacketParser()
    packets = parser.feed(b"".join([*sound[:2], bytes(broken), *sound[3:]]))
    assert packets.first_deg.tolist() == pytest.approx([0.0, 10.0, 30.0, 40.0, 50.0], abs=1 / 64)


def test_a_packet_holds_1_to_255_samples() -> None:
    for count in (0, 256):
        with pytest.raises(ValueError, match="1 to 255 samples"):
            encode_packet(0.0, 1.0, np.zeros(count))
