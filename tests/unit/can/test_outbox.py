"""Frames that wait for a full kernel: in order, bounded, and never sent when they are too old."""

from __future__ import annotations

import pytest

from bridge.can.outbox import Outbox
from bridge.canopen.frame import Frame


def test_a_frame_that_waited_too_long_is_never_sent() -> None:
    outbox, sent = Outbox(), list[Frame]()

    def take(frame: Frame, now: float) -> bool:
        sent.append(frame)
        return True

    outbox.put(Frame(0x605, b"old"), 0.0, 0.1)
    outbox.put(Frame(0x605, b"new"), 0.15, 0.25)
    assert outbox.send(0.2, take) == 1
    assert sent == [Frame(0x605, b"new")]
    assert outbox.retry_at is None


def test_the_order_is_kept_and_a_full_kernel_is_tried_again_soon() -> None:
    outbox, room, sent = Outbox(), 1, list[bytes]()

    def take(frame: Frame, now: float) -> bool:
        nonlocal room
        room -= 1
        if room < 0:
            return False
        sent.append(frame.data)
        return True

    for number in range(3):
        outbox.put(Frame(0x605, bytes((number,))), 0.0, 0.1)
    assert outbox.send(0.0, take) == 0
    assert outbox.retry_at == pytest.approx(0.001)
    room = 5
    outbox.send(0.001, take)
    assert sent == [b"\0", b"\1", b"\2"]


def test_the_outbox_is_bounded_and_may_be_cleared_while_it_sends() -> None:
    outbox = Outbox()
    assert sum(outbox.put(Frame(1), 0.0, 1.0) for _ in range(1000)) == 512

    def breaks(frame: Frame, now: float) -> bool:
        outbox.clear()
        return False

    assert outbox.send(0.0, breaks) == 0
    assert outbox.retry_at is None
