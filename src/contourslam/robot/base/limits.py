"""What is asked of the base, kept to what it can do."""

import math

from contourslam.errors import ConfigError
from contourslam.robot.base.messages import MOST_TICKS, Drive
from contourslam.robot.config import BaseConfig

Twist = tuple[float, float]
"""Speed ahead, m/s, and rate of turn to the left, rad/s."""


def check(v: float, omega: float) -> Twist:
    """Refuse what is no number.

    Raises
    ------
    ConfigError
        If a value is not finite.
    """
    if not (math.isfinite(v) and math.isfinite(omega)):
        raise ConfigError(f"a base cannot be driven at {v!r} m/s and {omega!r} rad/s: both must be finite")
    return v, omega


def limited(wanted: Twist, config: BaseConfig) -> Twist:
    """Slow a twist down to what base and wheels can do; the curve keeps its radius.

    Parameters
    ----------
    wanted : tuple of (float, float)
    config : BaseConfig
    """
    v, omega = wanted
    half = 0.5 * omega * config.wheel_base
    per_tick = [abs(way) for way in config.metres_per_tick.tolist()]
    beyond = max(
        1.0,
        abs(v) / config.max_speed,
        abs(omega) / config.max_turn_rate,
        abs(v - half) / min(config.max_wheel_speed, MOST_TICKS * per_tick[0]),
        abs(v + half) / min(config.max_wheel_speed, MOST_TICKS * per_tick[1]),
    )
    return v / beyond, omega / beyond


def towards(now: Twist, wanted: Twist, seconds: float, config: BaseConfig) -> Twist:
    """Go from one twist towards another as far as acceleration allows; both parts take the same share of their way.

    Parameters
    ----------
    now, wanted : tuple of (float, float)
    seconds : float
        Time that there is.
    config : BaseConfig
    """
    dv, domega = wanted[0] - now[0], wanted[1] - now[1]
    needs = max(abs(dv) / config.max_acceleration, abs(domega) / config.max_turn_acceleration)
    share = min(1.0, seconds / needs) if needs > 0.0 else 1.0
    return now[0] + share * dv, now[1] + share * domega


def wheel_command(twist: Twist, config: BaseConfig) -> Drive:
    """Turn a twist into speeds of the encoders.

    Parameters
    ----------
    twist : tuple of (float, float)
        Within the limits.
    config : BaseConfig
    """
    half = 0.5 * twist[1] * config.wheel_base
    left, right = config.metres_per_tick.tolist()
    most = MOST_TICKS
    left_ticks, right_ticks = round((twist[0] - half) / left), round((twist[0] + half) / right)
    return Drive(max(-most, min(most, left_ticks)), max(-most, min(most, right_ticks)))
