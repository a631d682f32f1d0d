"""Whatever comes over the wire, at whatever time, the simulated STÖBER neither raises nor grows nor spins."""

from __future__ import annotations

import gc
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import ERROR, EXTENDED, REMOTE, Frame
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000

OWN_IDS = [0x000, 0x080, 0x205, 0x305, 0x405, 0x505, 0x605, 0x625, 0x705, 0x705 | REMOTE, 0x205 | REMOTE]
INDICES = [0x1000, 0x1005, 0x1006, 0x1008, 0x100C, 0x100D, 0x1010, 0x1014, 0x1015, 0x1017, 0x1018, 0x1020]
INDICES += [0x1200, 0x1201, 0x1400, 0x1403, 0x1600, 0x1603, 0x1800, 0x1803, 0x1A00, 0x1A03]
INDICES += [0x2000, 0x200B, 0x20B4, 0x20E1, 0x20ED, 0x20F1, 0x2401, 0x26E6, 0x2808, 0x2830, 0x4000, 0x4001]

sdo_requests = st.builds(
    lambda command, index, sub, data: bytes([command]) + index.to_bytes(2, "little") + bytes([sub]) + data,
    st.sampled_from(
        [0x40, 0x2F, 0x2B, 0x23, 0x22, 0x20, 0x21, 0x60, 0x70, 0x00, 0x10, 0x01, 0x80, 0xA0, 0xC0]
    ),
    st.sampled_from(INDICES),
    st.integers(0, 7),
    st.one_of(
        st.binary(min_size=4, max_size=4),
        st.sampled_from([b"save", bytes(4), b"\1\0\0\0", b"\0\0\xb4\x20", b"\0\0\x08\x28", b"\x20\6\0\0"]),
    ),
)
frames = st.one_of(
    st.builds(Frame, st.sampled_from(OWN_IDS), st.binary(max_size=8)),
    st.builds(Frame, st.sampled_from([0x605, 0x605, 0x625]), sdo_requests),
    st.builds(Frame, st.just(0), st.sampled_from([bytes([c, 5]) for c in (1, 1, 1, 2, 0x80, 0x81, 0x82)])),
    st.builds(
        lambda channel, control, setpoint: Frame(0x105 + 0x100 * channel, bytes([control]) + setpoint),
        st.integers(1, 4),
        st.sampled_from([0, 1, 1, 2, 3, 4, 5]),
        st.binary(max_size=7),
    ),
    st.builds(Frame, st.integers(0, 0x7FF).map(lambda i: i | ERROR | EXTENDED), st.binary(max_size=8)),
)
injections = st.sampled_from(["fail", "last", "gone", "silence", "speak", "cycle", "off", "on"])


def inject(node: Stoeber5000, what: str, now: float) -> None:
    match what:
        case "fail":
            node.fail(31)
        case "last":
            node.fail(41, lasting=True)
        case "gone":
            node.cause_gone()
        case "silence":
            node.silence()
        case "speak":
            node.speak()
        case "cycle":
            node.power_cycle()
        case "off":
            node.power_off()
        case _:
            node.start(now)


@pytest.mark.parametrize("axes", [1, 4])
@settings(max_examples=100, deadline=None)
@given(
    steps=st.lists(
        st.tuples(st.floats(-0.1, 3.0, allow_nan=False), st.one_of(frames, frames, frames, injections)),
        max_size=60,
    ),
    fetch=st.booleans(),
)
def test_random_frames_and_times_do_no_harm(axes, steps, fetch):
    node = Stoeber5000(5, axes=axes)
    node.start(1000.0)
    now = newest = 1000.0
    for wait, event in [(0.3, Frame(0, b"\x01\x05")), *steps]:
        now = max(0.0, now + wait)
        newest = max(newest, now)
        if isinstance(event, str):
            inject(node, event, newest)
        else:
            node.on_frame(event, now)
        node.on_time(now)
        deadline = node.next_deadline()
        assert deadline is None or deadline > newest, "nothing may be left to do at once"
        assert sum(axis.blocks_others for axis in node.axes) <= 1, "one axis at a time"
        if fetch:
            sent = node.take_frames()
            assert all(0 <= frame.can_id <= 0x7FF and len(frame.data) <= 8 for frame in sent)
    assert len(node.take_frames()) <= 256


def test_a_node_that_runs_for_long_needs_no_more_memory():
    node = Stoeber5000(5)
    node.start(0.0)
    node.on_frame(Frame(0, b"\x01\x05"), 0.3)

    def minutes(first: int, last: int) -> int:
        for second in range(60 * first, 60 * last):
            node.on_frame(Frame(0x205, bytes.fromhex("01F401")), float(second))
            node.on_frame(Frame(0x605, bytes.fromhex("4008100000000000")), second + 0.1)
            node.fail(41)
            node.on_time(second + 0.2)
            node.on_time(second + 0.4)
            node.on_frame(Frame(0x205, bytes.fromhex("020000")), second + 0.5)
            node.on_frame(Frame(0x205, bytes.fromhex("000000")), second + 0.6)
        gc.collect()
        return sys.getallocatedblocks()

    first = minutes(1, 3)
    assert minutes(3, 20) - first < 500
