"""Speed control against motors of first order."""

from collections.abc import Callable

import pytest
from mega_bench import Bench, Motor

from contourslam.robot.base.messages import STALLED, WATCHDOG, Ack, Drive, Hello, HelloReply, Stop, Tune

STEP = 0.0005


def drive(
    mega: Bench,
    motors: tuple[Motor, Motor],
    wanted: tuple[int, int],
    seconds: float,
    seen: Callable[[int], int] = lambda ticks: ticks,
) -> list[tuple[float, float]]:
    """Hold a wanted speed; the speeds of the wheels, each step. The left encoder shows what is `seen` of its ticks."""
    speeds = []
    for count in range(round(seconds / STEP)):
        send = mega.frame(Drive(*wanted)) if count % 100 == 0 else b""
        mega.step(STEP, send, (seen(motors[0].ticks), motors[1].ticks))
        for motor, duty in zip(motors, mega.duty, strict=True):
            motor.step(STEP, duty)
        speeds.append((motors[0].speed, motors[1].speed))
    return speeds


def settled_after(speeds: list[float], wanted: float) -> float:
    """When the speed was outside of 5 % for the last time, s."""
    return STEP * max(
        (at + 1 for at, speed in enumerate(speeds) if abs(speed - wanted) > 0.05 * abs(wanted)), default=0
    )


# Time constant (s), gain (ticks/s per per mille), friction (per mille).
MOTORS = {
    "as_assumed": (0.08, 8.0, 0.0),
    "quick": (0.04, 8.0, 20.0),
    "slow": (0.15, 8.0, 0.0),
    "loaded": (0.10, 8.0, 60.0),
    "battery_low": (0.08, 6.5, 40.0),
    "battery_full": (0.08, 9.5, 0.0),
}


@pytest.mark.parametrize("wanted", [(2600, -2600), (5000, 600), (-300, 150)])
@pytest.mark.parametrize("motor", MOTORS)
def test_a_step_settles_within_5_percent_in_half_a_second(
    bench: Callable[..., Bench], motor: str, wanted: tuple[int, int]
) -> None:
    mega, motors = bench(), (Motor(*MOTORS[motor]), Motor(*MOTORS[motor]))
    mega.run(0.05)
    speeds = drive(mega, motors, wanted, 1.2)
    for side in (0, 1):
        wheel = [both[side] for both in speeds]
        assert settled_after(wheel, wanted[side]) < 0.5
        assert max(speed / wanted[side] for speed in wheel) < 1.07


def test_a_crawl_of_a_tick_each_20_ms_is_smooth(bench: Callable[..., Bench]) -> None:
    mega, motors = bench(), (Motor(), Motor())
    mega.run(0.05)
    speeds = drive(mega, motors, (50, -50), 2.0)
    assert settled_after([left for left, _ in speeds], 50) < 0.5
    assert settled_after([right for _, right in speeds], -50) < 0.5
    held = speeds[round(1.0 / STEP) :]
    assert max(abs(left - 50) for left, _ in held) < 0.03 * 50
    assert max(abs(right + 50) for _, right in held) < 0.03 * 50


def test_an_edge_at_the_very_end_of_a_period_is_timed_rightly(bench: Callable[..., Bench]) -> None:
    """Edges drift slowly through the periods of the control; a wrong time of one would be taken for another speed."""
    mega = bench("--imu", "none")
    mega.run(0.1)
    mega.run(0.05, Tune(0.1, 0.0, 0.0, 0.0))
    for count in range(1, 101):
        mega.step(0.1001, mega.frame(Drive(2000, -2000)), (200 * count, -200 * count))
    settled = [state.duty for state in mega.states() if abs(state.ticks[0]) > 1000]
    assert len(settled) > 450
    assert {duty for both in settled for duty in both} <= {-1, 0, 1}


def test_a_reversal_settles_in_half_a_second(bench: Callable[..., Bench]) -> None:
    mega, motors = bench(), (Motor(), Motor(friction=30.0))
    mega.run(0.05)
    drive(mega, motors, (2600, 2600), 1.0)
    speeds = drive(mega, motors, (-2600, -1000), 1.0)
    assert settled_after([left for left, _ in speeds], -2600) < 0.5
    assert settled_after([right for _, right in speeds], -1000) < 0.5


def test_the_mean_speed_is_exact(bench: Callable[..., Bench]) -> None:
    mega, motors = bench(), (Motor(gain=7.0, friction=25.0), Motor(gain=9.0))
    mega.run(0.05)
    drive(mega, motors, (1234, -777), 1.0)
    start = motors[0].position, motors[1].position
    drive(mega, motors, (1234, -777), 4.0)
    assert motors[0].position - start[0] == pytest.approx(4 * 1234, rel=5e-4)
    assert motors[1].position - start[1] == pytest.approx(4 * -777, rel=5e-4)


def test_a_wheel_that_was_held_does_not_race_when_it_is_let_go(bench: Callable[..., Bench]) -> None:
    mega, motors = bench(), (Motor(friction=2000.0), Motor())
    mega.run(0.05)
    drive(mega, motors, (2600, 2600), 0.45)
    assert motors[0].speed == 0
    assert mega.duty[0] == 1000
    motors[0].friction = 0.0
    speeds = drive(mega, motors, (2600, 2600), 1.5)
    assert settled_after([left for left, _ in speeds], 2600) < 1.0


@pytest.mark.parametrize("rest", [Stop(), Drive(0, 0)], ids=["STOP", "DRIVE"])
@pytest.mark.parametrize(
    ("friction", "seen"),
    [(2000.0, lambda ticks: ticks), (0.0, lambda ticks: 0), (0.0, lambda ticks: ticks // 2 % 2)],
    ids=["blocked", "encoder_dead", "one_channel_dead"],
)
def test_a_motor_that_does_not_turn_at_full_power_has_both_off_until_the_host_asks_for_rest(
    bench: Callable[..., Bench], friction: float, seen: Callable[[int], int], rest: Stop | Drive
) -> None:
    mega, motors = bench(), (Motor(friction=friction), Motor())
    mega.run(0.05)
    drive(mega, motors, (2600, -2600), 0.45, seen)
    assert mega.duty[0] >= 900
    assert not mega.state().flags & STALLED
    drive(mega, motors, (2600, -2600), 0.3, seen)
    for _ in range(2):
        assert mega.duty == mega.state().duty == (0, 0)
        assert mega.state().flags & (STALLED | WATCHDOG) == STALLED
        drive(mega, motors, (-1000, 500), 0.8, seen)
    mega.run(0.4)  # nor does the watchdog's time end it
    assert mega.state().flags & (STALLED | WATCHDOG) == STALLED
    mega.run(0.05, rest)
    assert not mega.state().flags & STALLED
    drive(mega, motors, (2600, -2600), 0.2, seen)
    assert mega.duty[0] > 0 > mega.duty[1]


@pytest.mark.parametrize("gains", [None, Tune(100.0, 0.0, 0.0, 0.0)], ids=["as_built", "tuned"])
def test_a_wheel_that_turns_slowly_at_full_power_is_not_taken_for_stalled(
    bench: Callable[..., Bench], gains: Tune | None
) -> None:
    mega, motors = bench(), (Motor(friction=997.0), Motor())  # 24 ticks/s with all it has
    mega.run(0.05)
    if gains:
        mega.run(0.05, gains)
    drive(mega, motors, (2600, 2600), 2.0)
    assert mega.duty[0] == 1000
    assert not any(state.flags & STALLED for state in mega.states())


def test_no_motor_hums_at_rest(bench: Callable[..., Bench]) -> None:
    mega, motors = bench(), (Motor(friction=10.0), Motor(friction=10.0))
    mega.run(0.05)
    drive(mega, motors, (2000, -2000), 1.0)
    drive(mega, motors, (0, 0), 1.0)
    assert mega.duty == (0, 0)
    assert (motors[0].speed, motors[1].speed) == (0, 0)


def test_gains_are_tuned_and_told(bench: Callable[..., Bench]) -> None:
    mega = bench()
    mega.run(0.1)
    said = mega.run(0.1, Tune(0.0, 0.0, 0.0, 0.25))
    assert Ack(mega.sequence, 0) in said
    mega.run(0.1, Drive(1000, -2000))
    assert mega.duty == (250, -500)
    (reply,) = [message for message in mega.run(0.05, Hello()) if isinstance(message, HelloReply)]
    assert (reply.kp, reply.ki, reply.kd, reply.feed_forward) == (0.0, 0.0, 0.0, 0.25)


def test_a_quicker_wheel_is_held_back_by_kd(bench: Callable[..., Bench]) -> None:
    mega = bench()
    mega.run(0.1)
    mega.run(0.05, Tune(0.0, 0.0, 0.01, 0.0))
    mega.step(0.001, mega.frame(Drive(1, 1)))
    duties = []
    for speed in range(0, 2000, 40):  # 40 ticks/s more each 5 ms: 8000 ticks/s^2
        mega.step(0.005, ticks=(mega.ticks[0] + speed * 5 // 1000, 0))
        duties.append(mega.duty[0])
    assert sum(duties[20:]) / 30 == pytest.approx(-80, rel=0.1)
