"""Answers of the kernel about a network interface (rtnetlink), read byte by byte."""

from __future__ import annotations

import contextlib
import errno
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.can import netlink


def attribute(kind: int, value: bytes) -> bytes:
    whole = struct.pack("=HH", 4 + len(value), kind) + value
    return whole + bytes(-len(whole) % 4)


def link_message(*attributes: bytes, flags: int = 1) -> bytes:
    body = struct.pack("=BxHiII", 0, 280, 3, flags, 0) + b"".join(attributes)
    return struct.pack("=IHHII", 16 + len(body), 16, 0, 1, 0) + body


def statistics(rx: int, tx: int, rx_bytes: int, tx_bytes: int) -> bytes:
    return attribute(23, struct.pack("=24Q", rx, tx, rx_bytes, tx_bytes, *[0] * 20))


def test_what_a_real_interface_says() -> None:
    timing = struct.pack("=8I", 250_000, 875, 250, 6, 7, 2, 1, 2)
    data = attribute(1, timing) + attribute(4, struct.pack("=I", 2)) + attribute(6, struct.pack("=I", 100))
    data += attribute(8, struct.pack("=HH", 130, 7))
    info = attribute(18, attribute(1, b"can\0") + attribute(2, data))
    link = netlink.parse(link_message(info, statistics(100, 20, 800, 160)))
    assert link == netlink.Link(True, "can", 250_000, 2, 130, 7, 120, 960)


def test_a_vcan_counts_each_frame_twice_and_has_no_bit_rate() -> None:
    info = attribute(18, attribute(1, b"vcan\0"))
    link = netlink.parse(link_message(info, statistics(100, 100, 800, 800), flags=0))
    assert link == netlink.Link(is_up=False, kind="vcan", frames=100, data_bytes=800)


def test_there_is_no_such_interface() -> None:
    with pytest.raises(OSError) as caught:
        netlink.parse(struct.pack("=IHHIIi", 20, 2, 0, 1, 0, -errno.ENODEV))
    assert caught.value.errno == errno.ENODEV
    with pytest.raises(OSError):
        netlink.query("no-such-interface-anywhere")


@given(st.binary(max_size=200))
def test_no_answer_raises_anything_but_an_os_error(answer: bytes) -> None:
    for message in (answer, link_message(answer)):
        with contextlib.suppress(OSError):
            netlink.parse(message)
