"""Filters of CAN sockets: which identifiers the kernel lets in, and what where those are too many."""

from __future__ import annotations

import socket
import struct
from typing import cast

from bridge.can.cansockets import CanSockets

EFF_FLAG, RTR_FLAG = 0x8000_0000, 0x4000_0000
"""<linux/can.h>"""


class Raw:
    """Takes the filters that a socket is given."""

    def __init__(self) -> None:
        self.filters: list[tuple[int, int]] = []

    def setsockopt(self, level: int, name: int, value: bytes) -> None:
        assert (level, name) == (101, 1), "SOL_CAN_RAW, CAN_RAW_FILTER"
        self.filters = list(struct.iter_unpack("=II", value))

    def lets_in(self, can_id: int) -> bool:
        """The kernel's judgement: the frame's identifier and the filter's agree under the mask."""
        return any(can_id & mask == wanted & mask for wanted, mask in self.filters)


def filtered(*can_ids: int) -> Raw:
    raw = Raw()
    CanSockets("can0").accept(list(can_ids), cast("socket.socket", raw))
    return raw


def test_each_identifier_is_let_in_and_no_other() -> None:
    raw = filtered(0x185, 0x705, 0x000)
    assert [can_id for can_id in range(0x800) if raw.lets_in(can_id)] == [0x000, 0x185, 0x705]


def test_frames_of_29_bits_are_not() -> None:
    assert not filtered(0x185).lets_in(0x185 | EFF_FLAG)


def test_without_any_nothing_is_let_in() -> None:
    assert filtered().filters == []


def test_where_there_are_too_many_their_function_codes_are_let_in() -> None:
    can_ids = [function + node for function in (0x180, 0x280, 0x580, 0x700) for node in range(1, 128)] + [
        0x000
    ]
    raw = filtered(*can_ids)
    assert len(raw.filters) <= 512, "CAN_RAW_FILTER_MAX"
    assert all(raw.lets_in(can_id) for can_id in can_ids)
    assert not raw.lets_in(0x205)


def test_a_watching_socket_has_filters_of_its_own() -> None:
    sockets, raw = CanSockets("can0"), Raw()
    sockets.let_in(frozenset({0x205}), cast("socket.socket", raw))
    assert [can_id for can_id in range(0x800) if raw.lets_in(can_id)] == [0x205]
