"""Frames out of a raw CAN socket: many at a time, times within limits, errors apart, our own left out."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterator

import pytest

from bridge.can.receiver import BATCH, Receiver, Stamps, WatchReceiver
from bridge.canopen.frame import EXTENDED, REMOTE, Frame

CAN_FRAME = struct.Struct("=IB3x8s")
ERROR = 0x2000_0000
ANY = Stamps(0.0, 0.0, 1e12)


class Pair:
    def __init__(self) -> None:
        self.bus, self.ours = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.ours.setblocking(False)

    def sends(self, *frames: Frame) -> None:
        for frame in frames:
            self.bus.send(CAN_FRAME.pack(frame.can_id, len(frame.data), frame.data))


@pytest.fixture
def pair() -> Iterator[Pair]:
    pair = Pair()
    yield pair
    pair.bus.close()
    pair.ours.close()


def test_what_waits_comes_in_order_with_its_flags_and_length(pair: Pair) -> None:
    sent = [Frame(0x185, b"\1\2"), Frame(0x705 | REMOTE), Frame(0x1234567 | EXTENDED, bytes(range(8)))]
    pair.sends(*sent)
    frames: list[Frame] = []
    assert Receiver(pair.ours).receive(frames, ANY) == (3, [])
    assert [(frame.can_id, frame.data) for frame in frames] == [(one.can_id, one.data) for one in sent]


def test_error_frames_are_counted_and_given_apart(pair: Pair) -> None:
    pair.sends(Frame(ERROR | 0x20, bytes(8)), Frame(0x185))
    frames: list[Frame] = []
    assert Receiver(pair.ours).receive(frames, ANY) == (2, [(ERROR | 0x20, bytes(8))])
    assert [frame.can_id for frame in frames] == [0x185]


def test_no_more_come_at_a_time_than_a_batch_has(pair: Pair) -> None:
    receiver, frames = Receiver(pair.ours), list[Frame]()
    pair.sends(*(Frame(0x185, bytes((number,))) for number in range(BATCH + 3)))
    assert receiver.receive(frames, ANY)[0] == BATCH
    assert receiver.receive(frames, ANY)[0] == 3
    assert receiver.receive(frames, ANY) == (0, [])
    assert [frame.data[0] for frame in frames] == list(range(BATCH + 3))


def test_times_are_monotonic_and_within_what_is_possible(pair: Pair) -> None:
    receiver, frames = Receiver(pair.ours), list[Frame]()
    offset = time.monotonic() - time.time()
    before = time.monotonic()
    pair.sends(Frame(0x185))
    receiver.receive(frames, Stamps(offset, 0.0, time.monotonic() + 1))
    assert before - 0.1 <= frames[0].time <= time.monotonic() + 0.1
    for earliest, latest, at in ((1e12, 2e12, 1e12), (0.0, 5.0, 5.0)):
        frames.clear()
        pair.sends(Frame(0x185))
        receiver.receive(frames, Stamps(offset, earliest, latest))
        assert frames[0].time == at


def test_a_socket_that_is_gone_is_an_error(pair: Pair) -> None:
    receiver = Receiver(pair.ours)
    pair.ours.close()
    with pytest.raises(OSError):
        receiver.receive([], ANY)


def test_of_what_only_we_send_only_that_of_others_is_given(pair: Pair) -> None:
    """Without the mark of a local sender it is told by what it says."""
    watch, frames = WatchReceiver(pair.ours), list[Frame]()
    asked: list[tuple[int, bytes]] = []

    def is_own(can_id: int, data: bytes, at: float) -> bool:
        asked.append((can_id, data))
        return data == b"ours"

    pair.sends(Frame(0x205, b"ours"), Frame(0x205, b"theirs"))
    assert watch.receive(frames, ANY, is_own) == 2
    assert [frame.data for frame in frames] == [b"theirs"]
    assert asked == [(0x205, b"ours"), (0x205, b"theirs")]
