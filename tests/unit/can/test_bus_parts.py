"""The parts of a bus that need no kernel: error frames, bits on the wire, waiting frames, netlink."""

from __future__ import annotations

import contextlib
import errno
import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.can import bcm, netlink
from bridge.can.burstend import Burst
from bridge.can.errorframe import ControllerState, describe, judge
from bridge.can.explain import WrongBitrate, explain
from bridge.can.outbox import Outbox
from bridge.can.softbursts import SoftBursts
from bridge.can.wirebits import WireBits, exact_bits
from bridge.canopen.frame import EXTENDED, REMOTE, Frame

ERROR = 0x2000_0000


# error frames


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
    assert describe(ERROR | can_id, bytes.fromhex(data)).startswith(text)


def test_error_counters_come_with_any_class() -> None:
    frame = ERROR | 0x204, bytes.fromhex("0020000000008060")
    assert judge(*frame) == (ControllerState.PASSIVE, (0x80, 0x60))
    assert describe(*frame).endswith("128 transmit and 96 receive errors")


@given(st.integers(0, 0x1FFF_FFFF), st.binary(min_size=8, max_size=8))
def test_no_error_frame_raises(can_id: int, data: bytes) -> None:
    judge(can_id, data)
    assert describe(can_id, data)


# bits on the wire


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


# waiting frames


def test_a_frame_that_waited_too_long_is_never_sent() -> None:
    outbox, sent = Outbox(), list[Frame]()

    def take(frame: Frame, now: float) -> bool:
        sent.append(frame)
        return True

    outbox.put(Frame(0x605, b"old"), 0.0, 0.1)
    outbox.put(Frame(0x605, b"new"), 0.15, 0.25)
    assert outbox.send(0.2, take) == 1
    assert sent == [Frame(0x605, b"new")]
    assert outbox.retry_at is None


def test_the_order_is_kept_and_a_full_kernel_is_tried_again_soon() -> None:
    outbox, room, sent = Outbox(), 1, list[bytes]()

    def take(frame: Frame, now: float) -> bool:
        nonlocal room
        room -= 1
        if room < 0:
            return False
        sent.append(frame.data)
        return True

    for number in range(3):
        outbox.put(Frame(0x605, bytes((number,))), 0.0, 0.1)
    assert outbox.send(0.0, take) == 0
    assert outbox.retry_at == pytest.approx(0.001)
    room = 5
    outbox.send(0.001, take)
    assert sent == [b"\0", b"\1", b"\2"]


def test_the_outbox_is_bounded_and_may_be_cleared_while_it_sends() -> None:
    outbox = Outbox()
    assert sum(outbox.put(Frame(1), 0.0, 1.0) for _ in range(1000)) == 512

    def breaks(frame: Frame, now: float) -> bool:
        outbox.clear()
        return False

    assert outbox.send(0.0, breaks) == 0
    assert outbox.retry_at is None


# bursts


def test_a_burst_of_several_frames_takes_turns_and_keeps_its_place_when_renewed() -> None:
    beats = SoftBursts()
    frames = tuple(Frame(0x80, bytes((number,))) for number in range(1, 5))
    first = beats.start(Burst(frames, 0.01, 10), 0.0, at_once=False)
    sent = [first.data[0]] if first else []
    for step in range(1, 25):
        now = step * 0.01 + 1e-6
        if step % 4 == 0:
            assert beats.start(Burst(frames, 0.01, 10), now - 0.005, at_once=False) is None
        sent += [frame.data[0] for frame in beats.due(now)]
    assert sent == [number % 4 + 1 for number in range(len(sent))]
    assert len(sent) == 25


def test_bursts_in_step_are_due_together_and_none_sooner_than_at_a_multiple_of_its_period() -> None:
    beats = SoftBursts(in_step=True)
    starts = {0x205: 7.0031, 0x206: 7.0048, 0x080: 7.0}
    for can_id, start in starts.items():
        assert beats.start(Burst((Frame(can_id),), 0.01, 300), start, at_once=False) is not None
    wakes: list[float] = []
    while (due := beats.next_deadline()) is not None and len(wakes) < 200:
        wakes.append(due)
        assert [frame.can_id for frame in beats.due(due)] == [0x205, 0x206, 0x080]
    assert wakes == [step * 0.01 for step in range(701, 901)]


def test_a_burst_in_step_ends_no_later_than_one_that_is_not() -> None:
    ends: list[float] = []
    for in_step in (False, True):
        beats = SoftBursts(in_step=in_step)
        beats.start(Burst((Frame(0x205),), 0.01, 10), 7.0031, at_once=False)
        end = 7.0031
        for millisecond in range(7004, 7200):
            end = millisecond / 1000 if beats.due(millisecond / 1000) else end
        ends.append(end)
    assert ends[0] - 0.01 <= ends[1] <= ends[0]


def test_the_message_to_the_broadcast_manager() -> None:
    """<linux/can/bcm.h>, as a 64-bit kernel aligns it."""
    frames = (Frame(0x80, b"\1"), Frame(0x80, b"\2"))
    message = bcm.setup(frames, 0.0105, 9, start=False, at_once=False)
    head = struct.unpack_from("@IIIllllII", message)
    assert head == (1, 1, 9, 0, 10_500, 0, 0, 0x80, 2)
    assert message[-32:] == struct.pack("=IB3x8sIB3x8s", 0x80, 1, b"\1", 0x80, 1, b"\2")


# netlink


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


def test_the_wrong_bit_rate_is_told_with_what_helps() -> None:
    text = explain(WrongBitrate("can0", 500_000, 250_000), "can0")
    assert "can0 runs at 500000 bit/s, the site file says 250000" in text
    assert "ip link set can0 up type can bitrate 250000" in text
