"""Frames: the kernel's flags, and how a frame is printed."""

from __future__ import annotations

import socket

import pytest

from bridge.canopen import frame
from bridge.canopen.frame import Frame


def test_the_flags_of_an_identifier_are_the_kernels() -> None:
    assert frame.EXTENDED == socket.CAN_EFF_FLAG
    assert frame.REMOTE == socket.CAN_RTR_FLAG
    assert frame.ERROR == socket.CAN_ERR_FLAG
    assert frame.STANDARD_MASK == socket.CAN_SFF_MASK
    for flag in (frame.EXTENDED, frame.ERROR):
        assert repr(Frame(0x123 | flag)) == "123#", "a flag is no part of the identifier"


@pytest.mark.parametrize(
    ("one", "text"),
    [
        (Frame(0x085, b"\x00\x81"), "085#0081"),
        (Frame(0x705 | frame.REMOTE, b"\0"), "705#R00"),
        (Frame(0x1234567 | frame.EXTENDED), "1234567#"),
    ],
)
def test_how_a_frame_is_printed(one: Frame, text: str) -> None:
    assert repr(one) == text
    assert one.time == 0.0, "it has not been on the bus"
