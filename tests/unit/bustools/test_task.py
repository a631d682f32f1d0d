"""Tasks on SDO channels: frames to the channel that they answer, the earliest deadline, one time."""

from __future__ import annotations

from bridge.bustools.task import SdoTasks
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Result, SdoChannel


class Two(SdoTasks):
    """Reads 1000h over each of two channels."""

    def __init__(self, now: float) -> None:
        self.first = SdoChannel(0x605, 0x585, 0.5)
        self.second = SdoChannel(0x445, 0x3C5, 0.2)
        super().__init__((self.first, self.second), now)
        self.results: list[Result] = []
        for channel in (self.first, self.second):
            channel.read(0x1000, 0, now, self.results.append)

    def is_finished(self, now: float) -> bool:
        return len(self.results) == 2


ANSWER = bytes.fromhex("4300100092010200")


def test_each_channel_asks_for_itself_and_gets_its_own_answers() -> None:
    task = Two(10.0)
    assert [frame.can_id for frame in task.take_frames()] == [0x605, 0x445]
    task.on_frame(Frame(0x585, ANSWER, 10.1))
    assert task.results == [bytes.fromhex("92010200")]
    task.on_frame(Frame(0x586, ANSWER, 10.1))
    assert not task.is_finished(10.1)


def test_it_is_asked_for_at_the_earliest_of_their_deadlines() -> None:
    task = Two(10.0)
    task.take_frames()
    assert task.next_deadline() == 10.2
    task.on_time(10.2)
    assert len(task.results) == 1
    assert task.next_deadline() == 10.5
    task.on_time(10.5)
    assert task.next_deadline() is None
    assert task.is_finished(10.5)


def test_its_time_does_not_go_back() -> None:
    task = Two(10.0)
    task.on_frame(Frame(0x700, b"", 11.0))
    task.on_frame(Frame(0x700, b"", 10.5))
    assert task._now == 11.0


def test_what_is_sent_is_taken_once() -> None:
    task = Two(10.0)
    assert len(task.take_frames()) == 2
    assert task.take_frames() == []
