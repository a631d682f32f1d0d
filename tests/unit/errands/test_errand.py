"""Errands on SDO channels: frames to the channel that they answer, the earliest deadline, one time."""

from __future__ import annotations

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Result, SdoChannel
from bridge.errands.errand import SdoErrands


class Two(SdoErrands):
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
    errand = Two(10.0)
    assert [frame.can_id for frame in errand.take_frames()] == [0x605, 0x445]
    errand.on_frame(Frame(0x585, ANSWER, 10.1))
    assert errand.results == [bytes.fromhex("92010200")]
    errand.on_frame(Frame(0x586, ANSWER, 10.1))
    assert not errand.is_finished(10.1)


def test_it_is_asked_for_at_the_earliest_of_their_deadlines() -> None:
    errand = Two(10.0)
    errand.take_frames()
    assert errand.next_deadline() == 10.2
    errand.on_time(10.2)
    assert len(errand.results) == 1
    assert errand.next_deadline() == 10.5
    errand.on_time(10.5)
    assert errand.next_deadline() is None
    assert errand.is_finished(10.5)


def test_its_time_does_not_go_back() -> None:
    errand = Two(10.0)
    errand.on_frame(Frame(0x700, b"", 11.0))
    errand.on_frame(Frame(0x700, b"", 10.5))
    assert errand._now == 11.0


def test_what_is_sent_is_taken_once() -> None:
    errand = Two(10.0)
    assert len(errand.take_frames()) == 2
    assert errand.take_frames() == []
