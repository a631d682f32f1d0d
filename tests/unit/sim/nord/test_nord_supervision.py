"""Supervision and reports of a NORD node (BU 2500 §7.1.1, §8.1, §8.2)."""

from __future__ import annotations

from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.core.store import Store
from bridge.sim.nord.nord_settings import RULES, factory_communication
from bridge.sim.nord.nord_supervision import (
    DriveFaultReporter,
    FaultDisplay,
    Presence,
    TelegramWatch,
    module_state,
)


def test_p173_shows_states_time_outs_and_drives() -> None:
    drives = [Presence.ONLINE, Presence.OFFLINE, Presence.LOST, Presence.UNKNOWN]
    assert module_state(SlaveState.OPERATIONAL, False, True, drives) == 0b0111_0010_0000_1010
    assert module_state(SlaveState.PRE_OPERATIONAL, True, False, []) == 5
    assert module_state(SlaveState.STOPPED, False, False, []) == 0


def test_the_watch_begins_with_the_first_telegram_after_its_time_was_set() -> None:
    times = [0.0]
    watch = TelegramWatch(lambda: times[-1])
    watch.on_telegram(1.0)
    times.append(0.5)
    assert watch.next_deadline() is None
    watch.on_telegram(2.0)
    assert watch.next_deadline() == 2.5


def test_a_fault_that_has_gone_is_kept_as_the_last_one() -> None:
    display = FaultDisplay()
    for fault in (1020, 5120, 1020):
        display.report(fault)
    assert (display.present, display.last) == (5120, 0)
    display.clear(5120)
    display.clear(7)
    assert (display.present, display.last) == (1020, 5120)
    display.power_off()
    assert (display.present, display.last) == (0, 0)


def test_each_drives_fault_is_reported_once_with_its_number() -> None:
    emcy = EmcyProducer(Store(lambda: factory_communication(5, "three")), RULES)
    reporter = DriveFaultReporter(emcy, 2)
    assert reporter.report([30, None])
    assert not reporter.report([30, 0])
    assert reporter.report([30, 103])
    assert reporter.report([0, 103])
    sent = [frame.hex().upper() for frame in emcy.due(1.0)]
    assert sent == ["1023030000000000", "0081130100000000", "0000110000000000"]
    reporter.reset()
    assert emcy.error_register == 0
