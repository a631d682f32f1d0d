"""Errands of one command: an NMT command that is followed, an SDO transfer that is answered."""

from __future__ import annotations

from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.errands.single import NmtErrand, SdoErrand


def test_an_nmt_command_is_followed_when_the_node_says_so() -> None:
    errand = NmtErrand(NmtCommand.START, 5, 10.0, 2.0)
    errand.on_frame(Frame(0x705, b"\x05", 10.0))  # said before the command
    assert errand.take_frames() == [Frame(0, b"\x01\x05")]
    errand.on_frame(Frame(0x705, b"\x7f", 10.1))
    errand.on_frame(Frame(0x706, b"\x05", 10.1))
    assert not errand.is_finished(10.1)
    errand.on_frame(Frame(0x705, b"\x05", 10.2))
    assert errand.is_finished(10.2)
    assert (errand.states, errand.reached) == ({5: NmtState.OPERATIONAL}, {5})


def test_a_reset_is_seen_by_the_boot_up_message() -> None:
    errand = NmtErrand(NmtCommand.RESET_NODE, 5, 10.0, 2.0)
    errand.take_frames()
    errand.on_frame(Frame(0x705, b"\x7f", 10.1))
    assert not errand.is_finished(10.1)
    errand.on_frame(Frame(0x705, b"\x00", 10.2))
    assert errand.is_finished(10.2)
    assert errand.states == {5: NmtState.PRE_OPERATIONAL}


def test_a_silent_node_is_waited_for_and_then_not() -> None:
    errand = NmtErrand(NmtCommand.STOP, 0, 10.0, 2.0)
    assert errand.next_deadline() == 12.0
    assert errand.is_finished(12.0)
    assert errand.states == {}


def test_an_sdo_errand_asks_again_as_often_as_it_was_told() -> None:
    errand = SdoErrand(5, 0x1000, 0, None, 10.0, 0.5, retries=2)
    asked, now = 0, 10.0
    while not errand.is_finished(now):
        asked += sum(frame.data[0] == 0x40 for frame in errand.take_frames())
        now = errand.next_deadline() or now
        errand.on_time(now)
    assert (asked, now) == (3, 11.5)


def test_an_sdo_errand_ends_with_its_answer() -> None:
    errand = SdoErrand(5, 0x1000, 0, None, 10.0, 0.5)
    errand.on_time(10.0)
    [request] = errand.take_frames()
    assert request == Frame(0x605, bytes.fromhex("4000100000000000"))
    errand.on_frame(Frame(0x586, bytes.fromhex("4300100001000000"), 10.1))
    assert not errand.is_finished(10.1)
    errand.on_frame(Frame(0x585, bytes.fromhex("4300100092010200"), 10.1))
    assert errand.is_finished(10.1)
    assert errand.result == bytes.fromhex("92010200")
