"""An alarm for a process that stood still: it is raised where it breaks in, and never twice."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from bridge.master.standstill import SignalAlarm, StoodStill, WatchdogTimer


@pytest.fixture
def alarm() -> Iterator[SignalAlarm]:
    before = signal.getsignal(signal.SIGALRM)
    alarm = SignalAlarm()
    yield alarm
    alarm.set(0)
    signal.signal(signal.SIGALRM, before)


def test_one_for_a_shared_process_never_rings() -> None:
    alarm = WatchdogTimer()
    alarm.breaks_in = True
    alarm.set(1e-9)
    assert not alarm.rang


def test_it_rings_and_is_quiet_until_it_is_set_anew(alarm: SignalAlarm) -> None:
    signal.raise_signal(signal.SIGALRM)
    assert alarm.rang
    alarm.set(60.0)
    assert not alarm.rang
    assert 59.0 < signal.getitimer(signal.ITIMER_REAL)[0] <= 60.0
    alarm.set(0)
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0


def test_where_it_breaks_in_it_raises_once(alarm: SignalAlarm) -> None:
    alarm.breaks_in = True
    with pytest.raises(StoodStill):
        signal.raise_signal(signal.SIGALRM)
    assert alarm.rang
    assert not alarm.breaks_in
    signal.raise_signal(signal.SIGALRM)


def test_a_time_of_no_length_breaks_in_before_anything_else(alarm: SignalAlarm) -> None:
    alarm.breaks_in = True
    with pytest.raises(StoodStill):
        alarm.set(1e-6)
        signal.sigtimedwait([], 5.0)
