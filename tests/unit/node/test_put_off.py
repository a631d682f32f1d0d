"""An NMT command that waits for stopped words to be taken over."""

from __future__ import annotations

from bridge.canopen.nmt import NmtCommand
from bridge.node.put_off import PutOff

STOP, RESET = NmtCommand.STOP, NmtCommand.RESET_COMMUNICATION
WAIT_S, ROUND_S = 0.04, 0.001


def waiting() -> PutOff:
    put_off = PutOff()
    put_off.begin(STOP, 100.0, WAIT_S)
    return put_off


def test_it_goes_out_a_round_after_its_time() -> None:
    """SYNC that is due in the same round is sent at the end of it."""
    put_off = waiting()
    assert put_off.next_deadline() == 100.0 + WAIT_S
    assert put_off.on_time(100.0 + WAIT_S - 0.001) is None
    assert put_off.on_time(100.0 + WAIT_S) is None
    assert put_off.next_deadline() == 100.0 + WAIT_S + ROUND_S
    assert put_off.on_time(100.0 + WAIT_S + ROUND_S) is STOP


def test_it_goes_out_once() -> None:
    put_off = waiting()
    put_off.on_time(100.1)
    assert put_off.on_time(100.2) is STOP
    assert (put_off.on_time(100.3), put_off.next_deadline(), put_off.command) == (None, None, None)


def test_a_process_that_comes_late_waits_for_sync_once_more_and_only_once() -> None:
    put_off = waiting()
    assert put_off.on_time(100.0 + WAIT_S + 0.1) is None
    assert put_off.next_deadline() == 100.0 + WAIT_S + 0.1 + WAIT_S
    assert put_off.on_time(105.0) is STOP


def test_who_asks_again_changes_the_command_and_not_its_time() -> None:
    put_off = waiting()
    for n in range(5):
        put_off.begin(RESET, 100.0 + n / 100, WAIT_S)
    put_off.on_time(100.0 + WAIT_S)
    assert put_off.on_time(100.0 + WAIT_S + ROUND_S) is RESET


def test_the_next_one_waits_as_long_as_the_first() -> None:
    """What is done again is done the same way."""
    put_off = waiting()
    put_off.on_time(100.1)
    put_off.on_time(100.2)
    put_off.begin(STOP, 200.0, WAIT_S)
    assert put_off.on_time(200.0 + WAIT_S) is None
    assert put_off.next_deadline() == 200.0 + WAIT_S + ROUND_S


def test_one_that_is_taken_back_does_not_go_out() -> None:
    put_off = waiting()
    put_off.clear()
    assert (put_off.on_time(200.0), put_off.next_deadline()) == (None, None)
