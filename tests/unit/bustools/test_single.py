"""Tasks of one command: an NMT command that is followed, an SDO transfer that is answered."""

from __future__ import annotations

from bridge.bustools.single import NmtTask, SdoTask
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState


def test_an_nmt_command_is_followed_when_the_node_says_so() -> None:
    task = NmtTask(NmtCommand.START, 5, 10.0, 2.0)
    task.on_frame(Frame(0x705, b"\x05", 10.0))  # said before the command
    assert task.take_frames() == [Frame(0, b"\x01\x05")]
    task.on_frame(Frame(0x705, b"\x7f", 10.1))
    task.on_frame(Frame(0x706, b"\x05", 10.1))
    assert not task.is_finished(10.1)
    task.on_frame(Frame(0x705, b"\x05", 10.2))
    assert task.is_finished(10.2)
    assert (task.states, task.reached) == ({5: NmtState.OPERATIONAL}, {5})


def test_a_reset_is_seen_by_the_boot_up_message() -> None:
    task = NmtTask(NmtCommand.RESET_NODE, 5, 10.0, 2.0)
    task.take_frames()
    task.on_frame(Frame(0x705, b"\x7f", 10.1))
    assert not task.is_finished(10.1)
    task.on_frame(Frame(0x705, b"\x00", 10.2))
    assert task.is_finished(10.2)
    assert task.states == {5: NmtState.PRE_OPERATIONAL}


def test_a_silent_node_is_waited_for_and_then_not() -> None:
    task = NmtTask(NmtCommand.STOP, 0, 10.0, 2.0)
    assert task.next_deadline() == 12.0
    assert task.is_finished(12.0)
    assert task.states == {}


def test_an_sdo_task_asks_again_as_often_as_it_was_told() -> None:
    task = SdoTask(5, 0x1000, 0, None, 10.0, 0.5, retries=2)
    asked, now = 0, 10.0
    while not task.is_finished(now):
        asked += sum(frame.data[0] == 0x40 for frame in task.take_frames())
        now = task.next_deadline() or now
        task.on_time(now)
    assert (asked, now) == (3, 11.5)


def test_an_sdo_task_ends_with_its_answer() -> None:
    task = SdoTask(5, 0x1000, 0, None, 10.0, 0.5)
    task.on_time(10.0)
    [request] = task.take_frames()
    assert request == Frame(0x605, bytes.fromhex("4000100000000000"))
    task.on_frame(Frame(0x586, bytes.fromhex("4300100001000000"), 10.1))
    assert not task.is_finished(10.1)
    task.on_frame(Frame(0x585, bytes.fromhex("4300100092010200"), 10.1))
    assert task.is_finished(10.1)
    assert task.result == bytes.fromhex("92010200")
