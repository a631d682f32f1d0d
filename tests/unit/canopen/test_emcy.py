"""Emergency messages (CiA 301 §7.2.7): code, error register and the manufacturer's five bytes."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.emcy import Emergency, decode


def test_the_code_comes_first_with_its_low_byte() -> None:
    told = decode(bytes.fromhex("10 43 09 01 02 03 04 05"))
    assert told == Emergency(0x4310, 0x09, bytes((1, 2, 3, 4, 5)))


def test_a_message_without_the_manufacturers_bytes_is_one() -> None:
    assert decode(bytes.fromhex("000000")) == Emergency(0, 0, b"")


@pytest.mark.parametrize("data", [b"", b"\0", b"\0\0"])
def test_what_is_too_short_for_a_code_and_a_register_is_none(data: bytes) -> None:
    assert decode(data) is None


@given(st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.binary(max_size=5))
def test_whatever_was_sent_is_read(code: int, register: int, vendor: bytes) -> None:
    assert decode(struct.pack("<HB", code, register) + vendor) == Emergency(code, register, vendor)
