"""Whatever comes over the wire, at whatever time, the node neither raises nor grows nor spins."""

from __future__ import annotations

import gc
import sys

from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import ERROR, EXTENDED, REMOTE, Frame
from bridge.sim.nord.nord_tu4 import NordTu4

OWN_IDS = [0x000, 0x080, 0x205, 0x305, 0x405, 0x505, 0x245, 0x605, 0x345, 0x705]
OWN_IDS += [0x705 | REMOTE, 0x205 | REMOTE]
INDICES = [0x1000, 0x1003, 0x1005, 0x1008, 0x100C, 0x100D, 0x1010, 0x1014, 0x1015, 0x1017, 0x1018, 0x1201]
INDICES += [0x1400, 0x1600, 0x1604, 0x1800, 0x1804, 0x1A00, 0x2066, 0x2069, 0x2097, 0x2098, 0x2201, 0x2230]
INDICES += [*range(0x20A0, 0x20B5), 0x221F, 0x2222, 0x22BC, 0x3000, 0x3001, 0x3002, 0x3004]

sdo_requests = st.builds(
    lambda command, index, sub, data: bytes([command]) + index.to_bytes(2, "little") + bytes([sub]) + data,
    st.sampled_from([0x40, 0x2F, 0x2B, 0x23, 0x22, 0x20, 0x21, 0x60, 0x70, 0x00, 0x10, 0x01, 0x80, 0xA0]),
    st.sampled_from(INDICES),
    st.integers(0, 20),
    st.one_of(st.binary(min_size=4, max_size=4), st.sampled_from([b"save", b"load", bytes(4), b"\1\0\0\0"])),
)
frames = st.one_of(
    st.builds(Frame, st.sampled_from(OWN_IDS), st.binary(max_size=8)),
    st.builds(Frame, st.just(0x605), sdo_requests),
    st.builds(Frame, st.just(0), st.sampled_from([bytes([c, 5]) for c in (1, 1, 1, 2, 0x80, 0x81, 0x82)])),
    st.builds(
        Frame, st.sampled_from([0x205, 0x305]), st.binary(min_size=7, max_size=7).map(lambda b: b + b"\0")
    ),
    st.builds(
        lambda low, rest: Frame(0x205, bytes([low, 0x04]) + rest),
        st.sampled_from([0x7E, 0x7F, 0x77, 0x7B, 0x7D, 0xFF, 0x00]),
        st.binary(min_size=6, max_size=6),
    ),
    st.builds(Frame, st.integers(0, 0x7FF).map(lambda i: i | ERROR | EXTENDED), st.binary(max_size=8)),
)
injections = st.sampled_from(["fail", "drop", "restore", "silence", "speak", "cycle", "off", "on"])


def inject(node: NordTu4, what: str, now: float) -> None:
    match what:
        case "fail":
            node.fail_drive("fu1", 30)
        case "drop":
            node.drop_drive("fu1")
        case "restore":
            node.restore_drive("fu1")
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


@settings(max_examples=150, deadline=None)
@given(
    steps=st.lists(
        st.tuples(st.floats(-0.1, 3.0, allow_nan=False), st.one_of(frames, frames, frames, injections)),
        max_size=60,
    ),
    fetch=st.booleans(),
)
def test_random_frames_and_times_do_no_harm(steps, fetch):
    node = NordTu4(5, p151_ms=500, ripple=0.01)
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
        if fetch:
            sent = node.take_frames()
            assert all(0 <= frame.can_id <= 0x7FF and len(frame.data) <= 8 for frame in sent)
    assert len(node.take_frames()) <= 256


def test_a_node_that_runs_for_long_needs_no_more_memory():
    node = NordTu4(5, p151_ms=50)
    node.start(0.0)
    node.on_frame(Frame(0, b"\x01\x05"), 0.3)

    def minutes(first: int, last: int) -> int:
        for second in range(60 * first, 60 * last):
            node.on_frame(Frame(0x205, bytes.fromhex("7F04002000000000")), float(second))
            node.on_frame(Frame(0x605, bytes.fromhex("4008100000000000")), second + 0.1)
            node.on_time(second + 0.2)  # P151 has run out
            node.on_frame(Frame(0x205, bytes.fromhex("FF04002000000000")), second + 0.3)
            node.on_time(second + 0.5)
        gc.collect()
        return sys.getallocatedblocks()

    first = minutes(1, 3)
    assert minutes(3, 20) - first < 500
