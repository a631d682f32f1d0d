"""Condition of a bus: the latest trouble, put into words only when somebody looks."""

from __future__ import annotations

from bridge.can.errorframe import ControllerState
from bridge.can.interface import BusStatus


def test_a_bus_begins_without_trouble_and_with_nothing_counted() -> None:
    status = BusStatus()
    assert status.state is ControllerState.OK
    assert str(status.last_error) == ""
    assert (status.outages, status.frames_received, status.bits, status.bursts_refused) == (0, 0, 0, "")


def test_an_error_frame_is_told_in_words() -> None:
    """<linux/can/error.h>: 020h is "received no ACK"."""
    status = BusStatus()
    status.note_error((0x2000_0020, bytes(8)))
    assert str(status.last_error).startswith("no acknowledge")


def test_a_sentence_is_told_as_it_is_and_the_latest_counts() -> None:
    status = BusStatus()
    status.note_error((0x2000_0020, bytes(8)))
    status.note_error("the adapter was unplugged")
    assert str(status.last_error) == "the adapter was unplugged"
