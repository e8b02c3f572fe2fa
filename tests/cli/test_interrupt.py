"""Whoever asks the work to stop, it ends between two items."""

import signal

import pytest

from contourslam.cli.interrupt import Interrupt

ASKING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.mark.usefixtures("capfd")  # a closing terminal silences standard error
@pytest.mark.parametrize("number", ASKING, ids=str)
def test_all_who_ask_are_heard_and_only_ctrl_c_insists(number: signal.Signals) -> None:
    before = [signal.getsignal(one) for one in ASKING]
    with Interrupt() as interrupt:
        assert not interrupt.requested
        signal.raise_signal(number)
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGHUP)
        assert interrupt.requested
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert [signal.getsignal(one) for one in ASKING] == before


def test_what_nohup_ignores_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interrupt() as interrupt:
            signal.raise_signal(signal.SIGHUP)
            assert not interrupt.requested
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
