from collections.abc import Callable
from itertools import pairwise

import numpy as np
from mega_bench import Bench, Motor

from contourslam.robot.base.messages import TO_BASE, Drive
from contourslam.robot.base.protocol import Decoder, RefusedError, decode


def spoil(data: bytes, chance: np.random.Generator, share: float) -> bytes:
    """Change or lose a share of the bytes."""
    spoilt = bytearray()
    for byte in data:
        draw = chance.random()
        if draw > share:
            spoilt.append(byte)
        elif draw < 0.8 * share:
            spoilt.append(int(chance.integers(256)))
    return bytes(spoilt)


def sound(data: bytes) -> list[int]:
    """Sequences of what the base shall obey of these bytes."""
    sequences = []
    for coded in data.split(b"\0"):
        try:
            sequences.append(decode(coded, TO_BASE)[1])
        except RefusedError:
            continue
    return sequences


def test_with_5_percent_of_the_bytes_damaged_whole_frames_go_through_both_ways(bench: Callable[..., Bench]) -> None:
    mega, motors = bench(), (Motor(), Motor())
    chance = np.random.default_rng(5)
    mega.run(0.1)
    sent, spoilt = b"", b""
    clean = mega.decoder  # hears all; what a computer would hear is spoilt first
    host, told = Decoder(), []
    speeds = []
    for count in range(15_000):  # 30 s
        data = mega.frame(Drive(2600, -1300)) if count % 10 == 0 else b""
        arrived = spoil(data, chance, 0.05)
        sent, spoilt = sent + data, spoilt + arrived
        done = mega.step(0.002, arrived, (motors[0].ticks, motors[1].ticks))
        for motor, duty in zip(motors, mega.duty, strict=True):
            motor.step(0.002, duty)
        speeds.append(motors[0].speed)
        told += [received.message for received in host.feed(spoil(done.sent, chance, 0.05))]
    obeyed = [state.last_command for state in mega.states()]
    wanted = sound(spoilt)
    # A share of 0.95 ** 16 of the commands; each that is whole is obeyed, though STATEs 20 ms apart may not show it.
    assert 0.35 < len(wanted) / 1500 < 0.55
    shown = [new for old, new in pairwise(obeyed) if new != old]
    assert len(shown) > 0.97 * len(wanted)
    assert clean.lost == 0
    assert clean.refused.total() == 0
    # And 0.95 ** 46 of the STATEs come through: four a second, all true.
    assert 0.06 < len(told) / 1500 < 0.13
    assert set(told) <= set(mega.states())
    assert np.mean(np.abs(np.array(speeds[500:]) - 2600) < 130) > 0.95
