"""Width of numbers: every form of an SDO answer × every type × every reader of the bridge.

The forms are those of CiA 301 §7.2.4.3.3–8; the frames are heard by the real SDO client.
"""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.bustools import scan
from bridge.canopen import width
from bridge.canopen.datatypes import INTEGERS, Integer
from bridge.cli.sdo_command import ValueType
from bridge.cli.sdo_command import decode as sdo_decode
from bridge.cli.sdo_command import surplus as sdo_surplus
from bridge.mapping.model import ObjectRef, Parameter
from bridge.node.boot.actions import number, same
from bridge.parameter import ParameterEntry
from bridge.parameter.codec import decode as parameter_decode
from bridge.parameter.codec import forms as parameter_forms
from bridge.parameter.codec import matches
from tests.support.sdo_client import Client

INDEX = 0x2001
KINDS: dict[str, Integer] = {name: one for name, one in INTEGERS.items() if name != "bool"}
VALUES = {
    name: [one.low, one.high, 0, 1, one.high // 3, -2 if one.signed else one.high - 1]
    for name, one in KINDS.items()
}
GARBAGE = bytes.fromhex("A55AC3A5")


def heard(*answers: bytes) -> bytes:
    """Result of the SDO client from these answers to a read of 2001h."""
    client = Client()
    client.read(INDEX)
    for answer in answers:
        client.answer(answer.hex())
    assert isinstance(client.result, bytes), client.result
    return client.result


def expedited(head: int, data: bytes) -> bytes:
    return bytes((head,)) + INDEX.to_bytes(2, "little") + b"\0" + data.ljust(4, b"\0")


def forms_of(data: bytes, *, negative: bool) -> dict[str, bytes]:
    """The same number as servers answer it."""
    found: dict[str, bytes] = {}
    length = len(data).to_bytes(4, "little")
    found["41h, by a segment"] = (
        heard(expedited(0x41, length), bytes((1 | (7 - len(data)) << 1,)) + data.ljust(7, b"\0"))
        if len(data) <= 7
        else b""
    )
    if len(data) <= 4:
        found["of its length"] = heard(expedited(0x43 | (4 - len(data)) << 2, data))
        found["42h, with zeros behind it"] = heard(expedited(0x42, data))
        found["42h, with garbage behind it"] = heard(expedited(0x42, (data + GARBAGE)[:4]))
        found["43h, with zeros behind it"] = heard(expedited(0x43, data))
        if negative:
            found["43h, with its sign behind it"] = heard(expedited(0x43, data.ljust(4, b"\xff")))
    return {form: answer for form, answer in found.items() if answer}


CASES = [
    pytest.param(kind, value, answer, id=f"{kind} {value} {form}")
    for kind, one in KINDS.items()
    for value in dict.fromkeys(VALUES[kind])
    for form, answer in forms_of(one.encode(value), negative=value < 0).items()
]


def entry(kind: str) -> ParameterEntry:
    definition = Parameter.model_validate({"name": "2001", "title": "", "data_type": kind})
    return ParameterEntry("2001", ObjectRef(INDEX, 0), definition)


@pytest.mark.landing(3)
@pytest.mark.parametrize(("kind", "value", "answer"), CASES)
def test_every_reader_takes_the_number_of_the_type(kind: ValueType, value: int, answer: bytes) -> None:
    size, data = KINDS[kind].size, KINDS[kind].encode(value)
    assert width.fitted(answer, size) == data
    assert sdo_decode(kind, answer) == value
    assert sdo_surplus(kind, answer) == ""
    assert parameter_decode(entry(kind), answer) == value
    assert matches(entry(kind), answer, data)
    if value >= 0:
        assert number(answer, size=size) == value
        assert scan._number(answer, size) == value  # pyright: ignore[reportPrivateUsage]
        assert same(answer, data)
    assert width.holds(answer, data, signed=KINDS[kind].signed)


@pytest.mark.landing(3)
@pytest.mark.parametrize(("kind", "value", "answer"), CASES)
def test_no_reader_takes_another_number_for_it(kind: str, value: int, answer: bytes) -> None:
    one = KINDS[kind]
    other = one.encode(value - 1 if value > one.low else value + 1)
    assert not width.holds(answer, other, signed=one.signed)
    assert not matches(entry(kind), answer, other)
    assert not same(answer, other)


@pytest.mark.landing(3)
@pytest.mark.parametrize(("kind", "value", "answer"), CASES)
def test_a_number_is_written_in_the_width_of_the_answer_and_in_that_of_its_type(
    kind: str, value: int, answer: bytes
) -> None:
    one = KINDS[kind]
    ways = list(parameter_forms(entry(kind), one.encode(value), answer))
    assert one.encode(value) in ways
    assert all(int.from_bytes(way, "little", signed=one.signed) == value for way in ways)
    if not isinstance(answer, width.Unsized):
        assert len(ways[0]) == len(answer)


def test_a_longer_object_is_not_taken_for_a_shorter_number() -> None:
    """65 541 in UNSIGNED32 is no UNSIGNED16 with 5: a configuration of 5 is written, not passed over."""
    answer = heard(expedited(0x43, bytes.fromhex("05000100")))
    assert not same(answer, b"\x05\0")
    assert "the node sent 4" in sdo_surplus("uint16", answer)


def test_a_number_of_64_bits_is_compared_and_written_in_other_widths_as_any() -> None:
    long, short = (5).to_bytes(8, "little"), (5).to_bytes(4, "little")
    assert width.holds(long, short)
    assert width.holds(short, long)
    assert list(width.forms(long, short)) == [short, long]
    assert list(width.forms(short, long)) == [long, short]


def test_more_than_64_bits_are_no_number() -> None:
    long, short = (5).to_bytes(9, "little"), (5).to_bytes(4, "little")
    assert not width.holds(long, short)
    assert not width.holds(short, long)
    assert list(width.forms(long, short)) == [long]
    assert list(width.forms(short, long)) == [short]


def test_a_text_is_written_as_it_is_first() -> None:
    assert list(width.forms(b"ab", b"wxyz", is_number=False)) == [b"ab", b"ab\0\0"]


@given(st.binary(max_size=12), st.binary(max_size=12), st.booleans())
def test_what_is_held_is_the_same_number_or_the_same_bytes(held: bytes, wanted: bytes, signed: bool) -> None:
    if width.holds(held, wanted, signed=signed) and held and wanted:
        short, long = sorted((held, wanted), key=len)
        assert long[: len(short)] == short
        assert set(long[len(short) :]) <= {0, 0xFF}
