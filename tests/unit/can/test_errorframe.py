"""Error frames of the kernel in words, and what they say of the controller (<linux/can/error.h>)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.can.errorframe import ControllerState, describe, judge
from bridge.text import LANGUAGES, render

ERROR = 0x2000_0000


@pytest.mark.parametrize(
    ("can_id", "data", "state", "text"),
    [
        (0x001, "0000000000000000", None, "transmission timed out"),
        (0x002, "0B00000000000000", None, "arbitration lost in bit 11"),
        (0x002, "0000000000000000", None, "arbitration lost"),
        (0x004, "0001000000000000", None, "receive buffer overflow"),
        (0x004, "0008000000000000", ControllerState.WARNING, "warning level reached for transmit errors"),
        (
            0x004,
            "0030000000000000",
            ControllerState.PASSIVE,
            "error passive, receiving; error passive, transm",
        ),
        (0x004, "0040000000000000", ControllerState.OK, "error active again"),
        (0x088, "0000841900000000", None, "stuff error, while transmitting in ACK slot"),
        (0x008, "0000000000000000", None, "protocol violation"),
        (0x010, "0000000004000000", None, "CANH broken"),
        (0x0A0, "0000000000000000", None, "no acknowledge: nobody else on the bus, or another bit rate"),
        (0x040, "0000000000000000", ControllerState.BUS_OFF, "bus-off"),
        (0x080, "0000000000000000", None, "bus error"),
        (0x100, "0000000000000000", ControllerState.OK, "controller restarted"),
        (0x000, "0000000000000000", None, "unspecified error"),
    ],
)
def test_every_class_of_error_frame_is_told(
    can_id: int, data: str, state: ControllerState | None, text: str
) -> None:
    """<linux/can/error.h>"""
    assert judge(ERROR | can_id, bytes.fromhex(data)) == (state, None)
    assert str(describe(ERROR | can_id, bytes.fromhex(data))).startswith(text)


def test_error_counters_come_with_any_class() -> None:
    frame = ERROR | 0x204, bytes.fromhex("0020000000008060")
    assert judge(*frame) == (ControllerState.PASSIVE, (0x80, 0x60))
    assert str(describe(*frame)).endswith("128 transmit and 96 receive errors")


@given(st.integers(0, 0x1FFF_FFFF), st.binary(min_size=8, max_size=8))
def test_no_error_frame_raises(can_id: int, data: bytes) -> None:
    judge(can_id, data)
    assert all(render(describe(can_id, data), language) for language in LANGUAGES)
