"""Whatever comes over the wire, at whatever time, a CiA 402 drive neither raises nor grows nor spins."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import ERROR, EXTENDED, REMOTE, Frame
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.cia402.cia402_settings import Cia402Settings, Mode

OWN_IDS = [0x000, 0x080, 0x205, 0x305, 0x405, 0x505, 0x605, 0x77F, 0x705 | REMOTE, 0x185 | REMOTE]
INDICES = [
    0x1000,
    0x1003,
    0x1005,
    0x100C,
    0x100D,
    0x1010,
    0x1011,
    0x1014,
    0x1015,
    0x1016,
    0x1017,
    0x1018,
    0x1200,
]
INDICES += [
    0x1400,
    0x1403,
    0x1600,
    0x1601,
    0x1800,
    0x1A00,
    0x603F,
    0x6007,
    *range(0x6040, 0x6049),
    *range(0x605A, 0x6069),
]
INDICES += [
    0x606C,
    0x607A,
    0x607C,
    0x607D,
    0x607F,
    *range(0x6080, 0x6086),
    0x608F,
    0x6098,
    0x6099,
    0x60C2,
    0x60FF,
]

sdo_requests = st.builds(
    lambda command, index, sub, data: bytes([command]) + index.to_bytes(2, "little") + bytes([sub]) + data,
    st.sampled_from(
        [0x40, 0x2F, 0x2B, 0x23, 0x22, 0x20, 0x21, 0x60, 0x70, 0x00, 0x10, 0x01, 0x80, 0xA0, 0xA3, 0xC2]
    ),
    st.sampled_from(INDICES),
    st.integers(0, 9),
    st.one_of(
        st.binary(min_size=4, max_size=4), st.sampled_from([bytes(4), b"\1\0\0\0", b"\xc8\0\x7f\0", b"save"])
    ),
)
words = st.sampled_from([0x00, 0x02, 0x06, 0x07, 0x0F, 0x1F, 0x3F, 0x5F, 0x7F, 0x80, 0x10F])
frames = st.one_of(
    st.builds(Frame, st.sampled_from(OWN_IDS), st.binary(max_size=8)),
    st.builds(Frame, st.just(0x605), sdo_requests),
    st.builds(Frame, st.just(0), st.sampled_from([bytes([c, 5]) for c in (1, 1, 1, 2, 0x80, 0x81, 0x82)])),
    st.builds(
        lambda cob_id, word, rest: Frame(cob_id, word.to_bytes(2, "little") + rest),
        st.sampled_from([0x205, 0x405, 0x505]),
        words,
        st.binary(min_size=4, max_size=6),
    ),
    st.builds(Frame, st.just(0x605), words.map(lambda word: b"\x2b\x40\x60\0" + word.to_bytes(4, "little"))),
    st.builds(Frame, st.integers(0, 0x7FF).map(lambda i: i | ERROR | EXTENDED), st.binary(max_size=8)),
)
injections = st.sampled_from(["fail", "lasting", "mend", "silence", "speak", "cycle", "off", "on"])


def inject(node: Cia402Drive, what: str, now: float) -> None:
    match what:
        case "fail":
            node.fail(0x2310)
        case "lasting":
            node.fail(0x4310, lasting=True)
        case "mend":
            node.mend()
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
    mode=st.sampled_from(list(Mode)),
    fetch=st.booleans(),
)
def test_random_frames_and_times_do_no_harm(steps, mode, fetch):
    node = Cia402Drive(5, Cia402Settings(mode=mode, heartbeat_consumer=0x7F00C8))
    node.start(1000.0)
    now = newest = 1000.0
    for pdo in node.slave._store.current.rpdo:  # all of them, with control word and targets
        pdo.enabled = True
    enable = [Frame(0x605, bytes([0x2B, 0x40, 0x60, 0, word, 0, 0, 0])) for word in (6, 7, 15)]
    for wait, event in [(0.3, Frame(0, b"\x01\x05")), *((0.01, frame) for frame in enable), *steps]:
        now = max(0.0, now + wait)
        newest = max(newest, now)
        if isinstance(event, str):
            inject(node, event, newest)
        else:
            node.on_frame(event, now)
        node.on_time(now)
        node.on_time(newest)
        deadline = node.next_deadline()
        assert deadline is None or deadline > newest, "nothing may be left to do at once"
        position = node.axis.motor.position
        assert -0x8000_0000 <= round(position) <= 0x7FFF_FFFF
        if fetch:
            sent = node.take_frames()
            assert all(0 <= frame.can_id <= 0x7FF and len(frame.data) <= 8 for frame in sent)
    assert len(node.take_frames()) <= 256
