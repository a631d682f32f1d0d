"""Whatever comes over the wire, at whatever time, an 8400 motec neither raises nor grows nor spins."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import ERROR, EXTENDED, REMOTE, Frame
from bridge.sim.lenze.lenze_drive import Reaction
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.lenze.lenze_settings import LenzeCodes

OWN_IDS = [0x000, 0x080, 0x205, 0x305, 0x605, 0x645, 0x705, 0x77F, 0x185 | REMOTE, 0x705 | REMOTE]
INDICES = [0x1000, 0x1003, 0x1005, 0x1006, 0x1014, 0x1016, 0x1017, 0x1018, 0x1201, 0x1400, 0x1401, 0x1600]
INDICES += [
    0x1800,
    0x1801,
    0x1A00,
    0x5FFD,
    0x5FF4,
    0x5FF3,
    0x5F9C,
    0x5F57,
    *range(0x5E7A, 0x5EBF),
    0x5DAE,
    0x5DAF,
]

sdo_requests = st.builds(
    lambda command, index, sub, data: bytes([command]) + index.to_bytes(2, "little") + bytes([sub]) + data,
    st.sampled_from(
        [0x40, 0x2F, 0x2B, 0x23, 0x22, 0x20, 0x21, 0x60, 0x70, 0x00, 0x10, 0x01, 0x80, 0xA0, 0xA4]
    ),
    st.sampled_from(INDICES),
    st.integers(0, 13),
    st.one_of(st.binary(min_size=4, max_size=4), st.sampled_from([bytes(4), b"\1\0\0\0", b"\5\2\0\x40"])),
)
frames = st.one_of(
    st.builds(Frame, st.sampled_from(OWN_IDS), st.binary(max_size=8)),
    st.builds(Frame, st.sampled_from([0x605, 0x645]), sdo_requests),
    st.builds(Frame, st.just(0), st.sampled_from([bytes([c, 5]) for c in (1, 1, 1, 2, 0x80, 0x81, 0x82)])),
    st.builds(
        lambda low, rest: Frame(0x205, bytes([low]) + rest),
        st.sampled_from([0x01, 0x09, 0x0D, 0x02, 0x81, 0x89]),
        st.binary(min_size=7, max_size=7),
    ),
    st.builds(Frame, st.integers(0, 0x7FF).map(lambda i: i | ERROR | EXTENDED), st.binary(max_size=8)),
)
injections = st.sampled_from(
    ["fail", "mend", "bus", "well", "supply", "silence", "speak", "cycle", "off", "on"]
)


def inject(node: LenzeMotec, what: str, now: float) -> None:
    match what:
        case "fail":
            node.fail(7, Reaction.TROUBLE)
        case "mend":
            node.mend(7)
        case "bus":
            node.bus_error(3)
        case "well":
            node.bus_error(0)
        case "supply":
            node.supply(there=False)
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


@settings(max_examples=200, deadline=None)
@given(
    steps=st.lists(
        st.tuples(st.floats(-0.1, 3.0, allow_nan=False), st.one_of(frames, frames, frames, injections)),
        max_size=60,
    ),
    master=st.integers(0, 1),
    fetch=st.booleans(),
)
def test_random_frames_and_times_do_no_harm(steps, master, fetch):
    codes = LenzeCodes(
        5,
        master=master,
        rpdo_reactions=[1, 2],
        bus_reactions=[4, 1, 4, 2, 1],
        watched_node=127,
        watched_ms=200,
    )
    node = LenzeMotec(5, codes=codes)
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
        node.on_time(newest)  # a command of C00002 is done after its answer
        deadline = node.next_deadline()
        assert deadline is None or deadline > newest, "nothing may be left to do at once"
        if fetch:
            sent = node.take_frames()
            assert all(0 <= frame.can_id <= 0x7FF and len(frame.data) <= 8 for frame in sent)
    assert len(node.take_frames()) <= 2 * 256
