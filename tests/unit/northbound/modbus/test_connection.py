"""The byte stream: any segmentation, any bytes, answers in order."""

from __future__ import annotations

import struct
from collections.abc import Callable
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.northbound.modbus.connection import Conversation
from tests.support.modbus_site import PLC, READY, Rig
from tests.support.nightly import examples


def adu(transaction: int, unit: int, pdu: bytes) -> bytes:
    return struct.pack(">HHHB", transaction, 0, len(pdu) + 1, unit) + pdu


def split(stream: bytes) -> list[tuple[int, int, bytes]]:
    """Answers as (transaction, unit, PDU); fails where the stream is not well formed."""
    found: list[tuple[int, int, bytes]] = []
    while stream:
        transaction, protocol, length, unit = struct.unpack(">HHHB", stream[:7])
        assert protocol == 0
        assert 2 <= length <= 254
        assert len(stream) >= 6 + length
        found.append((transaction, unit, stream[7 : 6 + length]))
        stream = stream[6 + length :]
    return found


def never() -> None:
    raise AssertionError("no answer is late here")


def talk(chunks: list[bytes], turn: int = 16) -> tuple[bytes, str]:
    rig = Rig()
    rig.runs(READY)
    conversation = Conversation(
        lambda unit, pdu, answer, at: rig.dispatcher.handle(unit, pdu, PLC, answer), never
    )
    answers = b""
    for chunk in chunks:
        conversation.receive(chunk)
        answers += conversation.advance(turn)
        while conversation.backlog:
            answers += conversation.advance(turn)
    return answers, conversation.fault


STREAM = b"".join(
    (
        adu(1, 1, bytes.fromhex("03 0000 000D")),
        adu(2, 1, bytes.fromhex("10 0000 0002 04 047E 2000")),
        adu(3, 1, bytes.fromhex("03 0000 0002")),
        adu(3, 7, bytes.fromhex("03 0000 0002")),
        adu(65535, 1, bytes.fromhex("2B 0E 01 00")),
        adu(0, 255, bytes.fromhex("04 0000 0005")),
        adu(9, 1, b"\x00"),
    )
)


@pytest.mark.landing
def test_every_cut_of_the_stream_gives_the_same_answers():
    whole, fault = talk([STREAM])
    assert fault == ""
    assert [(t, u) for t, u, _ in split(whole)] == [
        (1, 1),
        (2, 1),
        (3, 1),
        (3, 7),
        (65535, 1),
        (0, 255),
        (9, 1),
    ]
    for cut in range(1, len(STREAM)):
        assert talk([STREAM[:cut], STREAM[cut:]])[0] == whole
    assert talk([bytes((byte,)) for byte in STREAM])[0] == whole
    assert talk([STREAM], turn=1)[0] == whole


@settings(max_examples=examples(30), deadline=None)
@given(st.lists(st.integers(1, len(STREAM) - 1), max_size=8))
def test_random_cuts(cuts: list[int]):
    edges = [0, *sorted(cuts), len(STREAM)]
    assert talk([STREAM[a:b] for a, b in pairwise(edges)])[0] == talk([STREAM])[0]


def test_hundreds_of_pipelined_requests_are_answered_in_order():
    stream = b"".join(adu(i, 1, struct.pack(">BHH", 6, 1, i)) for i in range(500))
    answers, _ = talk([stream])
    expected = [(i, 1, struct.pack(">BHH", 6, 1, i)) for i in range(500)]
    assert split(answers) == expected


def test_what_is_not_modbus_ends_the_conversation_after_what_was():
    good = adu(1, 1, bytes.fromhex("03 0000 0001"))
    for bad in ("0002 0001 0006 01", "0002 0000 0001 01", "0002 0000 00FF 01", "0002 0000 0000 01"):
        answers, fault = talk([good + bytes.fromhex(bad) + good])
        assert [t for t, _, _ in split(answers)] == [1]
        assert fault


def test_late_answers_keep_the_order():
    pending: list[Callable[[bytes], None]] = []
    late: list[bytes] = []

    def handle(unit: int, pdu: bytes, answer: Callable[[bytes], None], received_at: float) -> None:
        if pdu[0] == 3:
            answer(b"\x03now")
        else:
            pending.append(answer)

    conversation = Conversation(handle, lambda: late.append(conversation.advance(16)))
    conversation.receive(adu(1, 1, b"\x10") + adu(2, 1, b"\x03") + adu(3, 1, b"\x10") + adu(4, 1, b"\x03"))
    assert conversation.advance(16) == b""
    pending[1](b"\x10second")
    assert late == [b""]
    pending[0](b"\x10first")
    assert [(t, p) for t, _, p in split(late[-1])] == [
        (1, b"\x10first"),
        (2, b"\x03now"),
        (3, b"\x10second"),
        (4, b"\x03now"),
    ]


def test_no_more_is_taken_in_than_can_be_remembered():
    pending: list[Callable[[bytes], None]] = []
    conversation = Conversation(lambda unit, pdu, answer, at: pending.append(answer), lambda: None)
    conversation.receive(b"".join(adu(i, 1, b"\x03") for i in range(100)))
    for _ in range(10):
        conversation.advance(16)
    assert len(pending) == 64
    assert conversation.is_full
    assert not conversation.backlog
    for answer in pending[:64]:
        answer(b"\x03")
    assert len(split(conversation.advance(16))) == 64
    assert conversation.backlog


FUNCTIONS = st.sampled_from([1, 2, 3, 4, 5, 6, 8, 15, 16, 22, 23, 43]) | st.integers(0, 255)
NEAR = st.integers(0, 80) | st.integers(0, 0xFFFF)


@st.composite
def pdus(draw: st.DrawFn) -> bytes:
    """Random bytes behind a function code, and requests that are nearly right."""
    function = draw(FUNCTIONS)
    if draw(st.booleans()):
        return bytes((function,)) + draw(st.binary(max_size=252))
    words = draw(st.lists(NEAR, min_size=1, max_size=20))
    start, tail = draw(NEAR), struct.pack(f">{len(words)}H", *words)
    if function == 16:
        return struct.pack(">BHHB", 16, start, len(words), len(tail)) + tail
    if function == 23:
        return struct.pack(">BHHHHB", 23, draw(NEAR), draw(NEAR), start, len(words), len(tail)) + tail
    return struct.pack(">BH", function, start) + tail


@pytest.mark.landing
@settings(max_examples=examples(300), deadline=None)
@given(st.lists(st.tuples(st.sampled_from([0, 1, 2, 9, 33, 255]), pdus()), max_size=12))
def test_any_request_gets_one_well_formed_answer(requests: list[tuple[int, bytes]]):
    rig = Rig()
    rig.runs(READY)
    for unit, pdu in requests:
        answer = rig.ask(pdu, unit)
        assert 2 <= len(answer) <= 253
        if answer[0] == pdu[0] | 0x80:
            assert len(answer) == 2
            assert answer[1] in (1, 2, 3, 4, 6, 0x0A, 0x0B)
        else:
            assert answer[0] == pdu[0]
        rig.now += 0.05


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(st.binary(max_size=300), max_size=5))
def test_any_bytes_give_well_formed_answers_or_the_end(chunks: list[bytes]):
    answers, _ = talk(chunks)
    split(answers)
