"""Identification of a drive over Modbus (function 43/14): whole, in answers that fit."""

from __future__ import annotations

import struct

from hypothesis import example, given
from hypothesis import strategies as st

from bridge.command import Identification
from bridge.northbound.modbus.pdu import PDU_MOST, Identify, identification_answer
from tests.support.modbus_site import (
    ENABLED,
    Rig,
)


def objects_of(answer: bytes) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    rest = answer[7:]
    while rest:
        found[rest[0]] = rest[2 : 2 + rest[1]]
        rest = rest[2 + rest[1] :]
    assert len(found) == answer[6]
    return found


def test_identification_is_that_of_the_drive():
    rig = Rig()
    rig.fu1.on_identification(Identification(0x38, 0x1234, 0x0001_0002, 7, "SK 200E"), rig.now)
    basic = rig.ask("2B 0E 01 00")
    assert basic[:6] == bytes.fromhex("2B 0E 01 83 00 00")
    assert objects_of(basic) == {0: b"Getriebebau NORD", 1: b"SK TU4-CAO", 2: b"1.2"}
    regular = objects_of(rig.ask("2B 0E 02 00"))
    assert (regular[4], regular[5], regular[6]) == (b"SK 200E", b"fu1", b"conveyor/fu1")
    extended = objects_of(rig.ask("2B 0E 03 00"))
    assert (extended[0x80], extended[0x83]) == (b"00000038", b"00000007")
    assert objects_of(rig.ask("2B 0E 03 82")) == {0x82: b"00010002", 0x83: b"00000007"}
    assert objects_of(rig.ask("2B 0E 01 04")) == objects_of(basic)  # not in the category: from the beginning


def test_identification_object_by_object():
    rig = Rig()
    assert objects_of(rig.ask("2B 0E 04 06", unit=2)) == {6: b"conveyor/fu2"}
    assert rig.ask("2B 0E 04 03") == b"\xab\x02"
    assert rig.ask("2B 0E 04 FF") == b"\xab\x02"
    assert objects_of(rig.ask("2B 0E 01 00", unit=255)) == {0: b"drivebridge", 1: b"drivebridge", 2: b"1.2.3"}


@given(st.dictionaries(st.integers(0, 255), st.binary(max_size=240), min_size=1))
@example({0: bytes(122), 1: bytes(120)})  # together 253 bytes
@example({0: bytes(122), 1: bytes(121)})
def test_identification_of_any_length_comes_whole_in_answers_that_fit(objects: dict[int, bytes]):
    """§6.21: asked again where an answer says that more follows, a client gets every object once."""
    wanted = dict(sorted(objects.items()))
    found: dict[int, bytes] = {}
    at = 0
    for _ in wanted:
        answer = identification_answer(Identify(3, at), wanted)
        assert len(answer) <= PDU_MOST
        came = objects_of(answer)
        assert came and not came.keys() & found.keys()
        found |= came
        more, at = answer[4], answer[5]
        rest = [number for number in wanted if number not in found]
        assert (more, at) == ((0xFF, rest[0]) if rest else (0, 0))
        if rest:
            # No answer is cut sooner than it has to be.
            assert len(answer) + 2 + len(wanted[rest[0]]) > PDU_MOST
        else:
            break
    assert found == wanted


def test_a_name_of_any_length_fits_into_an_answer():
    rig = Rig()
    rig.fu1.on_identification(Identification(1, 2, 3, 4, "drive " * 100), rig.now)
    rig.runs(ENABLED)
    for number in range(256):
        assert len(rig.ask(struct.pack(">BBBB", 0x2B, 0x0E, 4, number))) <= PDU_MOST
    answer = rig.ask("2B 0E 03 00")
    for _ in range(20):
        assert objects_of(answer), "a stream comes to its end"
        if not answer[4]:
            break
        answer = rig.ask(struct.pack(">BBBB", 0x2B, 0x0E, 3, answer[5]))
    assert not answer[4]


def test_long_identification_goes_on_where_it_says():
    texts = {0: b"a" * 200, 1: b"b" * 100, 2: b"c"}
    first = identification_answer(Identify(1, 0), texts)
    assert len(first) <= 253
    assert first[4:6] == b"\xff\x01"
    assert objects_of(first) == {0: texts[0]}
    second = identification_answer(Identify(1, 1), texts)
    assert second[4:6] == b"\x00\x00"
    assert objects_of(second) == {1: texts[1], 2: texts[2]}
