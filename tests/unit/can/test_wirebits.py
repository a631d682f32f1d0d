"""Bits of a frame on the wire, exact and estimated, against the bounds of ISO 11898-1."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.can.wirebits import WireBits, exact_bits
from bridge.canopen.frame import EXTENDED, REMOTE, Frame


@pytest.mark.parametrize(
    ("frame", "bits"),
    [
        # Known lengths without stuffing: 47 + 8 for each byte; the limits are those of CiA's tables.
        (Frame(0x555, b"\x55" * 8), range(111, 118)),
        (Frame(0x000), range(47, 56)),
        (Frame(0x000, bytes(8)), range(125, 136)),
        (Frame(0x705 | REMOTE), range(47, 56)),
        (Frame(0x1555_5555 | EXTENDED, b"\x55" * 8), range(131, 142)),
    ],
)
def test_bits_of_a_frame(frame: Frame, bits: range) -> None:
    assert exact_bits(frame) in bits


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_a_frame_has_no_more_stuff_bits_than_the_worst_case(can_id: int, data: bytes) -> None:
    frame = Frame(can_id, data)
    plain = 47 + 8 * len(data)
    assert plain <= exact_bits(frame) <= plain + (33 + 8 * len(data)) // 4


@pytest.mark.parametrize("zeros", [0, 4, 6])
def test_the_estimate_comes_close(zeros: int) -> None:
    wire, chance = WireBits(), random.Random(1)
    frames = [Frame(0x185, bytes(zeros) + chance.randbytes(8 - zeros)) for _ in range(6000)]
    for frame in frames[:5000]:
        wire.add(frame)
    begin = wire.total
    for frame in frames[5000:]:
        wire.add(frame)
    exact = sum(exact_bits(frame) for frame in frames[5000:])
    assert wire.total - begin == pytest.approx(exact, rel=0.05)
