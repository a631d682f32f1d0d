"""Opening of a node's further SDO servers by a task: what was opened, and why one could not be."""

from __future__ import annotations

from bridge.bustools.open_channels import OpenChannels
from bridge.canopen.frame import Frame
from tests.support.nodes import node_of

CLOSED, ABORT = 0x8000_0000, 0x0601_0002


class Node:
    """Objects of four bytes behind SDO1; ``refuses`` are not written."""

    def __init__(self) -> None:
        self.objects = {(0x1202, 1): CLOSED, (0x1202, 2): CLOSED}
        self.refuses = False

    def answers(self, frame: Frame) -> Frame:
        command, index, sub = frame.data[0], int.from_bytes(frame.data[1:3], "little"), frame.data[3]
        mux = frame.data[1:4]
        if command == 0x40:
            data = b"\x43" + mux + self.objects[index, sub].to_bytes(4, "little")
        elif self.refuses:
            data = b"\x80" + mux + ABORT.to_bytes(4, "little")
        else:
            self.objects[index, sub] = int.from_bytes(frame.data[4:8], "little")
            data = b"\x60" + mux + bytes(4)
        return Frame(0x585, data, 10.1)


def opened(node: Node, more: str = "sdo_channels = [3]") -> OpenChannels:
    task = OpenChannels(node_of(more=more).spec, 10.0)
    for _ in range(20):
        for frame in task.take_frames():
            if frame.can_id == 0x605:
                task.on_frame(node.answers(frame))
    assert task.is_finished(10.2)
    return task


def test_a_channel_is_opened_and_told() -> None:
    """BU 2500 §6.4: SDO3 is 440h and 3C0h + node id."""
    node = Node()
    task = opened(node)
    assert task.notes == ["SDO channel 3 opened at 445h/3C5h"]
    assert task.failure == ""
    assert node.objects == {(0x1202, 1): 0x445, (0x1202, 2): 0x3C5}


def test_one_that_the_node_refuses_is_the_failure() -> None:
    node = Node()
    node.refuses = True
    task = opened(node)
    assert "SDO channel 3 cannot be opened: 1202h:01" in task.failure
    assert node.objects == {(0x1202, 1): CLOSED, (0x1202, 2): CLOSED}


def test_without_any_it_is_done_at_once() -> None:
    task = OpenChannels(node_of().spec, 10.0)
    assert task.is_finished(10.0)
    assert task.take_frames() == []


def test_a_node_that_does_not_answer_ends_it() -> None:
    task = OpenChannels(node_of(more="sdo_channels = [3]"), 10.0)
    while (due := task.next_deadline()) is not None:
        task.take_frames()
        task.on_time(due)
    assert task.is_finished(99.0)
    assert "no valid answer" in task.failure
