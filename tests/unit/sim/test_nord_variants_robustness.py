"""Whatever comes over the wire, at whatever time, no NORD node raises, grows or spins."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import REMOTE, Frame
from bridge.sim.nord.nord_node import NordNode
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, RJ45_54X, TU3
from bridge.sim.nord.nord_tu4 import NordTu4

NODES: dict[str, Callable[[], NordNode]] = {
    "tu3": lambda: NordSingle(5, TU3, p513_s=0.5, ripple=0.01),
    "rj45 5xx": lambda: NordSingle(5, RJ45_5XX, p513_s=0.5),
    "rj45 54x": lambda: NordSingle(5, RJ45_54X, p513_s=0.5),
    "cu4": lambda: NordTu4(5, kind="SK CU4-CAO", p151_ms=500),
    "profile": lambda: NordTu4(5, profile=True, p151_ms=500),
}
OWN_IDS = [0x000, 0x080, 0x205, 0x305, 0x405, 0x505, 0x605, 0x705 | REMOTE, 0x205 | REMOTE]
INDICES = [0x1003, 0x100C, 0x100D, 0x1010, 0x1011, 0x1014, 0x1017, 0x1400, 0x1600, 0x1601, 0x1604, 0x1800]
INDICES += [0x1801, 0x1A00, 0x1A01, 0x1A04, 0x2069, 0x2098, 0x20A5, 0x20A8, 0x20A8, 0x20A8, 0x2201, 0x21FD]
INDICES += [0x221F, 0x2222, 0x22EA, 0x3000, 0x3002, 0x3006, 0x6040, 0x6042, 0x6046, 0x6048, 0x6849, 0x60FE]
WORDS = [
    0x3000_0010,
    0x3002_0110,
    0x3003_0110,
    0x3006_0020,
    0x6040_0010,
    0x6042_0010,
    0x6044_0010,
    0x6841_0010,
]

sdo_requests = st.builds(
    lambda command, index, sub, data: bytes([command]) + index.to_bytes(2, "little") + bytes([sub]) + data,
    st.sampled_from([0x40, 0x2F, 0x2F, 0x2B, 0x2B, 0x23, 0x23, 0x60, 0x00, 0x80]),
    st.sampled_from(INDICES),
    st.integers(0, 6),
    st.one_of(
        st.binary(min_size=4, max_size=4),
        st.sampled_from([b"save", b"load", bytes(4), b"\1\0\0\0", b"\2\0\0\0"]),
        st.sampled_from([word.to_bytes(4, "little") for word in WORDS]),
    ),
)
frames = st.one_of(
    st.builds(Frame, st.sampled_from(OWN_IDS), st.binary(max_size=8)),
    st.builds(Frame, st.just(0x605), sdo_requests),
    st.builds(Frame, st.just(0x605), sdo_requests),
    st.builds(Frame, st.just(0), st.sampled_from([bytes([c, 5]) for c in (1, 1, 2, 0x80, 0x80, 0x81, 0x82)])),
    st.builds(
        lambda cob_id, low, rest: Frame(cob_id, bytes([low, 0x04]) + rest),
        st.sampled_from([0x205, 0x305, 0x405, 0x505]),
        st.sampled_from([0x7E, 0x7F, 0x7F, 0x77, 0x7B, 0x7D, 0xFF, 0x00]),
        st.binary(max_size=6),
    ),
)
injections = st.sampled_from(["silence", "speak", "power_cycle", "drop", "restore", "fail"])


def inject(node: NordNode, what: str) -> None:
    if what in ("silence", "speak", "power_cycle"):
        getattr(node, what)()
    elif isinstance(node, NordTu4):
        actions = {"fail": lambda: node.fail_drive(1, 30), "drop": lambda: node.drop_drive(1)}
        actions.get(what, lambda: node.restore_drive(1))()
    elif isinstance(node, NordSingle):
        if what == "fail":
            node.fail_drive(30)
        elif node.variant.has_interface:
            node.drop_drive() if what == "drop" else node.restore_drive()


@pytest.mark.parametrize("name", NODES)
@settings(max_examples=100, deadline=None)
@given(
    steps=st.lists(
        st.tuples(st.floats(-0.1, 1.0, allow_nan=False), st.one_of(frames, frames, frames, injections)),
        max_size=60,
    ),
    fetch=st.booleans(),
)
def test_random_frames_and_times_do_no_harm(name, steps, fetch):
    node = NODES[name]()
    node.start(1000.0)
    now = newest = 1000.0
    for wait, event in [(0.3, Frame(0, b"\x01\x05")), *steps]:
        now = max(0.0, now + wait)
        newest = max(newest, now)
        if isinstance(event, str):
            inject(node, event)
        else:
            node.on_frame(event, now)
        node.on_time(now)
        deadline = node.next_deadline()
        assert deadline is None or deadline > newest, "nothing may be left to do at once"
        if fetch:
            sent = node.take_frames()
            assert all(0 <= frame.can_id <= 0x7FF and len(frame.data) <= 8 for frame in sent)
    assert len(node.take_frames()) <= 256
